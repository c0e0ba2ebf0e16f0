"""Inverse kinematics of the arm: checks of poses, joints of a branch, messages about limits."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.arm import _kinematics_kernels as kernels

BRANCHES = ("forward, elbow up", "forward, elbow down", "backward, elbow up", "backward, elbow down")

SLACK = 1e-9  # rad or mm, chosen: rounding beyond a limit


class JointRanges(Protocol):
    """Limits of joints, with their names and units."""

    @property
    def position_min(self) -> Sequence[float]: ...
    @property
    def position_max(self) -> Sequence[float]: ...
    @property
    def names(self) -> Sequence[str]: ...
    @property
    def units(self) -> Sequence[str]: ...


class Links(JointRanges, Protocol):
    """Lengths and limits that the inversion needs; see `Arm`."""

    @property
    def lengths(self) -> tuple[float, float, float, float]: ...


class Excess(NamedTuple):
    """First joint beyond its limit or wrist out of reach; `share` of the joint's range or the arm's reach.

    `turns`: whether it is a turn from one pose to the next, of which poses between them may make two.
    """

    at: int
    text: str
    share: float
    turns: bool = False


def checked_poses(poses: npt.ArrayLike) -> Floats:
    """Check poses (m, 4, 4) of the tool, positions in mm."""
    try:
        array = np.ascontiguousarray(poses, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"poses must be numbers (mm); got {checks.shown(poses)}") from None
    if array.ndim != 3 or array.shape[1:] != (4, 4):
        raise ValueError(f"poses must be of shape (m, 4, 4); got {array.shape}")
    fault = int(kernels.first_fault(array))
    if fault >= 0:
        finite = bool(np.isfinite(array[fault]).all())
        rule = "a right-handed rotation and a place (mm) above 0, 0, 0, 1" if finite else "finite (mm)"
        raise ValueError(f"poses[{fault}] must be {rule}; got {array[fault].round(6).tolist()}")
    return array


def checked_runs(runs: Sequence[npt.ArrayLike]) -> list[Floats]:
    """Check runs of poses (m, 4, 4), none empty; errors name the run."""
    out = []
    for k, poses in enumerate(runs):
        try:
            out.append(checked_poses(poses))
        except (TypeError, ValueError) as error:
            raise type(error)(f"runs[{k}]: {error}") from None
        if not len(out[-1]):
            raise ValueError(f"runs[{k}] must have at least one pose; got none")
    return out


def joints_of(
    arm: Links, poses: Floats, radius: float, branch: int, continuous: bool
) -> tuple[Floats, Bools]:
    """Joints (m, 7) of checked poses in one branch, and whether the wrist is within reach (m,)."""
    joints, reached = np.empty((len(poses), 7)), np.empty(len(poses), dtype=np.bool_)
    middle = 0.5 * (np.array(arm.position_min) + np.array(arm.position_max))
    pitch, elbow = (-1.0 if branch >= 2 else 1.0), (1.0 if branch % 2 else -1.0)
    kernels.inverse(poses, arm.lengths, radius, pitch, elbow, middle, continuous, joints, reached)
    return joints, reached


def within_limits(arm: Links, joints: Floats) -> Bools:
    """Whether all joints are within their limits, (m,)."""
    low, high = np.array(arm.position_min) - SLACK, np.array(arm.position_max) + SLACK
    out: Bools = np.all((joints >= low) & (joints <= high), axis=1)
    return out


def excess(arm: Links, poses: Floats, radius: float, joints: Floats, reached: Bools) -> Excess | None:
    """Return the first excess of a limit, or None."""
    index = first_beyond(arm, joints, reached)
    if index < 0:
        return None
    if not reached[index]:
        return _beyond_reach(arm, poses[index], radius, index)
    return beyond_limit(arm, joints[index], index)


def first_beyond(robot: JointRanges, joints: Floats, reached: Bools) -> int:
    """Index of the first pose out of reach or with a joint beyond its limits, or -1."""
    low, high = np.array(robot.position_min) - SLACK, np.array(robot.position_max) + SLACK
    return int(kernels.first_beyond(joints, reached, low, high))


def _beyond_reach(arm: Links, pose: Floats, radius: float, index: int) -> Excess:
    d1, a2, a3, d5 = arm.lengths
    distance = float(np.hypot(radius, pose[2, 3] - d1 - d5 * pose[2, 2]))
    longest, shortest = a2 + a3, abs(a2 - a3)
    beyond = max(distance - longest, shortest - distance)
    text = (
        f"poses[{index}] is out of reach by {beyond:.4g} mm: its wrist is {distance:.6g} mm from the"
        f" shoulder, where q2 and q3 span {shortest:g} to {longest:g} mm (wrist_radius {radius:g} mm)"
    )
    return Excess(index, text, 1 + beyond / longest)


def beyond_limit(arm: JointRanges, joints: Floats, index: int) -> Excess:
    """Name the joint farthest beyond its limit."""
    low, high = np.array(arm.position_min), np.array(arm.position_max)
    beyond = np.maximum(low - joints, joints - high)
    j = int(np.argmax(beyond / (high - low)))
    unit = arm.units[j]
    text = (
        f"{arm.names[j]} must be in [{low[j]:.6g}, {high[j]:.6g}] ({unit}); got {joints[j]:.6g} at"
        f" poses[{index}], beyond by {beyond[j]:.4g} {unit}"
    )
    return Excess(index, text, float(beyond[j] / (high[j] - low[j])))
