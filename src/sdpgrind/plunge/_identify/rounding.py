"""Rounding by a gauge: of readings that change an independent error; readings at rest share one.

The error of a rest is even within half a step; taken for white noise it would all but vanish from their mean.
An independent error hides how alike the noise of a filter is, which averages out the less.
"""

from collections.abc import Callable, Sequence

import numpy as np

from sdpgrind.base import serial
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Estimate
from sdpgrind.plunge._identify.cycles import Cycle, runs, step_of
from sdpgrind.plunge._plan.replay_kernels import lags

_LEAST, _MOST = 1e-3, 0.5  # chosen: share of rounding in a variance; less hides nothing, of more runs share
_CHANGE = 1e-3  # chosen: change of a value for a slope, in standard deviations


def widened(found: Estimate, cycle: Cycle, residual: Callable[[Floats], Floats]) -> Estimate:
    """Estimate from residuals of the size (mm), with the rounding of the gauge in the covariance."""
    rho, apart, size = found.noise_correlation, _apart(cycle), cycle.size[cycle.read]
    own = unrounded(rho, size, found.noise_sd, found.value.size)
    if not found.ok or not (own > rho or rests(cycle)) or not np.all(found.sd > 0):
        return found
    changes = np.diag(_CHANGE * found.sd)
    each = [residual(found.value + change) - residual(found.value - change) for change in changes]
    slopes = np.array(each) / (2 * np.diag(changes))[:, None]
    white = serial.filtered(slopes, rho, apart)
    back = serial.filtered_back(white, rho, apart)
    weights = np.asarray(np.linalg.lstsq(white @ white.T, back, rcond=None)[0], dtype=float)
    freedom = serial.effective(size.size, found.value.size, own)
    return found.replace(
        covariance=covariance(size, weights, apart, own, rho, found.noise_sd), freedom=freedom
    )


def covariance(
    size: Floats, weights: Floats, apart: Floats, own: float, rho: float, noise_sd: float
) -> Floats:
    """Covariance of values that an error of each size (mm) moves by weights (values, sizes).

    The noise (sd in mm) has the correlation `own` before its rounding and `rho` after it.
    """
    poles = own ** apart[1:]
    before = np.array([lags(0.0, poles, poles * weight[:-1]) for weight in weights])
    alike = (rho / own if own > 0 else 0.0) * weights @ before.T
    return np.asarray(noise_sd**2 * (weights @ weights.T + alike + alike.T) + _by_rests(size, weights))


def unrounded(correlation: float, size: Floats, noise_sd: float, fitted: int) -> float:
    """Correlation of the noise of sizes (sd in mm) before rounding, which adds a twelfth of a step squared.

    derived: `fitted` slow values take their share of the sum of all correlations off those of neighbours, of
    which noise that is first-order with its rounding would have given back too little.
    """
    share = min(step_of(size) ** 2 / 12 / noise_sd**2, _MOST) if noise_sd > 0 else 0.0
    if share <= _LEAST:
        return correlation
    own = min(correlation / (1 - share), serial.MOST)
    every = (1 - share) * (1 + own) / (1 - own) + share
    lost = fitted / size.size * ((1 - correlation) * every - (1 + correlation))
    return min((correlation + lost) / (1 - share), serial.MOST)


def rests(cycle: Cycle) -> bool:
    """Whether the gauge keeps a reading."""
    return bool(np.any(_runs(cycle.size[cycle.read])[1]))


def most(each: Sequence[Cycle]) -> float:
    """Greatest mean square (mm^2) of the rounding of kept readings, over what it is on average.

    derived: half a step squared, less a twelfth of a step squared, by the share of such readings.
    """
    square = sum(float(_runs(cycle.size[cycle.read])[1].sum()) * cycle.quantum**2 / 6 for cycle in each)
    return square / sum(int(cycle.read.sum()) for cycle in each)


def _by_rests(size: Floats, weights: Floats) -> Floats:
    """Covariance of such values by the rounding that the readings of each rest share."""
    starts, held = _runs(size)
    moved = np.add.reduceat(weights * held, starts, axis=1)
    return np.asarray(step_of(size) ** 2 / 12 * moved @ moved.T)


def of_means(cycle: Cycle, count: int, block: int, rho: float) -> Floats:
    """Variance by rounding (mm^2) of the means of blocks of readings, filtered by a correlation."""
    starts, held = _runs(cycle.size[cycle.read])
    blocks = block * np.arange(count)
    starts = np.union1d(starts[starts < count * block], blocks)
    share = serial.filtered(np.ones(held.size), rho, _apart(cycle)) * held / block
    sums = np.add.reduceat(share[: count * block], starts)
    return np.asarray(cycle.quantum**2 / 12 * np.add.reduceat(sums**2, np.searchsorted(starts, blocks)))


def _runs(size: Floats) -> tuple[np.ndarray, Floats]:
    """Where readings that keep within a step, and what lies between them, begin; 1 within them, else 0.

    A gauge at rest shows one size or, at the edge of a step, two in turn: their mean is off by as much.
    """
    held, edges = np.zeros(size.size), {0}
    for first, _ in runs(size):
        if held[first]:
            continue
        after = size[first:]
        wide = np.maximum.accumulate(after) - np.minimum.accumulate(after) > 1.5 * step_of(size)
        last = first + int(np.argmax(wide)) if wide[-1] else size.size
        held[first:last] = 1.0
        edges |= {first, last}
    return np.array(sorted(edges - {size.size})), held


def _apart(cycle: Cycle) -> Floats:
    time = cycle.time[cycle.read]
    return serial.gaps(time, time.size)
