"""Robots ready to use."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.preset_info import PresetInfo
from sdpgrind.base.units import deg
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._links import of_frames
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.arm._serial import SerialRobot

ACCELERATION, JERK = 10.0, 100.0  # rad/s^2, rad/s^3; chosen: no data sheet has them
_QUARTER = math.pi / 2


def _ur10() -> SerialRobot:
    # source: Universal Robots' published DH rows, as in the Robotics Toolbox (mdl_ur10); mm
    rows = [
        (0.0, 127.3, 0.0, _QUARTER), (0.0, 0.0, -612.0, 0.0), (0.0, 0.0, -572.3, 0.0),
        (0.0, 163.941, 0.0, _QUARTER), (0.0, 115.7, 0.0, -_QUARTER), (0.0, 92.2, 0.0, 0.0),
    ]  # fmt: skip
    return SerialRobot.from_dh(
        rows,
        position_min=(-2 * math.pi,) * 6,
        position_max=(2 * math.pi,) * 6,
        speed_max=_degrees(120, 120, 180, 180, 180, 180),  # source: makers' ROS packages
        acceleration_max=(ACCELERATION,) * 6,
        jerk_max=(JERK,) * 6,
    )


def _degrees(*angles: float) -> tuple[float, ...]:
    return tuple(deg(float(angle)) for angle in angles)


def _irb2400() -> SerialRobot:
    # source: ROS-Industrial, abb_irb2400_support, irb2400_macro.xacro; mm
    origins = [(0, 0, 0), (100, 0, 615), (0, 0, 705), (258, 0, 135), (497, 0, 0), (85, 0, 0)]
    axes = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
    frames = [np.eye(4) for _ in origins]
    for frame, origin in zip(frames, origins, strict=True):
        frame[:3, 3] = origin
    return SerialRobot(
        tuple(f"q{k}" for k in range(1, 7)),
        of_frames(frames, [np.array(axes[axis]) for axis in "zyyxyx"], np.eye(4)),
        position_min=_degrees(-180, -100, -60, -200, -120, -400),
        position_max=_degrees(180, 110, 65, 200, 120, 400),
        speed_max=_degrees(150, 150, 150, 360, 360, 450),
        acceleration_max=(ACCELERATION,) * 6,
        jerk_max=(JERK,) * 6,
    )


_ASSUMED = "accelerations of 10 rad/s^2 and jerks of 100 rad/s^3 are assumptions"
_PRESETS: dict[str, tuple[Callable[[], Arm | SerialRobot], str, str, str]] = {
    "generic": (
        Arm.generic,
        "an arm of five joints without wrist yaw over an xy table",
        "ours: a robot of common size",
        "all lengths and limits are assumptions",
    ),
    "ur10": (
        _ur10,
        "Universal Robots UR10, six joints, reach 1300 mm, axes 2, 3, 4 parallel",
        "published Denavit-Hartenberg rows, as in the Robotics Toolbox (mdl_ur10); speeds: ROS packages",
        f"each robot has its own calibration, and the manual of the CB3 prints other lengths; {_ASSUMED}",
    ),
    "irb2400": (
        _irb2400,
        "ABB IRB 2400, six joints, spherical wrist; the flange points along x: tool(length, axis='x')",
        "ROS-Industrial, abb_irb2400_support",
        f"the lever that couples axis 3 to axis 2 is left out, as in the source; {_ASSUMED}",
    ),
}


class KnownMaker(NamedTuple):
    """Model of a robot, its maker, and the target of programs that its controller takes."""

    robot: str
    maker: str
    language: str


_MAKERS = {
    "ur10": KnownMaker("UR10", "Universal Robots", "urscript"),
    "irb2400": KnownMaker("IRB 2400", "ABB", "rapid"),
}


def maker_of(robot: Robot) -> KnownMaker | None:
    """Return the maker of a robot whose links are those of a preset; None: it is not known."""
    if not isinstance(robot, SerialRobot):
        return None
    for name, maker in _MAKERS.items():
        made = _PRESETS[name][0]()
        assert isinstance(made, SerialRobot)  # of those whose maker is known
        if np.array_equal(made.links, robot.links):
            return maker
    return None


def robot(name: str) -> Arm | SerialRobot:
    """Return a robot ready to use, mm, rad, s; `robots` lists them.

    Parameters
    ----------
    name : {"generic", "ur10", "irb2400"}
        Name of the robot.

    Raises
    ------
    ValueError
        When there is no such robot.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> finishing.robot("ur10").forward([0.3, -1.5, 1.8, -1.8, -1.5, 0.1])[:3, 3].round(3)  # mm
    array([-617.343, -369.399,  468.718])
    """
    return _PRESETS[checks.one_of("name", name, _PRESETS)][0]()


def robots() -> tuple[PresetInfo, ...]:
    """Return name, content, source and assumptions of every robot ready to use (mm, rad, s).

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> [info.name for info in finishing.robots()]
    ['generic', 'ur10', 'irb2400']
    """
    return tuple(PresetInfo(name, *words) for name, (_, *words) in _PRESETS.items())
