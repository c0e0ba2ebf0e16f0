"""Two columns that say one thing: what no range tells, as a diameter for a radius or mm/min for mm/s."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import isclose, isfinite, log, nan, pi
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.rows import of_a_clock, wide
from sdpgrind.base.columns.sheet import Column
from sdpgrind.base.columns.slopes import integral, slope_of, slope_of_size
from sdpgrind.base.columns.table import COMMAND, quantity_of

# ratio of what two columns say of one quantity; chosen: measured on right cycles were 0.88 to 0.97, and a
# forgotten factor is 2 or more
LEAST, MOST = 0.7, 1.15
_MEANT = 0.93  # measured: what a right cycle gives; the rest is deflection
_PARTS = 30  # chosen: of which the median is taken; a unit is that of all parts
_SLACK = 2.0  # chosen: a cycle that ends early is no other unit
_ROWS = 10  # chosen: fewer rows tell no course
_FORCES = (0.05, 1.0)  # chosen: friction ratios of grinding
_CLEAR = 0.9  # chosen: correlation from which on a slope over noise in both is within a fifth
_TURNED = (0.7, 1.4)  # chosen: turns that are counted against those of the speed
_CONFUSED = (1.0, 2.0, 25.4, 1000.0, 60.0, 1000 / 60)  # derived: radius, inch, um or ms, minutes, both
FACTORS = [sign * f**power for f in _CONFUSED for power in (1, -1) for sign in (1, -1)]
"""Factors between what is usually confused; derived."""
_BACK = 0.7  # chosen: share of its travel by which a size falls back in one step where a part begins
_OF_TURNS = {
    2 * pi / 60: "1/min for rad/s",
    2 * pi: "Hz for rad/s",
    180 / pi: "degrees for rad",
    1000.0: "ms for s",
}

Columns = Mapping[str, Column]
Parts = Sequence[tuple[Floats, Columns]]
"""Times (s) and columns of each part."""


Ratio = Callable[[Floats, Floats, Floats], float]
"""From times (s), a way and its rate to their ratio; NaN: they do not tell."""


class Contradiction(NamedTuple):
    """Two columns that contradict each other; `times` would put the `first` right (NaN: unknown)."""

    first: str
    second: str
    told: str
    times: float = nan


def contradictions(parts: Iterable[tuple[Floats, Columns]]) -> list[Contradiction]:
    """Compare what columns of parts (time in s, columns by name) say twice; the median over parts counts."""
    each = list(parts)
    names = set(each[0][1]) if each else set()
    found = [
        *(_followed(each, names, *pair) for pair in PAIRS),
        _forces(each, names),
        _powers(each, names),
        _turns(each, names),
    ]
    return [one for one in found if one is not None]


def column(name: str, names: set[str]) -> str | None:
    """Name under which a quantity is there, measured before commanded."""
    return next((known for known in (name, name + COMMAND) if known in names), None)


def _median(values: Iterable[float]) -> float:
    known = [value for value in values if isfinite(value)]
    return float(np.median(known)) if known else nan


def _followed(each: Parts, names: set[str], way: str, rate: str, ratio: Ratio) -> Contradiction | None:
    """A way against the integral of its rate."""
    driver = column(rate, names)
    if way not in names or driver is None:
        return None
    some = each[:: -(-len(each) // _PARTS)]
    told = _median(ratio(time, columns[way], columns[driver]) for time, columns in some)
    if not isfinite(told) or LEAST <= told <= MOST:
        return None
    times = min((f for f in FACTORS if f * told > 0), key=lambda f: abs(log(f * told / _MEANT)))
    if not LEAST <= times * told <= MOST and LEAST / _SLACK < told < MOST * _SLACK:
        return None
    rule = f"{way} must follow {rate}, {LEAST} ... {MOST} of its integral; got {told:.3g}"
    if any(_falls_back(columns[way]) for _, columns in each):
        more = f', as {way} goes back to its beginning: two parts? Say part="header of the part\'s number"'
        return Contradiction(way, driver, rule + more)
    closed = [(_closed(time, columns[driver]), columns) for time, columns in some]
    if LEAST <= _median(ratio(time, columns[way], columns[driver]) for time, columns in closed) <= MOST:
        gap = max(float(np.diff(time).max(initial=0.0)) for time, _ in each)
        more = f', as time has a gap of {gap:.4g} s: two parts? Say part="header of the part\'s number"'
        return Contradiction(way, driver, rule + more + of_a_clock(gap))
    falls = f", {way} is falling while {rate} feeds" * (told < 0)
    return Contradiction(way, driver, rule + falls, times)


def _closed(time: Floats, rate: Floats) -> Floats:
    """Times without gaps through which a rate holds: each is one usual step."""
    steps = np.diff(time)
    gap = wide(steps) & (np.diff(integral(time, rate)) != 0)
    steps[gap] = np.median(steps)
    return time[:1] + np.concatenate([[0.0], np.cumsum(steps)]) if np.any(gap) else time


def _falls_back(way: Floats) -> bool:
    """Whether a way jumps to its beginning and moves on from there; a spike comes back at once."""
    known = way[np.isfinite(way)]
    if known.size < _ROWS:
        return False
    tail = max(2, known.size // 20)
    k = int(np.argmax(np.abs(np.diff(known)))) + 1
    before, after = known[max(0, k - tail) : k], known[k : k + tail]
    if min(before.size, after.size) < tail:
        return False
    start, end, again = (float(np.median(part)) for part in (known[:tail], before, after))
    return abs(again - start) < (1 - _BACK) * abs(end - start) and abs(known[k] - known[k - 1]) > _BACK * abs(
        end - start
    )


def share_removed(time: Floats, removed: Floats, rate: Floats) -> float:
    """What was removed over the integral of the infeed; NaN: nothing was."""
    rows = np.flatnonzero(np.isfinite(removed))
    if rows.size < 2:
        return nan
    way = integral(time, rate)
    travel = float(way[rows[-1]] - way[rows[0]])
    took = float(removed[rows[-1]] - removed[rows[0]])
    return took / travel if travel and took else nan


PAIRS = (("size", "command_rate", slope_of_size), ("removed", "infeed_rate", share_removed))
"""A way, its rate, and what tells their ratio."""


def _forces(each: Parts, names: set[str]) -> Contradiction | None:
    """Tangential against normal force, where the normal one is not small."""
    if not {"tangential_force", "normal_force"} <= names:
        return None
    told = _median(_force_ratio(columns["tangential_force"], columns["normal_force"]) for _, columns in each)
    low, high = _FORCES
    if not isfinite(told) or low <= told <= high:
        return None
    more = "; exchanged?" if told > high else ""
    return Contradiction(
        "tangential_force",
        "normal_force",
        f"tangential_force must be {low:g} ... {high:g} of normal_force; got {told:.3g}{more}",
    )


def _force_ratio(tangential: Floats, normal: Floats) -> float:
    both = np.isfinite(tangential) & np.isfinite(normal)
    sizes = np.abs(normal[both])
    if not np.any(sizes):
        return nan
    much = sizes > 0.5 * np.quantile(sizes, 0.95)
    return float(np.median(np.abs(tangential[both][much]) / sizes[much]))


def _powers(each: Parts, names: set[str]) -> Contradiction | None:
    """Power against tangential force: by the speed of cutting, without idle power."""
    if not {"grinding_power", "tangential_force"} <= names:
        return None
    told = _median(
        _cutting_speed(columns["tangential_force"], columns["grinding_power"]) for _, columns in each
    )
    meant = quantity_of("wheel_speed")
    if not isfinite(told) or meant.least <= told <= meant.greatest:
        return None
    return Contradiction(
        "grinding_power",
        "tangential_force",
        f"grinding_power must rise with tangential_force by a speed of {meant.least / 1000:g} ..."
        f" {meant.greatest / 1000:g} m/s; got {told / 1000:.3g} m/s: is one of them in another unit?",
    )


def _cutting_speed(force: Floats, power: Floats) -> float:
    """Slope of power over force, mm/s; NaN: it is not clear."""
    known = np.isfinite(force) & np.isfinite(power)
    force, power = np.abs(force[known]), power[known]
    if known.sum() < _ROWS or not np.ptp(force) or not np.ptp(power):
        return nan
    clear = float(np.corrcoef(force, power)[0, 1]) >= _CLEAR
    return 1000 * slope_of(force, power) if clear else nan  # W/N is m/s


def _turns(each: Parts, names: set[str]) -> Contradiction | None:
    """Turns counted from the angle against those of the spindle's speed."""
    speed = column("spindle_speed", names)
    if "angle" not in names or speed is None:
        return None
    told = _median(_turned(time, columns["angle"], columns[speed]) for time, columns in each)
    low, high = _TURNED
    if not isfinite(told) or low <= told <= high:
        return None
    words = next(
        (text for f, text in _OF_TURNS.items() if any(isclose(told, g, rel_tol=0.2) for g in (f, 1 / f))), ""
    )
    return Contradiction(
        "angle",
        speed,
        f"angle must turn as spindle_speed says, {low:g} ... {high:g} of it; got {told:.3g}"
        + f": {words}?" * bool(words),
    )


def _turned(time: Floats, angle: Floats, speed: Floats) -> float:
    """Angle turned over the integral of the speed; NaN: the turns cannot be counted."""
    known = np.isfinite(angle)
    steps = np.diff(angle[known])
    if steps.size < 2:
        return nan
    sign, spread = np.sign(np.median(steps)), np.ptp(angle[known])
    if np.any(steps * sign < 0):
        back = steps * sign < -0.5 * spread
        if spread > 2.2 * pi and not np.any(back):
            return nan
        again = (steps + pi) % (2 * pi) - pi
        steps = again if spread <= 2.2 * pi else np.where(back, steps + sign * spread, steps)
    rows = np.flatnonzero(known)
    way = integral(time, speed)
    travel = abs(float(way[rows[-1]] - way[rows[0]]))
    return abs(float(steps.sum())) / travel if travel else nan
