"""ControlStages of a planned cycle for a control that holds one infeed rate from size to size."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable
from sdpgrind.base.units import mm_per_min
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.exact import WAIT
from sdpgrind.plunge._plan.replay import Commands, CycleReplay, replay
from sdpgrind.plunge._plan.trajectory import PIECES

if TYPE_CHECKING:
    import xarray as xr

_VARIES = 0.01  # chosen: change of the command, of its greatest value, below which one rate holds it
_CUTS = (1, 2, 4, 8)  # chosen: constant rates for a changing one; an operator keys in no more


class ControlStage(NamedTuple):
    """Infeed of one constant rate.

    Attributes
    ----------
    name : str
        What limits the rate.
    rate : float
        Commanded infeed rate of radius, mm/s.
    begin, end : float
        Time, s.
    stock_begin, stock_end : float
        Remaining stock on the radius, mm.
    fed : float
        Commanded infeed since the start of the feed at the end of the stage, mm.
    """

    name: str
    rate: float
    begin: float
    end: float
    stock_begin: float
    stock_end: float
    fed: float


class ControlStages(NamedTuple):
    """The stages, and what the model makes of them: time (s), damage beyond its limit (mm)."""

    each: tuple[ControlStage, ...]
    time: float
    excess: float


def stages_of(
    problem: CycleProblem, course: "xr.Dataset", switches: tuple[float, ...], margin: float, deeper: float
) -> ControlStages:
    """Cut a course into constant rates, finer where damage would go `deeper` (mm) than its limit."""
    for cuts in _CUTS:
        each = _cut(course, switches, cuts)
        played = _played(problem, course, each, margin)
        if played.excess <= deeper:
            break
    return ControlStages(each, float(played.time[-1]), played.excess)


def _cut(course: "xr.Dataset", switches: tuple[float, ...], cuts: int) -> tuple[ControlStage, ...]:
    time, command, stock = (course[name].values for name in ("time", "command_rate", "remaining"))
    fed = stock[0] - stock + course.deflection.values
    found, begin = [], 0.0
    for end in switches:
        inside = (time > begin) & (time < end)
        kinds = course.piece.values[inside & (course.piece.values != WAIT)]
        name = PIECES[int(np.median(kinds))] if kinds.size else "infeed"
        varies = np.ptp(command[inside]) > _VARIES * command.max() if inside.any() else False
        ends = np.linspace(begin, end, cuts + 1 if varies else 2)
        sizes, travel = np.interp(ends, time, stock), np.interp(ends, time, fed)
        rates = np.diff(travel) / np.diff(ends)
        rates[np.abs(rates) < _VARIES**2 * command.max()] = 0.0  # rounding of a spark-out
        found += [
            ControlStage(name, *map(float, row))
            for row in zip(rates, ends[:-1], ends[1:], sizes[:-1], sizes[1:], travel[1:], strict=True)
        ]
        begin = end
    return tuple(found)


def _played(
    problem: CycleProblem, course: "xr.Dataset", each: tuple[ControlStage, ...], margin: float
) -> CycleReplay:
    """The stages in the model, from first touch."""
    touch = course.time.values[np.argmax(course.piece.values != WAIT)]
    begin, end = (np.maximum([getattr(stage, name) for stage in each], touch) for name in ("begin", "end"))
    middle = 0.5 * (begin + end)
    rotation: Floats = np.interp(middle, course.time.values, course.work_rotation.values)
    return replay(problem, Commands(np.array([stage.rate for stage in each]), end - begin, rotation), margin)


def stage_table(each: tuple[ControlStage, ...]) -> AmountTable:
    """Return the table that an operator keys in: mm always, to 0.1 µm, as a control takes it."""
    columns = (
        ("stage", [f"{k} {stage.name}" for k, stage in enumerate(each, 1)]),
        ("infeed rate [mm/s]", [f"{stage.rate:.5f}" for stage in each]),
        ("infeed rate [mm/min]", [f"{stage.rate / mm_per_min(1.0):.3f}" for stage in each]),
        ("from stock [mm]", [f"{stage.stock_begin:.4f}" for stage in each]),
        ("to stock [mm]", [f"{stage.stock_end:.4f}" for stage in each]),
        ("axis fed [mm]", [f"{stage.fed:.4f}" for stage in each]),
        ("takes [s]", [f"{stage.end - stage.begin:.2f}" for stage in each]),
        ("until [s]", [f"{stage.end:.2f}" for stage in each]),
    )
    caption = "Cycle to key into a control, by the stock left (rates, stock and travel of the radius)"
    return AmountTable(caption, [Amounts.of(name, values, heading=name) for name, values in columns])
