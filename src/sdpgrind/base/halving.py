"""Bisection of many brackets at once, for roots of arrays."""

from collections.abc import Callable

import numpy as np

from sdpgrind.base.checks import Bools, Floats


def halved(low: Floats, high: Floats, before: Callable[[Floats], Bools], times: int) -> Floats:
    """Return the middle of each bracket (m,) after bisection; `before`: whether the root is above a point."""
    for _ in range(times):
        middle = 0.5 * (low + high)
        beyond = before(middle)
        low, high = np.where(beyond, middle, low), np.where(beyond, high, middle)
    return np.asarray(0.5 * (low + high))
