"""The robot of a finishing job: a preset or a URDF file, the tool in its flange, axes under the work."""

from pathlib import Path
from typing import Any

from hwsim.command._finishing.axes_toml import axes_of
from hwsim.command._toml import Table
from sdpgrind import finishing

AXES = ("z", "x")  # source: `finishing.tool`


def robot_of(table: Table, folder: Path) -> finishing.Robot:
    """Return the robot of a table; `folder` is that of the job, from which the path of a URDF file counts."""
    names = tuple(info.name for info in finishing.robots())
    if table.has("preset") == table.has("urdf"):
        raise ValueError(f"[{table.name}] must have a preset ({', '.join(names)}) or a urdf, one of them")
    preset = table.text("preset", names) if table.has("preset") else None
    robot = _of_urdf(table, folder) if preset is None else finishing.robot(preset)
    tool, axes = _tool(table, getattr(robot, "flange_axis", "z")), axes_of(table)
    table.done()
    if tool is not None:
        if not isinstance(robot, finishing.SerialRobot):
            raise ValueError(f"{table.path('tool_length')} must be left out for a robot without a flange")
        robot = table.made(robot.replace, tool=tool)
    return table.made(finishing.arm.mounted, robot, **axes) if axes else robot


def _of_urdf(table: Table, folder: Path) -> finishing.SerialRobot:
    """A robot of a URDF file, with the limits that such a file does not have."""
    ends = {key: table.take(key) for key in ("base", "tip")}
    limits = {"acceleration_max": table.number("acceleration_max", "rad/s^2")}
    limits |= table.given({"jerk_max": "rad/s^3"})
    path = table.file("urdf", folder)
    return table.made(finishing.SerialRobot.from_urdf, path, **ends, **limits)


def _tool(table: Table, ahead: str) -> Any:
    """Frame of the tool in the flange, along its axis `ahead` unless another is asked for; or None."""
    if not table.has("tool_length"):
        return None
    length, options = table.number("tool_length", "mm"), table.given({"tool_tilt": "rad"})
    tilt: dict[str, Any] = {"tilt": options["tool_tilt"]} if options else {}
    usual = ahead if ahead in AXES else "z"
    axis = table.text("tool_axis", AXES) if table.has("tool_axis") else usual
    return table.made(_named, length, axis=axis, **tilt)


def _named(length: float, **options: Any) -> Any:
    """Frame of a tool; a refusal names the key of the table: tool_length."""
    try:
        return finishing.tool(length, **options)
    except ValueError as error:
        raise ValueError(f"tool_{error}") from None
