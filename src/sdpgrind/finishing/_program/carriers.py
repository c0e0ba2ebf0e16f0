"""Axes that carry the work, as programs see them: external axes of one mechanical unit."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.turns import shifted
from sdpgrind.finishing.arm._carriers import LinearTable
from sdpgrind.finishing.arm._mounted import MountedRobot


def alone(robot: Any) -> Any:
    """Return a robot without axes that carry the work."""
    return robot.robot if isinstance(robot, MountedRobot) else robot


def axis_names(robot: Any) -> tuple[str, ...]:
    """Return the names of the axes that carry the work, the first in the base."""
    return robot.axis_names if isinstance(robot, MountedRobot) else ()


def axis_units(robot: Any) -> tuple[str, ...]:
    """Return their units, "rad" or "mm"."""
    return tuple(axis.unit for axis in robot.axes) if isinstance(robot, MountedRobot) else ()


def carriers(robot: Any, joints: Floats) -> Floats:
    """Return the positions of the axes (m, e), rad or mm, of joints (m, n)."""
    return joints[:, len(alone(robot).names) :]


def unit_frame(robot: Any) -> Floats:
    """Return the frame (4, 4) of the unit on which the work lies, in the base with all axes at zero, mm."""
    return robot.axes[-1].frame if isinstance(robot, MountedRobot) else np.eye(4)


def levers(problem: Any, joints: Floats) -> Floats:
    """Return the ways (m, e) of the work at the contact, mm, per rad or mm of each axis, at joints (m, n)."""
    robot = problem.robot
    if not isinstance(robot, MountedRobot):
        return np.empty((len(joints), 0))
    return np.asarray(robot.ways(joints, shifted(problem.lever_arm)))


def described_unit(robot: Any, shown: Callable[[Floats], str]) -> Iterator[str]:
    """Yield what the controller has to be configured with, a frame as shown; nothing where the work rests."""
    if not isinstance(robot, MountedRobot):
        return
    yield "configure the unit so, all in the base of the robot with its axes at zero, mm:"
    for name, axis in zip(robot.axis_names, robot.axes, strict=True):
        if isinstance(axis, LinearTable):
            yield f"{name} moves its frame along {_row(axis.direction, 7)}, mm"
        else:
            yield f"{name} turns its frame by the right hand about {_row(axis.axis, 7)} through"
            yield f"{_row(axis.origin, 4)}, deg"
    yield f"frame on which the work lies: {shown(unit_frame(robot))}"
    yield "feeds are those of the contact over the work; the axes keep step with it along each move"


def _row(values: Any, decimals: int) -> str:
    return "[" + ", ".join(f"{value + 0.0:.{decimals}f}" for value in np.round(values, decimals)) + "]"
