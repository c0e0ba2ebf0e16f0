"""Limits kept between the points of a grid: narrowed where a law exceeds them, then solved again.

Only the neighbourhood of such a place slows down; the remaining excess is removed by slowing the whole law.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.timing._limits import LawError, LimitedRun
from sdpgrind.finishing.timing._time_law import TimeLaw
from sdpgrind.finishing.timing._violations import closest, shares, slowing

CHECKS = 20  # chosen: places in an interval for limits
ROUNDS = 5  # chosen: limit of the rounds of narrowing
ENOUGH = 2e-4  # of the duration, chosen: rest for slowing the whole law
# chosen: power of the excess for narrowing, as the worst place between points follows about half of it
EAGER = 2.0

# law on a grid of m points with limits of speed and acceleration narrowed by factors >= 1, (2, m)
Solve = Callable[[Floats], TimeLaw]


class Narrowed(NamedTuple):
    """A law within its limits, and the factors (2, m) that narrowed the limits of speed and acceleration."""

    law: TimeLaw
    factors: Floats


def narrowed(given: LimitedRun, points: int, solve: Solve) -> Narrowed:
    """Return the fastest law over rounds of narrowing limits where they are exceeded between points."""
    factors = np.ones((2, points))
    law = solve(factors)
    best = Narrowed(slowed_to_limits(given, law), factors)
    for _ in range(ROUNDS):
        if best.law.duration <= (1 + ENOUGH) * law.duration:
            break
        factors = _narrower(factors, given, law)
        try:
            law = solve(factors)
        except LawError:
            break
        tried = Narrowed(slowed_to_limits(given, law), factors)
        best = min(best, tried, key=lambda each: each.law.duration)
    return best


def _narrower(factors: Floats, given: LimitedRun, law: TimeLaw) -> Floats:
    """Narrow limits at both ends of every interval by their excess in it."""
    ratios = shares(given.run, law, given.limits.replace(jerk_max=None), np.inf, CHECKS)[:, :2].T
    excess, one = np.maximum(ratios, 1.0) ** EAGER, np.ones((2, 1))
    return np.asarray(factors * np.maximum(np.hstack([one, excess]), np.hstack([excess, one])))


def slowed_to_limits(given: LimitedRun, law: TimeLaw) -> TimeLaw:
    """Slow a law to its limits of speed, acceleration and feed, also between its points."""
    without_jerk = given.limits.replace(jerk_max=None)
    return law.slower(slowing(closest(given.run, law, without_jerk, given.feed_rate, CHECKS)[:, 0]))
