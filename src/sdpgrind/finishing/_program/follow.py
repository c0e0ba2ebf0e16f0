"""Followed path: straight lines with circular corners, turns at constant rates."""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.turns import between, inverse, poses_of, shifted, turns_of

PLACES = 10  # source: specification of the check, places a block
_CORNER = 8  # chosen: chords of a corner; they leave its circle by a hundredth of what it leaves the corner
_STRAIGHT = 1e-7  # rad, chosen: corners of less are straight


class FollowedPath(NamedTuple):
    """Nodes (m, 3) of the contact in the base, mm, quaternions (m, 4), and block (m - 1,) of each segment."""

    nodes: Floats
    turns: Floats
    blocks: Floats


def followed(path: Any, robot: Any, tool: Floats, lever: float) -> FollowedPath:
    """Follow the straight moves of a path with a robot whose contact is truly at `tool` in its flange."""
    start = robot.forward(path.approach[-1]) @ shifted(lever)
    commanded = path.work @ poses_of(path.points, path.turns) @ inverse(path.tool) @ tool
    poses = np.concatenate([start[None], commanded])
    return _rounded(poses[:, :3, 3], turns_of(poses), np.append(0.0, path.radii))


def _rounded(points: Floats, turns: Floats, radii: Floats) -> FollowedPath:
    """Nodes of straight parts and corners."""
    sizes = np.linalg.norm(np.diff(points, axis=0), axis=1)
    _check_blends(sizes, radii)
    lines = [_line(points, turns, radii, sizes, k) for k in range(len(sizes))]
    nodes, quaternions, blocks = [], [], []
    for k, (places, told) in enumerate(lines):
        first = 1 if k > 0 and radii[k] == 0.0 else 0  # an exact end is the next start
        nodes.append(places[first:])
        quaternions.append(told[first:])
        blocks += [k] * (len(places) - first)
        if k + 1 < len(lines) and radii[k + 1] > 0.0:
            after = lines[k + 1]
            corner = _corner(points[k : k + 3], radii[k + 1], told[-1], after[1][0])
            nodes.append(corner[0])
            quaternions.append(corner[1])
            blocks += [k] * len(corner[0])
    return FollowedPath(np.concatenate(nodes), np.concatenate(quaternions), np.array(blocks[1:]))


def _check_blends(sizes: Floats, radii: Floats) -> None:
    over = radii[:-1] + radii[1:] - sizes
    for k in np.flatnonzero(over > 0.0)[:1]:
        raise ValueError(
            f"text must have blends that do not overlap (mm); those of move {k + 1} do by {over[k]:.4g}"
        )
    if radii[-1] > 0.0:
        raise ValueError(f"text must end by an exact move (mm); got a blend of {radii[-1]:g}")


def _line(points: Floats, turns: Floats, radii: Floats, sizes: Floats, k: int) -> tuple[Floats, Floats]:
    """Straight part of move k, after the corner before it, to that behind it."""
    size = sizes[k] if sizes[k] > 0.0 else 1.0
    share = np.linspace(radii[k] / size, 1.0 - radii[k + 1] / size, PLACES + 1)
    places = points[k] + share[:, None] * (points[k + 1] - points[k])
    return places, between(turns[k], turns[k + 1], share)


def _corner(points: Floats, radius: float, before: Floats, after: Floats) -> tuple[Floats, Floats]:
    """Inner nodes of a circle that leaves the first line `radius` before the middle point."""
    ahead = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    behind = (points[2] - points[1]) / np.linalg.norm(points[2] - points[1])
    turn = 2.0 * float(np.arcsin(min(0.5 * float(np.linalg.norm(behind - ahead)), 1.0)))
    share = np.arange(1, _CORNER) / _CORNER
    if turn < _STRAIGHT:
        places = points[1] + radius * ((share - 1.0)[:, None] * ahead + share[:, None] * behind)
        return places, between(before, after, share)
    side = behind - (behind @ ahead) * ahead
    side /= np.linalg.norm(side)
    circle, angle = radius / np.tan(0.5 * turn), (share * turn)[:, None]
    places = points[1] - radius * ahead + circle * (np.sin(angle) * ahead + (1 - np.cos(angle)) * side)
    return places, between(before, after, share)
