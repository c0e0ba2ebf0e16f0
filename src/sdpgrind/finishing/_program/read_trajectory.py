"""Reader of trajectories of ROS: joints and their speeds over time."""

import json
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats, shown
from sdpgrind.finishing._program.program_path import ProgramPath
from sdpgrind.finishing._program.trajectory import HEADER, NANOSECONDS

_TO_OURS = {"rad": 1.0, "m": 1000.0}  # rad, mm
_POINT = {"positions", "velocities", "time_from_start"}


def read_trajectory(text: str) -> ProgramPath:
    """Return the points of a ``trajectory_msgs/JointTrajectory`` in JSON, as `Motion.program` writes it.

    Raises
    ------
    ValueError
        When it is no such JSON, tells what is not known here, a point lacks a place or speed, or times do not
        rise; with the point.
    """
    try:
        told = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"text must be JSON; {' '.join(str(error).split())}") from None
    _keys(told, {"about", "units", "trajectory"}, "text")
    _keys(told["trajectory"], {"header", "joint_names", "points"}, "trajectory of the text")
    if told["trajectory"]["header"] != HEADER:
        raise ValueError(f"header of the text must be {json.dumps(HEADER)}: begin at once, no frame")
    names, factors = _joints(told["trajectory"]["joint_names"], told["units"])
    points = told["trajectory"]["points"]
    if not isinstance(points, list) or len(points) < 2:
        raise ValueError(f"text must have a list of two points or more; got {shown(points)}")
    for k, point in enumerate(points):
        _keys(point, _POINT, f"point {k} of the text")
    time = np.array([_seconds(point["time_from_start"], k) for k, point in enumerate(points)])
    for k in np.flatnonzero(np.diff(time) <= 0.0)[:1]:
        raise ValueError(f"text must have times that rise (s); that of point {k + 1} is {time[k + 1]:g}")
    joints, speeds = (_column(points, key, len(names)) * factors for key in ("positions", "velocities"))
    return ProgramPath("ros", time=time, joints=joints, speeds=speeds, names=names)


def _keys(told: Any, wanted: set[str], name: str) -> None:
    """Refuse what lacks a key, or has one that is not understood, such as accelerations."""
    if not isinstance(told, dict) or set(told) != wanted:
        got = ", ".join(map(str, told)) if isinstance(told, dict) else shown(told)
        raise ValueError(f"{name} must have {', '.join(sorted(wanted))}, and nothing else; got {got}")


def _joints(names: Any, units: Any) -> tuple[tuple[str, ...], Floats]:
    """Names of the joints, and factors of their units."""
    known = isinstance(names, list) and names and all(isinstance(each, str) for each in names)
    if not known or len(set(names)) < len(names):
        raise ValueError(f"joint_names of the text must be names, each once; got {shown(names)}")
    if (
        not isinstance(units, list)
        or any(each not in ("rad", "m") for each in units)
        or len(units) != len(names)
    ):
        raise ValueError(
            f"units of the text must be rad or m, one for each of {len(names)} joints; got {shown(units)}"
        )
    return tuple(names), np.array([_TO_OURS[unit] for unit in units])


def _seconds(told: Any, k: int) -> float:
    name = f"time_from_start of point {k} of the text"
    _keys(told, {"sec", "nanosec"}, name)
    sec, nano = told["sec"], told["nanosec"]
    if type(sec) is not int or type(nano) is not int or not (0 <= sec < 2**31 and 0 <= nano < NANOSECONDS):
        raise ValueError(
            f"{name} must be whole sec and nanosec, 0 to {NANOSECONDS - 1}; got {shown(sec)}, {shown(nano)}"
        )
    return sec + nano / NANOSECONDS


def _column(points: list[Any], key: str, count: int) -> Floats:
    """Values of all points (m, n)."""
    rows = np.empty((len(points), count))
    for k, (row, point) in enumerate(zip(rows, points, strict=True)):
        given = point[key]
        numbers = isinstance(given, list) and all(type(each) in (int, float) for each in given)
        if not numbers or len(given) != count or not all(abs(each) < 1e9 for each in given):
            raise ValueError(f"text must have {count} finite {key} a point; point {k} has {shown(given)}")
        row[:] = given
    return rows
