"""Where a condition turns, by halving, for a whole array of brackets at once."""

from collections.abc import Callable

import numpy as np

from sdpgrind.base.checks import Bools, Floats


def halved(low: Floats, high: Floats, before: Callable[[Floats], Bools], times: int) -> Floats:
    """Return the middle of each bracket after halving all of them.

    Parameters
    ----------
    low, high : array, (m,)
        Ends of the brackets, in any unit.
    before : callable
        Whether the turn lies beyond a place (m,).
    times : int
        How often to halve, a whole number.

    Returns
    -------
    array, (m,)
        In the unit of the brackets.
    """
    for _ in range(times):
        middle = 0.5 * (low + high)
        beyond = before(middle)
        low, high = np.where(beyond, middle, low), np.where(beyond, high, middle)
    return np.asarray(0.5 * (low + high))
