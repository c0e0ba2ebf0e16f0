"""Limits kept between the points of a grid too: narrowed about the spots where a law exceeds them, and solved again.

Only the neighbourhood of such a spot slows down; the little that is left after a few rounds is gained by playing the whole law
slower.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._limits import JointLimits
from sdpgrind.finishing.timing._time_law import TimeLaw
from sdpgrind.finishing.timing._violations import closest, shares, slowing

CHECKS = 20
"""Places in an interval in which limits are checked."""
ROUNDS = 5
"""How often limits are narrowed at most."""
ENOUGH = 2e-4
"""Share of the duration that is left to playing the whole law slower."""
EAGER = 2.0
"""Power of what a limit is exceeded by to narrow it: the worst place between two points answers to about half of that."""

Solve = Callable[[Floats], TimeLaw]
"""Law on a grid of m points whose limits of speed and of acceleration are narrowed by factors >= 1, (2, m)."""


class Narrowed(NamedTuple):
    """A law that keeps its limits, and the factors (2, m) that the limits of speed and acceleration were narrowed by."""

    law: TimeLaw
    factors: Floats


def narrowed(run: JointPath, limits: JointLimits, feed_rate: float, points: int, solve: Solve) -> Narrowed:
    """Fastest of the laws found while limits are narrowed at the points of a grid about the spots where they are exceeded."""
    factors = np.ones((2, points))
    law = solve(factors)
    best = Narrowed(slowed_to_limits(run, law, limits, feed_rate), factors)
    for _ in range(ROUNDS):
        if best.law.duration <= (1 + ENOUGH) * law.duration:
            break
        factors = _narrower(factors, run, law, limits)
        law = solve(factors)
        tried = Narrowed(slowed_to_limits(run, law, limits, feed_rate), factors)
        best = min(best, tried, key=lambda each: each.law.duration)
    return best


def _narrower(factors: Floats, run: JointPath, law: TimeLaw, limits: JointLimits) -> Floats:
    """Narrow limits at both ends of every interval by what they are exceeded by in it."""
    ratios = shares(run, law, limits.replace(jerk_max=None), np.inf, CHECKS)[:, :2, 0].T
    excess, one = np.maximum(ratios, 1.0) ** EAGER, np.ones((2, 1))
    return np.asarray(factors * np.maximum(np.hstack([one, excess]), np.hstack([excess, one])))


def slowed_to_limits(run: JointPath, law: TimeLaw, limits: JointLimits, feed_rate: float) -> TimeLaw:
    """Play a law just so much slower that limits are kept between its points too; jerk is not looked at."""
    return law.slower(slowing(closest(run, law, limits.replace(jerk_max=None), feed_rate, CHECKS)[:, 0]))
