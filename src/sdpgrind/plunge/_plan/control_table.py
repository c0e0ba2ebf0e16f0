"""Stages of a planned cycle for a control that holds one infeed rate from size to size."""

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable
from sdpgrind.base.units import mm_per_min, rpm
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.doubted import Safety, margin_and_doubts
from sdpgrind.plunge._plan.exact import HOLD, WAIT
from sdpgrind.plunge._plan.replay import replay_by_stock
from sdpgrind.plunge._plan.trajectory import PIECES

if TYPE_CHECKING:
    import xarray as xr

_VARIES = 0.01  # chosen: change of the command, of its greatest value, below which one rate holds it
_SIZE, _RATE = 1e-4, 1e-3  # chosen: digits that a control takes, mm and mm/min
_ROUNDING = 1e-6  # derived: keeps a rate that is already keyed in
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
    rotation : float
        Rotation of the work, rad/s.
    """

    name: str
    rate: float
    begin: float
    end: float
    stock_begin: float
    stock_end: float
    fed: float
    rotation: float


class ControlStages(NamedTuple):
    """The stages, and what the model makes of them as printed, switched by the stock.

    Time (s), damage beyond its limit (mm), out-of-roundness (mm), whether it reaches size.
    """

    each: tuple[ControlStage, ...]
    time: float
    excess: float
    roundness: float
    done: bool


def stages_of(
    problem: CycleProblem, course: "xr.Dataset", switches: tuple[float, ...], safety: Safety, deeper: float
) -> ControlStages:
    """Cut a course into constant rates; finer where damage goes `deeper` (mm), or the part is not round."""
    for cuts in _CUTS:
        each = _cut(course, switches, cuts, problem.model.wheel_wear)
        stages = _played(problem, each, safety)
        if stages.excess <= deeper and stages.roundness <= problem.roundness_max:
            break
    return stages


def _cut(
    course: "xr.Dataset", switches: tuple[float, ...], cuts: int, worn: float
) -> tuple[ControlStage, ...]:
    time, command, stock = (course[name].values for name in ("time", "command_rate", "remaining"))
    fed = (1.0 + worn) * (stock[0] - stock) + course.deflection.values
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
        turning = np.interp(0.5 * (ends[:-1] + ends[1:]), time, course.work_rotation.values)
        sizes, rates = _switched(sizes), _keyed(rates)
        found += [
            ControlStage(name, *map(float, row))
            for row in zip(
                rates, ends[:-1], ends[1:], sizes[:-1], sizes[1:], travel[1:], turning, strict=True
            )
        ]
        begin = end
    return tuple(stage for stage in found if stage.stock_begin > stage.stock_end)  # others are never entered


def _switched(sizes: Floats) -> Floats:
    """Stocks (mm) as keyed in, rounded up: a stage ends rather early."""
    return np.asarray(np.maximum(np.ceil(sizes / _SIZE - _ROUNDING), 0.0) * _SIZE)


def _keyed(rates: Floats) -> Floats:
    """Rates (mm/s) as keyed in: mm/min, rounded down."""
    return np.floor(rates / mm_per_min(1.0) / _RATE + _ROUNDING) * _RATE * mm_per_min(1.0)


def _played(problem: CycleProblem, each: tuple[ControlStage, ...], safety: Safety) -> ControlStages:
    """The stages in the model, from first touch."""
    rates, ends, rotation = (
        np.array([getattr(stage, name) for stage in each]) for name in ("rate", "stock_end", "rotation")
    )
    played = replay_by_stock(problem, rates, ends, rotation, *margin_and_doubts(problem, safety))
    ended = [float(np.interp(-end, -played.remaining, played.time)) for end in ends]
    timed = tuple(
        stage._replace(begin=begin, end=end)
        for stage, begin, end in zip(each, [0.0, *ended[:-1]], ended, strict=True)
    )
    model = problem.model
    depth = float(played.rate[-1]) * 2 * np.pi / float(rotation[-1])
    roundness = model.roundness_base + model.roundness_gain * depth
    return ControlStages(timed, float(played.time[-1]), played.excess, roundness, played.left <= ends[-1])


def stage_table(each: tuple[ControlStage, ...], rotation: float) -> AmountTable:
    """Return the table that an operator keys in: mm always, to 0.1 µm, as a control takes it.

    The work's rotation (rad/s) is shown where it is not that of the problem.
    """
    columns = (
        ("stage", [f"{k} {stage.name}" for k, stage in enumerate(each, 1)]),
        ("infeed rate [mm/s]", [f"{stage.rate:.5f}" for stage in each]),
        ("infeed rate [mm/min]", [f"{stage.rate / mm_per_min(1.0):.3f}" for stage in each]),
        ("from stock [mm]", [f"{stage.stock_begin:.4f}" for stage in each]),
        ("to stock [mm]", [f"{stage.stock_end:.4f}" for stage in each]),
        ("axis fed [mm]", [f"{stage.fed:.4f}" for stage in each]),
        ("takes [s]", [f"{stage.end - stage.begin:.2f}" for stage in each]),
        ("until [s]", [f"{stage.end:.2f}" for stage in each]),
        *_turning(each, rotation),
    )
    caption = "Cycle to key into a control, by the stock left (rates, stock and travel of the radius)"
    return AmountTable(caption, [Amounts.of(name, values, heading=name) for name, values in columns])


def faster_told(each: tuple[ControlStage, ...]) -> list[str]:
    """Sentence on each stage that feeds faster than the one before, as the limit no longer falls."""
    return [
        f"Stage {k} feeds faster than stage {k - 1}, in which the limit falls with the stock and deflection"
        " is given back; from here on the limit is constant."
        for k, (before, after) in enumerate(pairwise(each), 2)
        if after.name == PIECES[HOLD] and after.rate > before.rate > 0.0
    ]


def _turning(each: tuple[ControlStage, ...], own: float) -> list[tuple[str, list[str]]]:
    """Column of the rotation, where the plan chooses it."""
    if all(stage.rotation == own for stage in each):
        return []
    return [("work [rev/min]", [f"{stage.rotation / rpm(1.0):.1f}" for stage in each])]
