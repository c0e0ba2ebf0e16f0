"""Least travel of a robot over candidates along a path, by dynamic programming from pose to pose."""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.arm import _spin_kernels as kernels
from sdpgrind.finishing.arm._inverse import SLACK
from sdpgrind.finishing.arm._robot import Robot, angular
from sdpgrind.finishing.arm._spin_states import SpinStates

FAR = 0.35  # rad, source: specification, greatest turn of a joint from pose to pose
SINGULAR = 0.1  # source: specification, least distance from a singular set, unit 1
_CHUNK = 200_000  # chosen: candidates solved at a time, some 10 MB


class Swept(NamedTuple):
    """Group, candidates (m,), and travel of the slowest joint along the path at full speed, s."""

    group: int
    picks: Any
    time: float


def swept(states: SpinStates, poses: Floats, *, held: bool = False) -> Swept:
    """Return the candidates of least travel along a path; ValueError where none leads to its end.

    From pose to pose no angle turns by more than `FAR`, the branch stays, and no candidate is within
    `SINGULAR` of a singular set. The least travel is exact unless a joint whose limits leave more than a turn
    travels farther than they leave beyond a turn: then a course may be missed that winds up less and costs
    more. `held`: the same candidate all along.
    """
    robot = states.robot
    low, high = (np.array(limit, dtype=float) for limit in (robot.position_min, robot.position_max))
    speed, turns = np.array(robot.speed_max, dtype=float), angular(robot)
    values = np.ascontiguousarray(states.values[:, states.bounded])
    found: list[Any] = []
    cost = course = np.empty(0)
    for start, part in _parts(poses, len(values)):
        joints = states.joints(part)
        kept = kept_of(robot, joints)
        before = np.empty(kept.shape, dtype=np.int32)
        if not found:
            cost, course = np.empty(kept.shape[1:]), np.empty((*kept.shape[1:], 3, joints.shape[3]))
        at = kernels.sweep(
            joints, kept, values, not found, low, high, turns, speed, FAR, SLACK, held, cost,
            course, before,
        )  # fmt: skip
        if at >= 0:
            _refuse(states.told, start + int(at), joints[at], kept[at])
        found.append(before)
    return _traced(cost, np.concatenate(found))


def _parts(poses: Floats, count: int) -> Any:
    """Starts and poses of parts that are solved at a time."""
    step = max(1, _CHUNK // (8 * count))
    return [(k, poses[k : k + step]) for k in range(0, len(poses), step)]


def kept_of(robot: Robot, joints: Floats) -> Bools:
    """Whether there are joints, and `SINGULAR` away from singular poses; joints (..., n)."""
    there: Bools = ~np.asarray(np.isnan(joints).any(axis=-1))
    kept: Bools = there & (distance_of(robot, np.where(there[..., None], joints, 0.0)) >= SINGULAR)
    return kept


def distance_of(robot: Robot, joints: Floats) -> Floats:
    """Distance from the nearest singular set, unit 1, (...)."""
    out: Floats = np.min(list(robot.singularities(joints).values()), axis=0)
    return out


def _traced(cost: Floats, before: Any) -> Swept:
    """Go back from the least cost."""
    group, last = np.unravel_index(int(np.argmin(cost)), cost.shape)
    picks = np.empty(len(before), dtype=np.int64)
    picks[-1] = last
    for i in range(len(before) - 1, 0, -1):
        picks[i - 1] = before[i, group, picks[i]]
    return Swept(int(group), picks, float(cost.min()))


def _refuse(told: str, at: int, joints: Floats, kept: Bools) -> None:
    """Refuse a path of which no candidate takes a pose."""
    there = int((~np.isnan(joints).any(axis=-1)).sum())
    way = "within limits" if at == 0 else f"within limits and {FAR:g} rad of one of the pose before"
    raise ValueError(
        f"no {told} takes poses[{at}]: of {kept.size} candidates {there} reach it,"
        f" {int(kept.sum())} are {SINGULAR:g} away from singular poses, none is {way}"
    )
