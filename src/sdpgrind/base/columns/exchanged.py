"""Whether columns were declared for one another: by their course, whatever their units."""

from collections.abc import Sequence
from math import nan

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.pairs import LEAST, MOST, PAIRS, Contradiction, Parts, Ratio, column
from sdpgrind.base.columns.slopes import integral
from sdpgrind.base.columns.table import TEXT, quantity_of

_ALIKE, _UNLIKE = 0.9, 0.8  # chosen: correlations; an exchanged cycle with spark-out gave 0.946 and -0.80
_LEVELS = 4  # chosen: a gauge has so many times the levels of its command
_UNITS = (1.0, 1000.0, 0.001, 25.4, 1 / 25.4, 2.0, 0.5)  # derived: mm, um, inches, the diameter
_PER = (1.0, 1 / 60, 1000.0, 1000 / 60)  # derived: mm or um over mm/s or mm/min


def exchanged(each: Parts, factors: dict[str, float]) -> tuple[str, str] | None:
    """Return the way and the rate that are exchanged; `factors` turned what was recorded into our units."""
    names = set(each[0][1]) if each else set()
    for way, rate, _ in PAIRS:
        driver = column(rate, names)
        if way in names and driver is not None:
            by = factors[way] / factors[driver]
            told = [_is_exchanged(time, columns[way], columns[driver], by) for time, columns in each]
            if sum(told) > len(told) / 2:
                return way, driver
    return None


def _is_exchanged(time: Floats, way: Floats, rate: Floats, by: float) -> bool:
    """Whether the rate follows the integral of the way, has more levels, and the way does not follow it.

    A way that stands still is a gauge in the air unless the recorded numbers have the ratio of a
    way to its rate.
    """
    known = np.isfinite(way) & np.isfinite(rate)
    if np.sum(known) < _LEVELS * 2:
        return False
    time, way, rate = time[known], way[known], rate[known]
    if np.unique(rate).size < _LEVELS * np.unique(way).size:
        return False
    fed = integral(time, way)
    alike = _alike(rate, fed)
    if not abs(alike) >= _ALIKE:
        return False
    if np.ptp(way) > 0:
        return not np.sign(alike) * _alike(way, integral(time, rate)) >= _UNLIKE
    told = float(rate[-1] - rate[0]) / float(fed[-1]) * by
    return any(LEAST <= abs(told) / per <= MOST for per in _PER)


def _alike(x: Floats, y: Floats) -> float:
    """Correlation; NaN: one of them stands still."""
    spread = float(np.std(x) * np.std(y))
    return float(np.mean((x - x.mean()) * (y - y.mean()))) / spread if spread else nan


def follower(
    each: Parts, factors: dict[str, float], faults: Sequence[Contradiction]
) -> tuple[str, str] | None:
    """Return a way that does not follow its rate, and the other column which does in the way's unit.

    Other lengths may follow the rate as well, a slide for one: they are none that was exchanged.
    """
    for way, rate, ratio in PAIRS:
        fault = next((one for one in faults if one.first == way), None)
        if fault is None:
            continue
        for name in each[0][1]:
            if name == column(rate, set(each[0][1])) or quantity_of(name).unit in ("mm", TEXT):
                continue
            by = factors[way] / factors[name]
            told = [
                _follows(time, columns[way], by * columns[name], columns[fault.second], ratio)
                for time, columns in each
            ]
            if sum(told) > len(told) / 2:
                return way, name
    return None


def _follows(time: Floats, way: Floats, other: Floats, rate: Floats, ratio: Ratio) -> bool:
    """Whether another column than the way grows as the integral of the rate does, and as much."""
    fed = integral(time, rate)
    if not _alike_known(other, fed) >= _ALIKE or abs(_alike_known(way, fed)) >= _UNLIKE:
        return False
    return LEAST <= ratio(time, other, rate) <= MOST


def is_position(fault: Contradiction, each: Parts, factors: dict[str, float]) -> bool:
    """Whether a way grows with its rate, and as far in some unit: a position was given for it."""
    by = factors[fault.second] / factors[fault.first]
    told = [_goes_along(columns[fault.first], columns[fault.second], by) for _, columns in each]
    return fault.times == fault.times and sum(told) > len(told) / 2


def _goes_along(way: Floats, rate: Floats, by: float) -> bool:
    """Whether two columns grow alike and, in mm, um or inches, of radius or diameter, as far."""
    known = np.isfinite(way) & np.isfinite(rate)
    if not _alike_known(way, rate) >= _ALIKE or np.unique(rate[known]).size < _LEVELS:
        return False
    share = float(np.ptp(way[known]) / np.ptp(rate[known])) * by
    return any(LEAST <= share * unit <= MOST for unit in _UNITS)


def _alike_known(one: Floats, other: Floats) -> float:
    """Correlation where both are known; NaN: one of them stands still."""
    known = np.isfinite(one) & np.isfinite(other)
    return _alike(one[known], other[known]) if np.any(known) else nan
