"""Means with 95 % intervals, and when a mean differs from what was planned."""

import math
from dataclasses import dataclass

import numpy as np

from sdpgrind.base import means
from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Interval

_FEWEST = 2  # values that have a standard error; derived: of n - 1
_ALIKE = 1e-12  # relative; chosen: rounding of a constant outcome
_ROUNDING = 1e-9  # relative; chosen: above the rounding of a mean


def mean(values: Floats, least: float = -math.inf) -> Interval:
    """Return the mean of the known values with half of its interval (Student); NaN: of one value.

    `least`: smallest value that there can be.
    """
    known = values[np.isfinite(values)]
    if known.size < _FEWEST:
        return Interval(float(known[0]) if known.size else math.nan, math.nan)
    if np.ptp(known) <= _ALIKE * np.max(np.abs(known)):
        return Interval(float(known[0]), 0.0, sure="in every part")
    return Interval(float(known.mean()), means.half_interval(known), least)


def counted_share(flags: Floats) -> str:
    """Return how many of the known flags are set, and the 95 % interval of their share (binomial)."""
    from scipy.special import betaincinv

    known = flags[np.isfinite(flags)]
    count, n = int(np.sum(known > 0)), known.size
    if not n:
        return "not known"
    low = betaincinv(count, n - count + 1, 1 - means.PROBABILITY) if count else 0.0
    high = betaincinv(count + 1, n - count, means.PROBABILITY) if count < n else 1.0
    return f"{count} of {n} ({100 * low:.2g} to {100 * high:.3g} %)"


@dataclass(frozen=True)
class Promise:
    """What was planned: for all parts alike with an interval, or for each part."""

    planned: Interval | Floats

    @property
    def mean(self) -> Interval:
        """Planned mean."""
        if isinstance(self.planned, Interval):
            return self.planned
        return Interval(float(np.nanmean(self.planned)), 0.0, sure="expected")

    def difference(self, values: Floats) -> Interval:
        """Return mean realised less planned, part by part where each part has its own."""
        if isinstance(self.planned, Interval):
            found = mean(values)
            known = 0.0 if math.isnan(self.planned.half) else self.planned.half
            half = math.hypot(found.half, known)
            return Interval(found.value - self.planned.value, half, sure=found.sure)
        return mean(values - self.planned)

    def differs(self, values: Floats) -> bool:
        """Whether 0 is outside of the interval of the difference; False of one value."""
        if np.isfinite(values).sum() < _FEWEST:
            return False
        found = self.difference(values)
        return abs(found.value) > max(found.half, _ROUNDING * abs(self.mean.value))

    def told(self, values: Floats) -> bool:
        """Whether the interval of the difference is narrower than what was planned; True where that is 0.

        A wider one holds nothing as well as twice of it.
        """
        planned = abs(self.mean.value)
        return planned == 0 or self.differs(values) or self.difference(values).half <= planned
