"""Units of a plunge cycle: size against command as `hwsim.Log.read` compares them, and power against both."""

from collections.abc import Sequence
from math import isfinite, nan, pi
from typing import Any

import numpy as np

from sdpgrind.base.columns.mistakes import DeclaredTimes, Mistake, explained, in_unit, mistakes
from sdpgrind.base.columns.pairs import Contradiction, contradictions
from sdpgrind.base.columns.request import Bound, Request
from sdpgrind.base.columns.sheet import heading
from sdpgrind.base.columns.slopes import roughing_hold, slope_of
from sdpgrind.base.columns.source import ColumnNote, Source, source_of
from sdpgrind.base.unit_text import factor, near
from sdpgrind.plunge._identify.cycles import Cycle
from sdpgrind.plunge._model.problem import CycleProblem

ENERGY = (5.0, 200.0)  # chosen: J/mm^3, of any grinding; measured 29 and 23 on right cycles
_SETTLED = 3.0  # chosen: time constants, after which 5 % of the deflection still grow
_LEAST_RATIO = 6.0  # chosen: a wheel that wears more makes the slope fall out of its range
_SHORTEST = 0.005  # chosen: steps of a record over those of the controller; below, another unit is meant
_IDLE = 0.02  # chosen: quantile of the power that counts as that without contact
_UNITS = {"time": "s", "size": "mm", "command_rate": "mm/s", "grinding_power": "W"}
CANNOT_TELL = (
    f"units were not checked: that takes a hold of {_SETTLED:g} time constants, and a grinding ratio of"
    f" {_LEAST_RATIO:g} or more"
)


def refuse_other_units(each: Sequence[Cycle], problem: CycleProblem, data: Any) -> bool:
    """Refuse cycles whose columns contradict each other; return whether they could be checked."""
    told = [cycle for cycle in each if _tells(cycle, problem)]
    if not told:
        _refuse_other_time(each, problem)
        return False
    energies = [energy for cycle in told if isfinite(energy := _energy(cycle, problem))]
    energy = float(np.median(energies)) if energies else nan
    parts = [(cycle.time, {"size": cycle.size, "command_rate": cycle.command_rate}) for cycle in told]
    notes = _notes(data)
    bounds = {name: _bound(note) for name, note in notes.items() if name != "time"}
    for fault in contradictions(parts):
        found = mistakes(fault, parts, bounds, DeclaredTimes(notes["time"])) if isfinite(fault.times) else []
        raise ValueError(_refusal(fault.told, _possible(found, fault, energy)))
    if isfinite(energy) and not _is_meant(energy):
        raise ValueError(_of_power(energy, bounds["grinding_power"], problem))
    return True


def another_unit_told(each: Sequence[Cycle], data: Any) -> str:
    """Sentence on sizes that contradict the commands, with the unit that puts it right; else empty."""
    parts = [(cycle.time, {"size": cycle.size, "command_rate": cycle.command_rate}) for cycle in each]
    notes = _notes(data)
    bounds = {name: _bound(notes[name]) for name in ("size", "command_rate")}
    for fault in contradictions(parts):
        found = mistakes(fault, parts, bounds, DeclaredTimes(notes["time"])) if isfinite(fault.times) else []
        return _refusal(fault.told, found)
    return ""


def _refuse_other_time(each: Sequence[Cycle], problem: CycleProblem) -> None:
    """Refuse steps of time that no cycle of this machine has: milliseconds, or minutes."""
    step = float(np.median(np.concatenate([cycle.step for cycle in each])))
    longest = float(problem.time_constant or 0.0)
    if step >= longest or step < _SHORTEST * problem.sample_time:
        raise ValueError(
            f"time must be in s, with several rows in a time constant of {longest:.3g} s; its rows are"
            f" {step:.3g} s apart: declare its unit, as ('t', 'ms'), to hwsim.Log.read"
        )


def _tells(cycle: Cycle, problem: CycleProblem) -> bool:
    """Whether the slope of the size in the roughing hold is that of a settled deflection."""
    hold = roughing_hold(cycle.time, cycle.size, cycle.command_rate)
    if hold is None or not isfinite(hold.slope) or problem.model.grinding_ratio < _LEAST_RATIO:
        return False
    lasts = float(cycle.time[hold.end] - cycle.time[hold.begin])
    return lasts >= _SETTLED * float(problem.time_constant or 0.0)


def _energy(cycle: Cycle, problem: CycleProblem) -> float:
    """Power above that without contact, over the removal rate in the last fifth of the hold, J/mm^3."""
    hold = roughing_hold(cycle.time, cycle.size, cycle.command_rate)
    if hold is None:
        return nan
    time, size, power = (values[hold.last_fifth] for values in (cycle.time, cycle.size, cycle.grinding_power))
    sized, powered = np.isfinite(size), np.isfinite(power)
    if sized.sum() < 2 or not np.any(powered):
        return nan
    model = problem.model
    removed = slope_of(time[sized], size[sized]) * pi * model.work_diameter * model.width
    above = float(np.median(power[powered]) - np.nanquantile(cycle.grinding_power, _IDLE))
    return above / removed if removed else nan


def _is_meant(energy: float) -> bool:
    return ENERGY[0] <= energy <= ENERGY[1]


def _possible(found: list[Mistake], fault: Contradiction, energy: float) -> list[Mistake]:
    """Mistakes that make the power agree with the removal rate; all of them where power does not tell.

    Energy is power x time/(area x size): another unit of the command leaves it as it is.
    """
    agreeing = [
        one for one in found if _is_meant(energy / (1.0 if one.name == "command_rate" else fault.times))
    ]
    return agreeing or found


def _refusal(told: str, found: list[Mistake]) -> str:
    if not found:
        return f"{told}; see the units of the columns"
    return f"{explained(told, found)} to hwsim.Log.read"


def _of_power(energy: float, bound: Bound, problem: CycleProblem) -> str:
    low, high = ENERGY
    told = (
        f"grinding_power must be {low:g} ... {high:g} J/mm^3 of the volume removed at the greatest rate; got"
        f" {energy:.3g} J/mm^3"
    )
    used = factor(bound.unit, "W")
    units = [unit for unit in ("W", *near("W")) if _is_meant(energy * factor(unit, "W") / used)]
    if not units:
        return f"{told}: is the width another than {problem.model.width:g} mm?"
    return _refusal(told, [in_unit(bound, unit, 0) for unit in units])


def _notes(data: Any) -> dict[str, ColumnNote]:
    """How each quantity was read: as the file's notes say, else under our names and in our units."""
    source = getattr(data, "source", None)
    source = source if isinstance(source, Source) else source_of(data)
    held = {} if source is None else {note.name.removesuffix("_command"): note for note in source.columns}
    ours = {name: ColumnNote(name, unit, name, unit, "", 1.0) for name, unit in _UNITS.items()}
    return ours | {name: held[name] for name in ours if name in held}


def _bound(note: ColumnNote) -> Bound:
    """Column of a note, as a request for it."""
    name, unit = note.name.removesuffix("_command"), note.recorded or note.unit
    own = note.factor / factor(unit, note.unit)
    return Bound(
        Request(name, note.header, unit, own), 0, heading(note.header), unit, note.origin, note.factor
    )
