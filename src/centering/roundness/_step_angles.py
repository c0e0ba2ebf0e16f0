"""Search of the angles of a multistep separation on an index plate."""

import numpy as np
import numpy.typing as npt

from centering.roundness._setups import LOST
from sdpgrind.base import checks
from sdpgrind.base.checks import Complex, Floats

_LEAST = 3  # derived: steps that leave residuals, from which the noise is known
_STARTS = 100  # chosen: sets to begin with; with 7 of 36 one in 20 ends at the best of all
_WORK = 4_000_000  # chosen: sums computed in all, 0.4 s
_BETTER = 1e-9  # chosen: gain of a change above rounding

Whole = npt.NDArray[np.int64]


def step_angles(count: int, index: int = 36, upr_max: int = 50) -> Floats:
    """Return angles for `multistep` on an index plate that lose as few harmonics as possible.

    Among such sets, one whose smallest singular value is largest: it has the least noise in its worst
    harmonic. Found by exchange of one position at a time from many sets, the same at each call.

    Parameters
    ----------
    count : int
        Number of steps, at least 3.
    index : int
        Number of positions of the index plate, evenly spaced.
    upr_max : int
        Highest harmonic that counts, upr. Multiples of `index` are lost with any steps.

    Returns
    -------
    array, shape (count,)
        Angles from 0 on, rising, rad.

    Raises
    ------
    ValueError, TypeError
        For fewer than 3 steps, fewer positions than steps, or `upr_max` below 2.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import step_angles
    >>> np.rint(step_angles(7, index=36, upr_max=50) * 36 / (2 * np.pi)).astype(int).tolist()
    [0, 2, 8, 11, 26, 30, 31]
    """
    steps = checks.count("count", count, _LEAST)
    places = checks.count("index", index, steps)
    upr = np.arange(2, checks.count("upr_max", upr_max, 2) + 1)
    folded = np.minimum(upr % places, places - upr % places)  # harmonics n, n + index, index - n look alike
    kinds, often = np.unique(folded, return_counts=True)
    waves = np.exp(-2j * np.pi * np.outer(np.arange(places), kinds) / places)
    return np.asarray(2 * np.pi * _best(steps, waves, often) / places)


def _best(steps: int, waves: Complex, often: Whole) -> Whole:
    """Best set of positions, rising, among those that exchange finds."""
    rng, work = np.random.default_rng(0), _WORK
    best, least = np.arange(steps), np.inf
    for _ in range(_STARTS):
        places = np.append(0, 1 + rng.permutation(len(waves) - 1)[: steps - 1])
        score, work = _exchanged(places, waves, often, work)
        if score < least - _BETTER:
            best, least = np.sort(places), score
        if work <= 0:
            break
    return best


def _exchanged(places: Whole, waves: Complex, often: Whole, work: int) -> tuple[float, int]:
    """Move one position at a time, in turn, to where it is best; the score, and the work that is left."""
    total = waves[places].sum(axis=0)
    score, idle, k = float(_score(total, places.size, often)), 0, 0
    while idle < places.size - 1 and places.size < len(waves) and work > 0:
        k = k % (places.size - 1) + 1  # the first stays at 0
        free = np.setdiff1d(np.arange(len(waves)), places)
        without = total - waves[places[k]]
        tried = _score(without + waves[free], places.size, often)
        work -= free.size * often.size
        best = int(tried.argmin())
        idle += 1
        if tried[best] < score - _BETTER:
            places[k], score, idle = free[best], float(tried[best]), 0
            total = waves[places].sum(axis=0)
    return score, work


def _score(total: Complex, steps: int, often: Whole) -> Floats:
    """Number of lost harmonics first, then the largest sum of waves of the others, which is below `steps`."""
    size = np.abs(total)
    lost = steps - size < LOST**2
    return np.asarray((lost * often).sum(axis=-1) * (steps + 1) + np.where(lost, 0.0, size).max(axis=-1))
