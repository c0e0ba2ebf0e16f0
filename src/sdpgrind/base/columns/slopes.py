"""Ratio of a size to the integral of its command: behind a lag, of a steady hold, or of the whole."""

from math import isfinite, nan
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.lagged import ratio_behind_lag

_AGREE = 0.15  # chosen: two fifths of a hold that agree are steady
_MOVES = 0.05  # chosen: share of the range of the size that is more than noise in the air
_NOISE = 5.0  # chosen: standard deviations; the inner 96 % of white noise alone are 4.1 of them wide
_ROWS = 10  # chosen: rows of a hold of which a fifth still has a slope
_HOLDS = 5  # chosen: holds that are looked at; more are rapid moves


def _held(rate: Floats) -> Floats:
    """Rates, each held until the next; 0 before the first."""
    known = np.isfinite(rate)
    last = np.maximum.accumulate(np.where(known, np.arange(rate.size), -1))
    return np.where(last >= 0, np.where(known, rate, 0.0)[last], 0.0)


def integral(time: Floats, rate: Floats) -> Floats:
    """Integral of a rate that holds until the next, from 0."""
    return np.concatenate([[0.0], np.cumsum(_held(rate)[:-1] * np.diff(time))])


class Hold(NamedTuple):
    """A command that is held while the size moves: first and last row, slope of the size in its last fifth.

    The slope is NaN where it is not that of the fifth before: the size is not steady.
    """

    begin: int
    end: int
    slope: float

    @property
    def last_fifth(self) -> slice:
        """Rows of the last fifth."""
        return slice(self.end + 1 - (self.end + 1 - self.begin) // 5, self.end + 1)


def slope_of_size(time: Floats, size: Floats, rate: Floats) -> float:
    """Slope of the size against the command: behind a lag that explains it the one nearest to 1.

    Else steady in the longest way that moves it, else of the whole. NaN: the columns do not tell, as of an
    air cut or of zeros.
    """
    spread, way = _moved(size), integral(time, rate)
    if spread == 0.0 or not np.any(_held(rate)):
        return nan
    noise_sd = _noise_sd(size[np.isfinite(size)])
    lag = ratio_behind_lag(time, way, size, noise_sd, _contact(size, spread))
    if lag is not None:
        return float(np.clip(1.0, lag.low, lag.high))
    hold = roughing_hold(time, size, rate)
    if hold is not None and isfinite(hold.slope):
        return hold.slope
    return _of_whole(way, size, spread)


def roughing_hold(time: Floats, size: Floats, rate: Floats) -> Hold | None:
    """Return the longest way of one command that moves the size; None: there is none."""
    spread, way, held = _moved(size), integral(time, rate), _held(rate)
    if spread == 0.0:
        return None
    edges = np.concatenate([[0], np.flatnonzero(np.diff(held)) + 1, [time.size - 1]])
    runs = sorted(
        zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True), key=lambda r: -abs(way[r[1]] - way[r[0]])
    )
    for begin, end in runs[:_HOLDS]:
        if way[end] == way[begin]:
            break
        steady = _steady(way[begin : end + 1], size[begin : end + 1], spread)
        if steady is not None:
            return Hold(begin, end, steady)
    return None


def _moved(size: Floats) -> float:
    """How far a size moves without outliers; 0: no farther than its noise, or too few readings."""
    known = size[np.isfinite(size)]
    if known.size < _ROWS:
        return 0.0
    spread = float(np.subtract(*np.quantile(known, [0.98, 0.02])))
    return spread if spread > _NOISE * _noise_sd(known) else 0.0


def _noise_sd(values: Floats) -> float:
    """Standard deviation of white noise, from the steps between rows (median of the normal law)."""
    return float(np.median(np.abs(np.diff(values)))) / (0.6745 * 2**0.5)


def _steady(way: Floats, size: Floats, spread: float) -> float | None:
    """Slope in the last fifth of a hold; NaN: not steady, None: the size does not move."""
    known = np.isfinite(size)
    way, size = way[known], size[known]
    if size.size < _ROWS:
        return None
    fifth = size.size // 5
    if abs(float(np.median(size[-fifth:]) - np.median(size[:fifth]))) < _MOVES * spread:
        return None
    last, before = (
        slope_of(way[-fifth:], size[-fifth:]),
        slope_of(way[-2 * fifth : -fifth], size[-2 * fifth : -fifth]),
    )
    return last if abs(last - before) <= _AGREE * abs(last) else nan


def slope_of(x: Floats, y: Floats) -> float:
    """Return the slope of y over x by least squares; NaN: x is constant."""
    x = x - x.mean()
    return float(x @ (y - y.mean()) / (x @ x)) if np.any(x) else nan


def _of_whole(way: Floats, size: Floats, spread: float) -> float:
    """Size last less first over the command, from where the size begins to move."""
    rows = np.flatnonzero(np.isfinite(size))
    start, stop = _ends(size[rows])
    travel = float(way[rows[-1]] - way[_contact(size, spread)])
    return (stop - start) / travel if travel else nan


def _contact(size: Floats, spread: float) -> int:
    """Row from which the size moves."""
    rows = np.flatnonzero(np.isfinite(size))
    still = np.flatnonzero(np.abs(size[rows] - _ends(size[rows])[0]) < _MOVES * spread)
    return int(rows[_run_end(still)] if still.size else rows[0])


def _ends(known: Floats) -> tuple[float, float]:
    """Medians of the first and the last twentieth."""
    tail = max(1, known.size // 20)
    return float(np.median(known[:tail])), float(np.median(known[-tail:]))


def _run_end(places: np.ndarray) -> int:
    """Last of the places that follow each other from the first on."""
    breaks = np.flatnonzero(np.diff(places) > 1)
    return int(places[breaks[0]] if breaks.size else places[-1])
