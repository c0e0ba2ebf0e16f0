"""Candidates of a robot along a path: turns of the tool, positions of axes under the work, wrist radii."""

import math
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.arm import _spin_kernels as kernels
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._inverse import BRANCHES
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.arm._robot import Robot, angular, middle

MOST = 720  # chosen: turns of half a degree; more are beyond what is smoothed afterwards
_SAME = 1e-9  # rad, chosen: turns nearer than this are one


def checked_spin(name: str, value: Any) -> int | tuple[float, ...]:
    """Check turns of a tool: their number over a turn, or themselves (rad); (): none."""
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        if not 2 <= value <= MOST:
            raise checks.refuse(name, f"a number of values over a turn from 2 to {MOST}, or angles", value)
        return int(value)
    if not isinstance(value, tuple | list | np.ndarray):
        raise TypeError(
            f"{name} must be a number of values over a turn, such as 24, or a tuple of angles (rad);"
            f" got {checks.shown(value)}"
        )
    angles = checks.finite_array(name, value, "rad") if len(value) else np.empty(0)
    if angles.ndim != 1:
        raise ValueError(f"{name} must be one angle after another (rad); got shape {angles.shape}")
    for k in np.flatnonzero(np.abs(angles) > 2 * math.pi)[:1]:
        raise checks.refuse(f"{name}[{k}]", "within a turn; units.deg(90)", float(angles[k]), "rad")
    if angles.size and (np.diff(np.sort(angles)) < _SAME).any():
        raise checks.refuse(name, "of angles that differ", angles.tolist(), "rad")
    return tuple(angles.tolist())


class Spins(NamedTuple):
    """Turns of the tool about its axis (k,), rad; `around`: over whole turns, else between the outer ones."""

    angles: Floats
    around: bool


def spins_of(spin: int | tuple[float, ...]) -> Spins:
    """Return the turns that a checked value means."""
    if isinstance(spin, int):
        return Spins(2 * math.pi / spin * np.arange(spin, dtype=np.float64), True)
    return Spins(np.array(spin), False)


def spun(poses: Floats, angles: Any) -> Floats:
    """Return poses (m, 4, 4) of a tool that is turned about its own axis z by one angle or m, rad."""
    c, s = np.cos(angles)[..., None], np.sin(angles)[..., None]
    out = poses.copy()
    out[:, :3, 0] = c * poses[:, :3, 0] + s * poses[:, :3, 1]
    out[:, :3, 1] = c * poses[:, :3, 1] - s * poses[:, :3, 0]
    return out


class SpinStates(NamedTuple):
    """Candidates at every pose: `values` (c, f) of the freedoms `names` (f,), rad or mm, in every group.

    A group is a branch of the robot, of which a path takes one; of an `Arm`, its branches at any radius.
    `around` (f,): whether a freedom turns to any angle.
    """

    robot: Robot
    names: tuple[str, ...]
    values: Floats
    around: Bools

    @property
    def bounded(self) -> Bools:
        """Which freedoms (f,) are angles that stay between the outer candidates: turns of tool and tables."""
        angles = np.zeros(len(self.names), dtype=bool)
        angles[0] = True
        if isinstance(self.robot, MountedRobot):
            angles[1 : 1 + len(self.robot.axes)] = [axis.unit == "rad" for axis in self.robot.axes]
        return angles & ~self.around

    @property
    def wound(self) -> Bools:
        """Which joints (n,) are known but for whole turns: all that turn, less tables between candidates."""
        out = angular(self.robot)
        if isinstance(self.robot, MountedRobot):
            count = len(self.robot.axes)
            out[len(out) - count :] &= self.around[1 : 1 + count]
        return out

    @property
    def told(self) -> str:
        """What the planner chooses from, in words."""
        spun = np.ptp(self.values[:, 0]) > 0.0 or not isinstance(self.robot, MountedRobot)
        carried = self.robot.axis_names if isinstance(self.robot, MountedRobot) else ()
        return " and ".join(
            [*(["turn of the tool"] if spun else []), *(f"position of {name}" for name in carried)]
        )

    def joints(self, poses: Floats) -> Floats:
        """Joints (m, g, c, n) of all candidates at poses, rad or mm; NaN where there are none."""
        ways = [self.solved(poses, np.broadcast_to(value, (len(poses), value.size))) for value in self.values]
        return np.ascontiguousarray(np.stack(ways, axis=2))

    def solved(self, poses: Floats, values: Floats) -> Floats:
        """Joints (m, g, n) in every group, each pose with values (m, f) of its own."""
        turned = spun(poses, values[:, 0])
        if not isinstance(self.robot, MountedRobot):
            return _of_robot(self.robot, turned, values[:, 1:])
        carried = values[:, 1 : 1 + len(self.robot.axes)]
        inner = self.robot.carriage(carried) @ turned
        found = _of_robot(self.robot.robot, inner, values[:, 1 + len(self.robot.axes) :])
        return self.robot.with_axes(found, carried)


def states_of(robot: Robot, spins: Spins) -> SpinStates:
    """Return the candidates of a robot: turns, each with positions of its axes, and wrist radii of an arm."""
    inner = robot.robot if isinstance(robot, MountedRobot) else robot
    names, columns, around = ["spin"], [spins.angles], [spins.around]
    if isinstance(robot, MountedRobot):
        names += robot.axis_names
        columns += [np.array(axis.candidates) for axis in robot.axes]
        around += [axis.around for axis in robot.axes]
    if isinstance(inner, Arm):
        names.append("wrist_radius")
        columns.append(np.array(inner.wrist_radii))
        around.append(False)
    grids = np.meshgrid(*columns[::-1], indexing="ij")[::-1]  # the turn of the tool varies fastest
    values = np.stack([each.ravel() for each in grids], axis=1)
    return SpinStates(robot, tuple(names), values, np.array(around))


def _of_robot(robot: Robot, poses: Floats, rest: Floats) -> Floats:
    """Joints (m, b, n) of all branches of a robot; `rest` (m, 1): wrist radii of an arm."""
    if isinstance(robot, Arm):
        return _of_arm(robot, poses, np.ascontiguousarray(rest[:, 0]))
    found = np.asarray(robot.solutions(poses), dtype=float)
    if found.ndim != 3 or len(found) != len(poses) or found.shape[2] != len(robot.names):
        wanted = f"({len(poses)}, b, {len(robot.names)})"
        raise ValueError(f"solutions of the robot must be of shape {wanted}; got {found.shape}")
    return found


def _of_arm(arm: Arm, poses: Floats, radii: Floats) -> Floats:
    """Joints (m, 4, 7) of all branches of an arm."""
    out = np.empty((len(BRANCHES), len(poses), 7))
    for branch, joints in enumerate(out):
        pitch, elbow = (-1.0 if branch >= 2 else 1.0), (1.0 if branch % 2 else -1.0)
        kernels.inverse_of_radii(poses, arm.lengths, radii, pitch, elbow, middle(arm), joints)
    return np.swapaxes(out, 0, 1)
