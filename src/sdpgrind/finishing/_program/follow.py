"""Followed path: straight lines with circular corners, turns at constant rates."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.carriers import axis_units, unit_frame
from sdpgrind.finishing._program.turns import between, inverse, poses_of, shifted, turns_of

PLACES = 10  # source: specification of the check, places a block
_CORNER = 8  # chosen: chords of a corner; they leave its circle by a hundredth of what it leaves the corner
_INNER = np.arange(1, _CORNER) / _CORNER
_STRAIGHT = 1e-7  # rad, chosen: corners of less are straight


class FollowedPath(NamedTuple):
    """Nodes (m, 3) of the contact in the work, mm, quaternions (m, 4), and block (m - 1,) of each segment.

    The work is where it lies in the base with the axes that carry it at zero; `axes` (m, e), rad or mm.
    """

    nodes: Floats
    turns: Floats
    blocks: npt.NDArray[np.int64]
    axes: Floats


def followed(path: Any, robot: Any, tool: Floats, lever: float) -> FollowedPath:
    """Follow the straight moves of a path with a robot whose contact is truly at `tool` in its flange.

    A controller that moves the work moves the tool with it: where the axes are does not change what the work
    sees of a straight move.
    """
    axes = positions(path, robot)
    start = robot.forward_work(np.concatenate([path.approach[-1], axes[0]])) @ shifted(lever)
    told = unit_frame(robot) @ path.work @ poses_of(path.points, path.turns)
    poses = np.concatenate([start[None], told @ inverse(path.tool) @ tool])
    return _rounded(poses[:, :3, 3], turns_of(poses), axes, np.append(0.0, path.radii))


def positions(path: Any, robot: Any) -> Floats:
    """Return the external axes (k + 1, e) at the start and the ends of all moves, rad or mm."""
    units = axis_units(robot)
    if path.axes.shape[1] != len(units):
        raise ValueError(
            f"text must have {len(units)} external axes, as the robot; got {path.axes.shape[1]} in its moves"
        )
    scale = np.array([np.pi / 180 if unit == "rad" else 1.0 for unit in units])
    return np.asarray(np.vstack([path.begun[None], path.axes]) * scale)


def _rounded(points: Floats, turns: Floats, axes: Floats, radii: Floats) -> FollowedPath:
    """Nodes of straight parts and corners."""
    sizes = np.linalg.norm(np.diff(points, axis=0), axis=1)
    _check_blends(sizes, radii)
    whole = np.where(sizes > 0.0, sizes, 1.0)
    share = np.linspace(radii[:-1] / whole, 1.0 - radii[1:] / whole, PLACES + 1, axis=1)
    places = points[:-1, None] + share[..., None] * np.diff(points, axis=0)[:, None]
    told = between(turns[:-1, None], turns[1:, None], share)
    count, blended = len(sizes), np.flatnonzero(radii[1:-1] > 0.0)
    nodes, quaternions = np.zeros((count, PLACES + _CORNER, 3)), np.zeros((count, PLACES + _CORNER, 4))
    nodes[:, : PLACES + 1], quaternions[:, : PLACES + 1] = places, told
    corners = points[blended], points[blended + 1], points[blended + 2]
    nodes[blended, PLACES + 1 :] = _corners(*corners, radii[blended + 1])
    before, after = told[blended, -1:], told[blended + 1, :1]
    quaternions[blended, PLACES + 1 :] = between(before, after, _INNER)
    carried = np.zeros((count, PLACES + _CORNER, axes.shape[1]))
    carried[:, : PLACES + 1] = _linear(axes[:-1, None], axes[1:, None], share)
    carried[blended, PLACES + 1 :] = _linear(
        carried[blended, PLACES : PLACES + 1], carried[blended + 1, :1], _INNER
    )
    there = np.zeros(nodes.shape[:2], dtype=bool)
    there[:, : PLACES + 1] = there[blended, PLACES + 1 :] = True
    there[1:, 0] = radii[1:-1] > 0.0  # an exact end is the next start
    return FollowedPath(nodes[there], quaternions[there], np.nonzero(there)[0][1:], carried[there])


def _linear(first: Floats, second: Floats, share: Floats) -> Floats:
    """Values at shares of the way from one to another."""
    return np.asarray(first + share[..., None] * (second - first))


def _check_blends(sizes: Floats, radii: Floats) -> None:
    over = radii[:-1] + radii[1:] - sizes
    for k in np.flatnonzero(over > 0.0)[:1]:
        raise ValueError(
            f"text must have blends that do not overlap (mm); those of move {k + 1} do by {over[k]:.4g}"
        )
    if radii[-1] > 0.0:
        raise ValueError(f"text must end by an exact move (mm); got a blend of {radii[-1]:g}")


def _corners(first: Floats, middle: Floats, last: Floats, radius: Floats) -> Floats:
    """Inner nodes (m, `_CORNER` - 1, 3) of circles that leave the first lines `radius` before the middle."""
    ahead, behind = _unit(middle - first), _unit(last - middle)
    turn = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(behind - ahead, axis=1), 1.0))
    share, radius = _INNER[:, None], radius[:, None, None]
    ahead, behind, middle = ahead[:, None], behind[:, None], middle[:, None]
    places = middle + radius * ((share - 1.0) * ahead + share * behind)
    bent = turn >= _STRAIGHT
    angle, ahead, behind = turn[bent, None, None], ahead[bent], behind[bent]
    side = _unit(behind - np.sum(behind * ahead, axis=-1, keepdims=True) * ahead)
    circle, way = radius[bent] / np.tan(0.5 * angle), share * angle
    begin = middle[bent] - radius[bent] * ahead
    places[bent] = begin + circle * (np.sin(way) * ahead + (1 - np.cos(way)) * side)
    return places


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
