"""Cycle over time as labelled arrays."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model.dynamics import burn_depth, core_at
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.exact import HOLD, LINE, START, TRACK, WAIT, ExactCourse
from sdpgrind.plunge._plan.replay import CycleReplay

if TYPE_CHECKING:
    import xarray as xr

BETWEEN = TRACK + 1  # kind of a sample like none of the exact course
PIECES = {
    WAIT: "touch-in",
    START: "full rate",
    TRACK: "on the limit of burning",
    HOLD: "constant rate",
    LINE: "spark-out",
    BETWEEN: "in between",
}
NEAR = 1e-3  # chosen: tolerance of the kind of a piece, in mm of damage; 10 times it of the greatest rate
_COLUMNS = {
    "remaining": ("mm", "remaining stock"),
    "infeed_rate": ("mm/s", "actual infeed rate"),
    "command_rate": ("mm/s", "commanded infeed rate"),
    "deflection": ("mm", "deflection of the machine"),
    "burn_depth": ("mm", "depth of damage (negative: what is left to it)"),
    "grinding_power": ("W", "power at the contact"),
    "wear_flat_area": ("1", "effective wear flat area"),
    "work_rotation": ("rad/s", "rotation of the work"),
}


def of_exact(problem: CycleProblem, course: ExactCourse) -> "xr.Dataset":
    """Label an exact course."""
    model, same = problem.model, np.ones(course.time.size)
    constant = model.wear_flat_area * same, model.work_rotation * same
    columns = (course.remaining, course.rate, course.command, course.y, *constant)
    return _labelled(problem, course.time, columns, course.kind)


def of_replay(problem: CycleProblem, played: CycleReplay, margin: float) -> "xr.Dataset":
    """Label replayed commands, with the time before touch in front."""

    def whole(first: float, column: Floats) -> Floats:
        return np.concatenate([[first], column])

    starts = (problem.stock, 0.0, problem.command_rate_max, 0.0, played.area[0], played.rotation[0])
    columns = (played.remaining, played.rate, played.command, played.y, played.area, played.rotation)
    kind = whole(WAIT, _kinds(problem, played, margin))
    rows = tuple(whole(x, column) for x, column in zip(starts, columns, strict=True))
    return _labelled(problem, whole(0.0, played.time), rows, kind)


def _labelled(
    problem: CycleProblem, time: Floats, columns: tuple[Floats, ...], kind: npt.ArrayLike
) -> "xr.Dataset":
    import xarray as xr  # slow to import; a controller needs none

    remaining, rate, command, y, area, rotation = columns
    model = problem.model
    core = core_at(model, rotation, area)
    values = {
        "remaining": remaining,
        "infeed_rate": rate,
        "command_rate": command,
        "deflection": np.where(np.asarray(kind) == WAIT, 0.0, y + model.core.K0),
        "burn_depth": damage(problem, rate, area, rotation),
        "grinding_power": np.where(
            rate > 0, core.power0 + core.power1 * rate + core.power2 * rate**core.p, 0.0
        ),
        "wear_flat_area": area,
        "work_rotation": rotation,
    }
    data: dict[str, Any] = {
        name: ("time", column, dict(zip(("units", "long_name"), _COLUMNS[name], strict=True)))
        for name, column in values.items()
    }
    meanings = ", ".join(f"{k}: {words}" for k, words in PIECES.items())
    data["piece"] = ("time", np.asarray(kind).astype(np.int16), {"long_name": meanings})
    return xr.Dataset(data, {"time": ("time", time, {"units": "s"})})


def damage(problem: CycleProblem, rate: Floats, area: Floats, rotation: Floats) -> Floats:
    """Depth of damage, mm; 0 at a rate of 0."""
    core = core_at(problem.model, rotation, area)
    return np.where(rate > 0, burn_depth(np.where(rate > 0, rate, 1.0), core), 0.0)


def _kinds(problem: CycleProblem, played: CycleReplay, margin: float) -> Floats:
    """Kind of each sample by its command and the distance of damage to its limit."""
    most = problem.command_rate_max
    room = np.maximum(played.remaining - margin, 0.0) - damage(
        problem, played.rate, played.area, played.rotation
    )
    kind = np.full(played.time.size, float(BETWEEN))
    kind[np.abs(played.command - played.rate) < 10 * NEAR * most] = HOLD
    kind[room < NEAR] = TRACK
    kind[played.command > most * (1 - 10 * NEAR)] = START
    kind[played.command < most * 10 * NEAR] = LINE
    return kind


def switches(course: "xr.Dataset") -> tuple[float, ...]:
    """Times (s) at which full rate ends, the last spark-out begins, and the cycle ends."""
    kind, time = course.piece.values, course.time.values
    slower = np.flatnonzero(~np.isin(kind, (WAIT, START)))
    commanded = np.flatnonzero(kind != LINE)
    ends = [time[slower[0] - 1]] if slower.size else []
    if commanded.size and commanded[-1] + 1 < kind.size:
        ends.append(time[commanded[-1]])
    return tuple(float(x) for x in np.unique([*ends, time[-1]]))
