"""Ratio of a size to the way that was commanded, where the machine lags behind: no hold need be steady."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats

_ROWS = 200  # chosen: rows that are compared; more tell a forgotten factor no better
_LEAST_ROWS = 10  # chosen: fewer tell no lag
_MOVED = 0.1  # chosen: of the way; a size that moves later than that does not follow it
_BACK = 0.05  # chosen: of the way; less is noise of a rate that was measured
_LAGS = 40  # chosen: time constants from a step to the whole; a third apart where a pause of an hour is in it
_NEAR = np.geomspace(0.8, 1.25, 15)  # chosen: of the best of them, 3 % apart
_MISFIT = 0.05  # chosen: of the travel, up to which a lag of first order explains a size
_NOISE = 1.5  # chosen: of the noise, which alone leaves 1
_SDS = 3.0  # chosen: of the profile of the sum of squares


class LagRatio(NamedTuple):
    """Least and greatest ratio that the sizes allow."""

    low: float
    high: float


def ratio_behind_lag(
    time: Floats, way: Floats, size: Floats, noise_sd: float, contact: int
) -> LagRatio | None:
    """Return the ratio of a size to a `way`, for any lag of first order; None: no such lag explains it.

    From the row `contact` on, size = ratio * lagged way + constant + what is left of the rate at that row, by
    least squares for each lag; lags are allowed while the sum of squares is near the least. A hold that is
    shorter than the lag tells no slope, but its spark-out does.
    """
    rows = _rows(way, size, contact)
    if rows.size < _LEAST_ROWS or np.any(np.diff(time[rows]) <= 0):
        return None
    if np.ptp(way[rows]) < _MOVED * np.ptp(way[: rows[-1] + 1]):
        return None
    t, path, y = time[rows] - time[rows[0]], way[rows] - way[rows[0]], size[rows]
    lags = np.geomspace(np.median(np.diff(t)), t[-1], _LAGS)
    ratios, squares = _fits(t, path, y, lags)
    near = _fits(t, path, y, _NEAR * lags[np.argmin(squares)])
    ratios, squares = np.concatenate([(ratios, squares), near], axis=1)
    least = float(squares.min())
    if (least / rows.size) ** 0.5 > max(_MISFIT * float(np.ptp(y)), _NOISE * noise_sd):
        return None
    allowed = ratios[squares <= least * (1 + _SDS**2 / rows.size)]
    return LagRatio(float(allowed.min()), float(allowed.max()))


def _rows(way: Floats, size: Floats, contact: int) -> npt.NDArray[np.int64]:
    """Rows with a size from the contact to where the way turns back, thinned evenly: no part grows again."""
    forth = way[contact:] - way[contact]
    moved = forth[forth != 0]
    if not moved.size:
        return np.arange(0)
    forth = forth * np.sign(moved[0])
    top = np.maximum.accumulate(forth)
    back = np.flatnonzero(top - forth > _BACK * top)
    end = contact + (
        1 + int(np.flatnonzero(forth[: back[0]] == top[back[0]])[-1]) if back.size else forth.size
    )
    known = contact + np.flatnonzero(np.isfinite(size[contact:end]))
    return known[:: max(1, -(-known.size // _ROWS))]


def _lagged(time: Floats, way: Floats, lags: Floats) -> Floats:
    """Way behind lags (k, n), straight from row to row."""
    step, moved = np.diff(time)[:, None], np.diff(way)[:, None]
    behind, stays = moved / step * lags, np.exp(-step / lags)
    end, found = way[1:, None] - behind, np.zeros((time.size, lags.size))
    for row, (begin, lag, share, to) in enumerate(zip(way[:-1].tolist(), behind, stays, end, strict=True)):
        after = np.subtract(found[row], begin, out=found[row + 1])
        after += lag
        after *= share
        after += to
    return found.T


def _fits(time: Floats, way: Floats, size: Floats, lags: Floats) -> Floats:
    """Ratio and sum of squares of each lag, (2, k)."""
    columns = _lagged(time, way, lags), np.ones((lags.size, time.size)), np.exp(-time / lags[:, None])
    basis = np.stack(columns, axis=2)
    values = np.linalg.pinv(basis, rcond=np.finfo(float).eps * time.size) @ size
    left = size - np.einsum("kij,kj->ki", basis, values)
    return np.stack([values[:, 0], np.einsum("ki,ki->k", left, left)])
