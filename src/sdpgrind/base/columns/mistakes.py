"""Which single wrong declaration explains that two columns contradict each other, the most probable first."""

from collections.abc import Iterable
from math import isclose
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.pairs import Contradiction, Parts
from sdpgrind.base.columns.request import Bound, unit_of_name
from sdpgrind.base.columns.sheet import heading
from sdpgrind.base.columns.source import ColumnNote
from sdpgrind.base.unit_text import factor, near

_TRAVEL = (0.005, 5.0)  # mm; chosen: what a size or a removal moves in a part
_RATE = (1e-4, 1.0)  # mm/s; chosen: median of a feed that grinds
_STEP = (1e-5, 2.0)  # s; chosen: from a fast rig to a slow trace of a control
_DURATION = (0.3, 3600.0)  # s; chosen: a part
_NAMED = 3  # chosen: explanations in one sentence
_BY_FILE, _BY_RANGE, _UNDONE = (
    -3,
    -2,
    -1,
)  # chosen order of evidence: the file's own unit, an unusual value, a given factor
_FACTORS = {1.0: _UNDONE, 0.5: 0, -0.5: 0, -1.0: 1, 2.0: 3, -2.0: 3}
"""Factors of a declaration that mean something; how improbable each is."""


class DeclaredTimes(NamedTuple):
    """Declaration of the times: the note of their column, and the period (s) where there is no column."""

    note: ColumnNote
    period: float | None = None


class Mistake(NamedTuple):
    """What is meant, the call that says so, how improbable it is, and the quantity declared wrongly."""

    words: str
    call: str
    rank: int
    name: str


def mistakes(
    fault: Contradiction, each: Parts, bounds: dict[str, Bound], clock: DeclaredTimes
) -> list[Mistake]:
    """Single declarations that put a contradiction right, the most probable first."""
    way, rate = bounds[fault.first], bounds[fault.second]
    inverse = 1 / fault.times
    moved = [columns[fault.first] for _, columns in each]
    fed = [columns[fault.second] for _, columns in each]
    travel, speed = _median(map(_travel, moved)), _median(map(_speed, fed))
    found = [
        *_units(way, fault.times, travel, _TRAVEL, _is_one_of(fault.times, 1000.0, 25.4)),
        *_units(rate, inverse, speed, _RATE, _is_one_of(fault.times, 60.0, 1000 / 60)),
        *_times(clock, inverse, [time for time, _ in each]),
        *_factors(way, fault.times),
        *_factors(rate, inverse),
    ]
    return sorted(found, key=lambda one: one.rank)


def explained(told: str, found: list[Mistake]) -> str:
    """Tell a contradiction with the first of the mistakes that explain it."""
    return f"{told}: " + ", or ".join(f"{one.words}? Say {one.call}" for one in found[:_NAMED])


def in_unit(each: Bound, unit: str, rank: int) -> Mistake:
    """The mistake that a column is in another unit; a unit that the file itself says is the most probable."""
    name = each.request.name
    by_file = _rank(unit, each.unit, each.heading.unit, unit_of_name(name))
    words = f"{name} in {unit}, not {each.unit}"
    return Mistake(words, each.call(unit=unit), rank if by_file is None else by_file, name)


def sentence(fault: Contradiction, found: list[Mistake], bounds: dict[str, Bound]) -> str:
    """Tell a contradiction with what explains it; without an explanation, with the factor of either."""
    told = fault.told
    if found:
        told = explained(told, found)
    elif fault.times == fault.times:
        calls = bounds[fault.first].call(times=fault.times), bounds[fault.second].call(times=1 / fault.times)
        told += f": say {' or '.join(calls)}"
    return f"{told} (plausible=False takes it as it is)"


def _is_one_of(times: float, *factors: float) -> bool:
    return any(isclose(times, f, rel_tol=1e-6) or isclose(times * f, 1.0, rel_tol=1e-6) for f in factors)


def _median(values: Iterable[float]) -> float:
    return float(np.median(list(values)))


def _travel(values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(np.subtract(*np.quantile(known, [0.98, 0.02]))) if known.size else 0.0


def _speed(values: Floats) -> float:
    sizes = np.abs(values[np.isfinite(values) & (values != 0)])
    return float(np.median(sizes)) if sizes.size else 0.0


def _inside(value: float, usual: tuple[float, float]) -> bool:
    return usual[0] <= value <= usual[1]


def _other_unit(written: str, ours: str, times: float) -> str | None:
    """Unit that is `times` the one that was written."""
    if not written:
        return None
    used = factor(written, ours)
    fitting = (
        unit for unit in (ours, *near(ours)) if isclose(factor(unit, ours) / used, times, rel_tol=1e-6)
    )
    return next(fitting, None)


def _units(each: Bound, times: float, value: float, usual: tuple[float, float], first: bool) -> list[Mistake]:
    """Another unit of a column, if it leaves the column what is usual."""
    unit = _other_unit(each.unit, unit_of_name(each.request.name), times)
    if unit is None or not _inside(value * times, usual):
        return []
    return [in_unit(each, unit, int(not first) if _inside(value, usual) else _BY_RANGE)]


def _rank(unit: str, written: str, of_file: str | None, ours: str) -> int | None:
    """Whether the file itself says another unit than the call; None: it says nothing."""
    if of_file is None or of_file == written:
        return None
    try:
        return _BY_FILE if isclose(factor(of_file, ours), factor(unit, ours)) else None
    except ValueError:
        return None


def _times(clock: DeclaredTimes, times: float, each: list[Floats]) -> list[Mistake]:
    """Another unit of the time, if steps and durations are usual then; stamps and waveforms know theirs."""
    steps = _median(float(np.median(np.diff(time))) if time.size > 1 else 0.0 for time in each)
    lasts = _median(float(time[-1] - time[0]) if time.size else 0.0 for time in each)
    if times < 0 or not _is_usual(steps * times, lasts * times):
        return []
    rank = 1 if _is_usual(steps, lasts) else _BY_RANGE
    if clock.period is not None and _is_one_of(times, 1000.0, 60.0):
        other = clock.period * times
        return [Mistake(f"period of {other:.6g} s", f"period={other:.6g}", rank, "time")]
    note = clock.note
    unit = _other_unit(note.recorded, "s", times)
    if unit is None:
        return []
    head = heading(note.header)
    told = _rank(unit, note.recorded, head.unit, "s")
    call = f'time=("{head.name}", "{unit}")'
    words = f"time in {unit}, not {note.recorded}"
    return [Mistake(words, call, rank if told is None else told, "time")]


def _is_usual(step: float, duration: float) -> bool:
    return _inside(step, _STEP) and _inside(duration, _DURATION)


def _factors(each: Bound, times: float) -> list[Mistake]:
    """Another factor of a column: a diameter for a radius, what is left for what is taken."""
    wanted = each.request.factor * times
    known = next((f for f in _FACTORS if isclose(f, wanted, rel_tol=1e-6)), None)
    if known is None:
        return []
    words, call = _words(each, known, times), each.call(times=times)
    return [Mistake(words, call, _FACTORS[known], each.request.name)]


def _words(each: Bound, wanted: float, times: float) -> str:
    """What a factor of a declaration means."""
    name = each.request.name
    if wanted == 1.0:
        return f"{name} without its factor of {each.request.factor:g}"
    size = " of the diameter" if abs(wanted) == 0.5 else " twice as great" if abs(wanted) == 2.0 else ""
    return f"{name}{size}" + (" with the other sign" if times < 0 else "")
