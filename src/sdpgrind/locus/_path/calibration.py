"""Read a stretch by the response: monotone limit, convergence of repeated readings."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from sdpgrind.base.checks import Floats
from sdpgrind.locus._path.single_valued import strictly
from sdpgrind.locus._trace.segments import bends


@dataclass(frozen=True)
class Calibration:
    """Properties of a stretch read by the response, a table in units of P_c: Koren, Fig. 2.

    Attributes
    ----------
    monotone : bool
        Whether P_b is strictly monotone along the stretch: a response fixes one point.
    rho : array, (K,)
        Error factor of one reading: slope of P_c at fixed hidden state over slope of P_b.
    hidden : array, (K,)
        Hidden states of `rho`.
    usable : tuple of (float, float)
        Ranges of the hidden state (in its unit) with ``|rho|`` < 1, where repeated readings converge.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> found = locus.plan(locus.preset("koren-example")).stretch("v").calibrated()
    >>> found.monotone, [round(x, 4) for x in found.usable[0]]
    (True, [0.5, 6.9274])
    """

    monotone: bool
    rho: Floats
    hidden: Floats
    usable: tuple[tuple[float, float], ...]


def calibration(
    s: Floats,
    hidden: Floats,
    limit: Floats,
    slopes: tuple[Floats, Floats],
    hidden_at: Callable[[Floats], Floats],
) -> Calibration:
    """Return the calibration for s, hidden states, P_b, slopes of P_c and P_b, and hidden state of s."""
    of_response, of_limit = slopes
    rho = np.divide(of_response, of_limit, out=np.full(of_limit.shape, np.inf), where=of_limit != 0)
    monotone = strictly(limit) and bool(np.all(np.sign(of_limit) == np.sign(of_limit[0])))
    return Calibration(monotone, rho, hidden, _converging(s, np.column_stack(slopes), hidden_at))


def _converging(
    s: Floats, slopes: Floats, hidden_at: Callable[[Floats], Floats]
) -> tuple[tuple[float, float], ...]:
    """Return the ranges of |P_c,s| < |P_b,s|, from splines of both slopes, by bisection."""
    both = CubicHermiteSpline(s, slopes, bends(s, slopes))

    def converges(at: Floats) -> Any:
        response, limit = both(at).T
        return np.abs(limit) - np.abs(response) > 0

    return hidden_ranges(converges, s, hidden_at, 60)


def hidden_ranges(
    holds: Callable[[Floats], Any], s: Floats, hidden_at: Callable[[Floats], Floats], rounds: int
) -> tuple[tuple[float, float], ...]:
    """Return ranges of the hidden state with a condition, by bisections between coordinates s (K,)."""
    inside = holds(s)
    turns = np.flatnonzero(np.diff(inside))
    low, high, first = s[turns], s[turns + 1], inside[turns]
    for _ in range(rounds if turns.size else 0):
        middle = 0.5 * (low + high)
        same = holds(middle) == first
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    cuts = [s[0], *(0.5 * (low + high)), s[-1]]
    kept = [pair for k, pair in enumerate(pairwise(cuts)) if inside[0] == (k % 2 == 0)]
    ends = [sorted(hidden_at(np.array(pair)).tolist()) for pair in kept]
    return tuple((a, b) for a, b in sorted(ends))
