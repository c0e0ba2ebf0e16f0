"""Rounding by a gauge that keeps its reading: an error that equal readings in a row share.

Taken for white noise it would all but vanish from their mean. The error of a run is even within half a step.
"""

from collections.abc import Callable, Sequence

import numpy as np

from sdpgrind.base import serial
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Estimate
from sdpgrind.plunge._identify.cycles import Cycle, runs

_FLICKER = 5  # chosen: readings between two runs of the same size that make one of them
_CHANGE = 1e-3  # chosen: change of a value for a slope, in standard deviations


def widened(found: Estimate, cycle: Cycle, residual: Callable[[Floats], Floats]) -> Estimate:
    """Estimate from residuals of the size (mm), with the rounding of its runs in the covariance."""
    if not found.ok or not rests(cycle) or not np.all(found.sd > 0):
        return found
    changes = np.diag(_CHANGE * found.sd)
    each = [residual(found.value + change) - residual(found.value - change) for change in changes]
    slopes = np.array(each) / (2 * np.diag(changes))[:, None]
    rho, apart = found.noise_correlation, _apart(cycle)
    white = serial.filtered(slopes, rho, apart)
    back = serial.filtered_back(white, rho, apart)
    weights = np.asarray(np.linalg.lstsq(white @ white.T, back, rcond=None)[0], dtype=float)
    return found.replace(covariance=found.covariance + by_weights(cycle, weights))


def rests(cycle: Cycle) -> bool:
    """Whether the gauge keeps a reading."""
    return bool(np.any(_runs(cycle)[1]))


def most(each: Sequence[Cycle]) -> float:
    """Greatest mean square (mm^2) of the rounding of kept readings, over what it is on average.

    derived: half a step squared, less a twelfth of a step squared, by the share of such readings.
    """
    square = sum(float(_runs(cycle)[1].sum()) * cycle.quantum**2 / 6 for cycle in each)
    return square / sum(int(cycle.read.sum()) for cycle in each)


def by_weights(cycle: Cycle, weights: Floats) -> Floats:
    """Covariance by rounding of values that an error of each size (mm) moves by weights (values, sizes)."""
    starts, held = _runs(cycle)
    moved = np.add.reduceat(weights * held, starts, axis=1)
    return np.asarray(cycle.quantum**2 / 12 * moved @ moved.T)


def of_means(cycle: Cycle, count: int, block: int, rho: float) -> Floats:
    """Variance by rounding (mm^2) of the means of blocks of readings, filtered by a correlation."""
    starts, held = _runs(cycle)
    blocks = block * np.arange(count)
    starts = np.union1d(starts[starts < count * block], blocks)
    share = serial.filtered(np.ones(held.size), rho, _apart(cycle)) * held / block
    sums = np.add.reduceat(share[: count * block], starts)
    return np.asarray(cycle.quantum**2 / 12 * np.add.reduceat(sums**2, np.searchsorted(starts, blocks)))


def _runs(cycle: Cycle) -> tuple[np.ndarray, Floats]:
    """Where runs of equal readings and what lies between them begin; 1 within runs, else 0."""
    size = cycle.size[cycle.read]
    held, edges = np.zeros(size.size), [0]
    for first, last in runs(size):
        if len(edges) > 1 and first - edges[-1] <= _FLICKER and size[first] == size[edges[-1] - 1]:
            held[edges.pop() : first] = 1.0
        else:
            edges.append(first)
        held[first : last + 1] = 1.0
        edges.append(last + 1)
    starts = np.unique(edges)
    return starts[starts < size.size], held


def _apart(cycle: Cycle) -> Floats:
    time = cycle.time[cycle.read]
    return serial.gaps(time, time.size)
