"""Choice of the branch of any robot for a path."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm import _serial_kernels as kernels
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._branches import Way, choose_branches, jump, least_travel, refusal, travel_of
from sdpgrind.finishing.arm._inverse import Excess, beyond_limit, checked_poses, first_beyond
from sdpgrind.finishing.arm._robot import Robot, angular, middle
from sdpgrind.finishing.arm._serial import SerialRobot

_SINGULAR = "the robot comes through a singular pose"


class RobotChoice(NamedTuple):
    """Branch, values of redundant freedoms (mm, rad) by name, and joints (m, n) on a path.

    A freedom that varies is a spline over the length of the path, mm.
    """

    branch: int
    free: Mapping[str, float | BSpline]
    joints: Floats


def choose(robot: Robot, poses: Floats) -> RobotChoice:
    """Return the branch with the least travel of the joints along a path, and its joints.

    ValueError where no branch takes the path within the limits; with pose, joint and amount of the nearest.
    """
    if isinstance(robot, Arm):
        [chosen] = choose_branches(robot, [poses], wrist_radii=robot.wrist_radii)
        return RobotChoice(chosen.branch, {"wrist_radius": chosen.wrist_radius}, chosen.joints)
    courses, ways = _candidates(robot, checked_poses(poses))
    if all(way.wrong is not None for way in ways):
        _refuse(ways)
    names = [f"branch {k}" for k in range(len(ways))]
    [branch] = least_travel(robot, [ways], names)
    return RobotChoice(branch, _free(robot, branch, len(ways)), courses[branch])


def _candidates(robot: Robot, poses: Floats) -> tuple[list[Floats], list[Way]]:
    """Joints of every branch along a path, and what they take."""
    found, beyond = _solved(robot, poses)
    courses = [np.ascontiguousarray(found[:, k]) for k in range(found.shape[1])]
    return courses, [_way(robot, course, beyond[:, k], k) for k, course in enumerate(courses)]


def _solved(robot: Robot, poses: Floats) -> tuple[Floats, Floats]:
    """Joints of all branches (m, b, n), and mm out of reach (m, b), where the robot tells them."""
    if isinstance(robot, SerialRobot):
        return robot._solved(poses)
    found = np.asarray(robot.solutions(poses), dtype=float)
    if found.ndim != 3 or len(found) != len(poses) or found.shape[2] != len(robot.names):
        wanted = f"({len(poses)}, b, {len(robot.names)})"
        raise ValueError(f"solutions of the robot must be of shape {wanted}; got {found.shape}")
    return found, np.full(found.shape[:2], np.nan)


def _way(robot: Robot, joints: Floats, beyond: Floats, branch: int) -> Way:
    """One branch along a path; its joints are unwrapped in place."""
    missing = np.isnan(joints).any(axis=1)
    if missing.any():
        at = int(np.argmax(missing))
        return Way(joints[0], joints[-1], 0.0, _unreached(at, branch, beyond[at], float(missing.mean())))
    kernels.follow(joints, angular(robot), middle(robot))
    time, at = travel_of(robot, joints)
    if at >= 0:
        return Way(joints[0], joints[-1], time, jump(robot, joints, at, _SINGULAR))
    at = first_beyond(robot, joints, np.ones(len(joints), dtype=np.bool_))
    wrong = beyond_limit(robot, joints[at], at) if at >= 0 else None
    return Way(joints[0], joints[-1], time, wrong)


def _unreached(at: int, branch: int, beyond: float, share: float) -> Excess:
    """Name the first pose out of reach."""
    far = "" if np.isnan(beyond) else f" by {beyond:.4g} mm"
    text = f"poses[{at}] is out of reach{far}, with {100 * share:.3g} % of the path"
    return Excess(at, text, 1 + share)


def _refuse(ways: list[Way]) -> None:
    wrong = [(way.wrong, k) for k, way in enumerate(ways) if way.wrong is not None]
    found, branch = min(wrong, key=lambda each: each[0].share)
    raise refusal(each for each, _ in wrong)(
        f"no branch is within limits; nearest comes branch {branch}: {found.text}"
    )


def _free(robot: Robot, branch: int, count: int) -> dict[str, float]:
    """Values of the redundant freedoms in a branch; the first freedom varies slowest."""
    free, inside = {}, branch
    for freedom in robot.redundancy:
        count //= len(freedom.values)
        free[freedom.name] = freedom.values[min(inside // count, len(freedom.values) - 1)]
        inside %= count
    return free
