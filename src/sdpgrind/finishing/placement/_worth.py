"""Worth of placements: the least margin of the joints and distance from singular poses."""

from functools import reduce
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.arm._robot import Robot, middle
from sdpgrind.finishing.placement._task import PlacingTask

AT_ONCE = 40_000  # chosen: poses whose solutions are in memory together, some 20 MB
LOST = -1.0  # chosen: worth of poses out of reach, less their share; a joint beyond its limit counts no lower


class PlacementRows(NamedTuple):
    """Placements: origins (k, 3) in the base, mm, turns about z and azimuths on the work (k,), rad."""

    origin: Floats
    turn: Floats
    azimuth: Floats

    def take(self, index: npt.ArrayLike) -> "PlacementRows":
        """Some of the placements."""
        some = np.asarray(index)
        return PlacementRows(self.origin[some], self.turn[some], self.azimuth[some])


class Rating(NamedTuple):
    """Worth of placements (k,), unit 1, and their origins (k, 3), mm, with an arm's table at its best."""

    worth: Floats
    origin: Floats


Sides = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
"""Least and greatest x, y and z of the origin of the work, mm; infinite where free."""


def rated(task: PlacingTask, rows: PlacementRows, sides: Sides) -> Rating:
    """Rate placements by the poses of a task.

    The worth is the least, over the poses, of two shares: the distance of the joints from their limits over
    their range, and the distance from singular poses; of the branch in which it is greatest. Below 0: a joint
    is beyond its limit, or poses are out of reach. A tool that may spin takes the best turn at each pose,
    axes that carry the work their best candidates. Tables of an arm take the origin with the widest margin:
    that of `rows` counts along z only.
    """
    poses = {azimuth: _poses(task, azimuth) for azimuth in set(rows.azimuth.tolist())}
    free = _free(task)
    many, worth = max(1, AT_ONCE // (free * len(task.point))), np.empty(len(rows.turn))
    origin = rows.origin.copy()
    for begin in range(0, len(worth), many):
        part = slice(begin, begin + many)
        there = [poses[azimuth] for azimuth in rows.azimuth[part].tolist()]
        worth[part] = _rate(task, np.array(there), rows.turn[part], origin[part], sides)
    return Rating(worth, origin)


def _poses(task: PlacingTask, azimuth: float) -> Floats:
    """Poses on the work; NaN where the azimuth is along a normal."""
    try:
        return task.spun(task.poses(azimuth))
    except ValueError:
        return np.full((len(task.point) * max(1, len(task.hold.spins)), 4, 4), np.nan)


def _rate(task: PlacingTask, poses: Floats, turn: Floats, origin: Floats, sides: Sides) -> Floats:
    """Worth (k,) of poses (k, p, 4, 4) that are turned and shifted; the origins of a table in place."""
    robot, turned = task.robot, turned_by(poses, turn)
    wrong = np.isnan(turned[:, 0, 0, 0])  # all of such a placement
    turned[wrong] = np.eye(4)
    turned[:, :, 2, 3] += origin[:, None, 2]
    if not isinstance(robot, Arm):
        turned[:, :, :2, 3] += origin[:, None, :2]
    count, number = turned.shape[:2]
    found = robot.solutions(turned.reshape(-1, 4, 4))
    each = stations(robot)
    joints = found.reshape(count, number * each, found.shape[1] // each, -1)
    if isinstance(robot, Arm):
        joints, shift = _centred(robot, joints, sides)
    margin = margins(robot, joints, _free(task))
    best = margin.argmax(axis=1)
    if isinstance(robot, Arm):
        origin[:, :2] = shift[np.arange(count), best]
    return np.where(wrong, LOST - 2.0, margin[np.arange(count), best])


def stations(robot: Robot) -> int:
    """Return the number of places at which axes that carry the work may have it; 1: there are none."""
    return robot.combinations if isinstance(robot, MountedRobot) else 1


def _free(task: PlacingTask) -> int:
    """Turns of the tool times places of the work, of which each pose takes the best."""
    return max(1, len(task.hold.spins)) * stations(task.robot)


def turned_by(poses: Floats, turn: Floats) -> Floats:
    """Return poses (k, p, 4, 4), each set turned about z, rad."""
    turns = np.zeros((len(turn), 1, 4, 4))
    turns[:, 0, 0, 0] = turns[:, 0, 1, 1] = np.cos(turn)
    turns[:, 0, 1, 0] = np.sin(turn)
    turns[:, 0, 0, 1] = -turns[:, 0, 1, 0]
    turns[:, 0, 2, 2] = turns[:, 0, 3, 3] = 1.0
    out: Floats = turns @ poses
    return out


def _centred(arm: Arm, joints: Floats, sides: Sides) -> tuple[Floats, Floats]:
    """Joints (k, p, b, 7) with the travel of the table in its middle, and the origins for that (k, b, 2), mm.

    The margin of an axis is concave in the origin, so that the nearest origin within the sides is the best.
    """
    table = np.nan_to_num(joints[..., 5:])
    shift = 0.5 * (table.max(axis=1) + table.min(axis=1)) - middle(arm)[5:]
    low, high = (np.array([sides[0][k], sides[1][k]]) for k in range(2))
    shift = np.clip(shift, low, high)
    out = joints.copy()
    out[..., 5:] -= shift[:, None]
    return out, shift


def margins(robot: Robot, joints: Floats, free: int = 1) -> Floats:
    """Return the worth of every branch, (k, b), of joints (k, p free, b, n), the best of `free` at a pose."""
    share = _room(robot, joints)
    lost: Bools = np.isnan(share)
    inside = np.asarray(~lost & (share > 0))  # beyond a limit it does not matter how singular a pose is
    if inside.any():
        singular = reduce(np.minimum, robot.singularities(joints[inside]).values())
        share[inside] = np.minimum(share[inside], singular)
    if free > 1:
        parts = (len(joints), -1, free, joints.shape[2])
        share = np.where(lost, -np.inf, share).reshape(parts).max(axis=2)
        lost = np.asarray(lost.reshape(parts).all(axis=2))
    if not lost.any():
        return np.asarray(np.maximum(share.min(axis=1), LOST))
    each = np.maximum(np.where(lost, np.inf, share).min(axis=1), LOST)
    out: Floats = np.where(lost.any(axis=1), LOST - lost.mean(axis=1), each)
    return out


def _room(robot: Robot, joints: Floats) -> Floats:
    """Least distance of joints (..., n) from their limits over their ranges; NaN where one is."""
    low, high = np.array(robot.position_min), np.array(robot.position_max)
    each = joints - low
    np.minimum(each, high - joints, out=each)
    each /= high - low
    least: Floats = each[..., 0].copy()
    for k in range(1, each.shape[-1]):  # a reduction over so short an axis takes three times as long
        np.minimum(least, each[..., k], out=least)
    return least
