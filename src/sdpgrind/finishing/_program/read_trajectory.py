"""Reader of trajectories of ROS: joints and their speeds over time."""

import json
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats, shown
from sdpgrind.finishing._program.program_path import ProgramPath

_TO_OURS = {"rad": 1.0, "m": 1000.0}  # rad, mm


def read_trajectory(text: str) -> ProgramPath:
    """Return the points of a ``trajectory_msgs/JointTrajectory`` in JSON, as `Motion.program` writes it.

    Raises
    ------
    ValueError
        When it is no such JSON, a point lacks a place or speed, or times do not rise; with the point.
    """
    try:
        told = json.loads(text)
        names, points = told["trajectory"]["joint_names"], told["trajectory"]["points"]
        factors = np.array([_TO_OURS[unit] for unit in told["units"]])
    except (ValueError, KeyError, TypeError) as error:
        rule = "JSON with units (rad or m) and a trajectory of joint_names and points"
        raise ValueError(f"text must be {rule}; {type(error).__name__}: {error}") from None
    if len(names) != len(factors) or len(points) < 2:
        raise ValueError(
            f"text must have a unit a joint and two points or more; got {len(factors)} units, {len(names)}"
            f" joints and {len(points)} points"
        )
    time = np.array([_seconds(point, k) for k, point in enumerate(points)])
    for k in np.flatnonzero(np.diff(time) <= 0.0)[:1]:
        raise ValueError(f"text must have times that rise (s); that of point {k + 1} is {time[k + 1]:g}")
    joints, speeds = (_column(points, key, len(names)) * factors for key in ("positions", "velocities"))
    return ProgramPath("ros", time=time, joints=joints, speeds=speeds)


def _seconds(point: Any, k: int) -> float:
    try:
        after = point["time_from_start"]
        return int(after["sec"]) + int(after["nanosec"]) / 1e9
    except (KeyError, TypeError, ValueError):
        raise ValueError(f"text must have sec and nanosec of time_from_start; point {k} has not") from None


def _column(points: list[Any], key: str, count: int) -> Floats:
    """Values of all points (m, n)."""
    rows = np.empty((len(points), count))
    for k, (row, point) in enumerate(zip(rows, points, strict=True)):
        try:
            row[:] = np.array(point[key], dtype=float).reshape(count)
        except (KeyError, TypeError, ValueError):
            rule = f"text must have {count} finite {key} a point"
            raise ValueError(f"{rule}; point {k} has {shown(point.get(key))}") from None
        if not np.isfinite(row).all():
            raise ValueError(
                f"text must have {count} finite {key} a point; point {k} has {shown(point[key])}"
            )
    return rows
