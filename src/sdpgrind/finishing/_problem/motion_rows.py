"""Rows of a motion: joints, feed and lever of all runs in sequence."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import BSpline

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.path._lifted_course import LiftedCourse
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._time_law import TimeLaw

SAMPLE_TIME = 0.004  # s, chosen: longest step between rows
# s, chosen: knots of a law of limited jerk are rows once in such a time, since it may have thousands in a
# second; splines through the rows are then off by some 1e-6 mm. Other knots are rows in any case.
CROWDED = 0.001
# of a run, chosen: inset from its ends at which the feed direction is that of the run, not of the next
INSIDE = 1e-7
VARYING = {
    "spin": {"units": "rad", "long_name": "turn of the tool about its own axis"},
    "wrist_radius": {"units": "mm", "long_name": "distance of the wrist from the first axis"},
}
"""Freedoms that may vary along a path: columns of a motion."""


def rows(problem: FinishingProblem, runs: Sequence[JointPath], laws: Sequence[TimeLaw]) -> xr.Dataset:
    """Return the rows of a motion: joints, feed and lever, no farther apart than `SAMPLE_TIME`."""
    begun, tables = 0.0, []
    for run, law in zip(runs, laws, strict=True):
        time = _times(law)
        course = law.at(time)
        by_length = run.derivatives(course.length)
        speed = by_length[:, 1] * course.feed[:, np.newaxis]
        inside = np.clip(course.length, run.length[0] + INSIDE * run.span, run.length[-1] - INSIDE * run.span)
        tables.append((begun + time, course.length, course.feed, by_length[:, 0], speed, inside))
        begun += law.duration
    time, length, feed, joints, speed, inside = (
        np.concatenate(column) for column in zip(*tables, strict=True)
    )
    lever = (
        problem.torque_per_force(problem.feed_angles(problem.path.at(inside))) if problem.pressed else None
    )
    table = _labelled(problem.robot, time, length, feed, joints, speed, lever)
    if isinstance(problem.path, LiftedCourse):
        on_work = problem.path.at(length).contact.astype(np.int8)
        table["contact"] = "row", on_work, {"units": "1", "long_name": "1 on the work, 0 in the air"}
    return table


def with_freedoms(
    table: xr.Dataset, free: Mapping[str, float | BSpline]
) -> tuple[dict[str, Floats], xr.Dataset]:
    """Return the values (m,) of redundant freedoms in all rows, and the rows with those that vary.

    Those of axes that carry the work are joints, of which the rows have them.
    """
    length, joints = table["length"].values, columns_of(table, free)
    values = {
        name: value(length) if isinstance(value, BSpline) else np.full(length.size, value)
        for name, value in free.items()
        if name not in joints
    }
    varying = {
        name: ("row", values[name], VARYING[name]) for name in values if isinstance(free[name], BSpline)
    }
    return values | joints, table.assign(varying) if varying else table


def columns_of(table: xr.Dataset, free: Iterable[str]) -> dict[str, Floats]:
    """Values (m,) of the freedoms that are in the rows: columns, and joints."""
    joints = table["joint"].values.tolist()
    held = {name: table["joints"].values[:, joints.index(name)] for name in free if name in joints}
    return held | {name: np.asarray(table[name].values) for name in VARYING if name in table}


def _times(law: TimeLaw) -> Floats:
    """Knots of a law, and times between them with steps of at most `SAMPLE_TIME`."""
    knots = _thinned(law.knots) if law.jerk.all() else law.knots
    parts = np.maximum(np.ceil(np.diff(knots) / SAMPLE_TIME).astype(int), 1)
    begin, step = np.repeat(knots[:-1], parts), np.repeat(np.diff(knots) / parts, parts)
    within = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    found = np.append(begin + within * step, knots[-1])
    times: Floats = found[np.append(True, np.diff(found) > 0)]
    return times


def _thinned(knots: Floats) -> Floats:
    """The first knot in every `CROWDED`, and the last."""
    kept = np.unique((knots[:-1] / CROWDED).astype(int), return_index=True)[1]
    return np.append(knots[kept], knots[-1])


def _labelled(
    robot: Robot,
    time: Floats,
    length: Floats,
    feed: Floats,
    joints: Floats,
    speed: Floats,
    lever: Floats | None,
) -> xr.Dataset:
    columns: dict[str, Any] = {
        "time": ("row", time, {"units": "s", "long_name": "time"}),
        "length": ("row", length, {"units": "mm", "long_name": "length of path behind"}),
        "feed_rate": ("row", feed, {"units": "mm/s", "long_name": "feed along the path"}),
        "joints": (("row", "joint"), joints, {"units": "joint_unit", "long_name": "joints"}),
        "joint_speed": (
            ("row", "joint"),
            speed,
            {"units": "joint_unit/s", "long_name": "speed of the joints"},
        ),
    }
    if lever is not None:
        told = {"units": "N m/N", "long_name": "motor torque for each N of normal force"}
        columns["torque_per_force"] = ("row", lever, told)
    return xr.Dataset(columns, {"joint": list(robot.names), "joint_unit": ("joint", list(robot.units))})
