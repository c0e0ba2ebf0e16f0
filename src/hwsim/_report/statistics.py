"""Means with 95 % intervals, and when a mean differs from what was planned."""

import math
from dataclasses import dataclass

import numpy as np

from sdpgrind.base import means
from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Interval

_NORMAL = 1.959963984540054  # derived: quantile of means.PROBABILITY, for many values
_SE = 2.0  # standard errors beyond which a difference is explained; source: the page's specification
_FEWEST = 2  # values that have a standard error; derived: of n - 1
_ROUNDING = 1e-9  # relative; chosen: above the rounding of a mean


def mean(values: Floats, least: float = -math.inf) -> Interval:
    """Return the mean of the known values with half of its interval (Student); NaN: of one value.

    `least`: smallest value that there can be.
    """
    known = values[np.isfinite(values)]
    if known.size < _FEWEST:
        return Interval(float(known[0]) if known.size else math.nan, math.nan)
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
        return Interval(float(np.nanmean(self.planned)), 0.0)

    def difference(self, values: Floats) -> Interval:
        """Return mean realised less planned, part by part where each part has its own."""
        if isinstance(self.planned, Interval):
            found = mean(values)
            known = 0.0 if math.isnan(self.planned.half) else self.planned.half
            return Interval(found.value - self.planned.value, math.hypot(found.half, known))
        return mean(values - self.planned)

    def differs(self, values: Floats) -> bool:
        """Whether the mean is more than two standard errors from what was planned; False of one value."""
        if np.isfinite(values).sum() < _FEWEST:
            return False
        if isinstance(self.planned, Interval):
            known = 0.0 if math.isnan(self.planned.half) else self.planned.half / _NORMAL
            error = math.hypot(_standard_error(values), known)
        else:
            error = _standard_error(values - self.planned)
        gap = abs(self.difference(values).value)
        return gap > max(_SE * error, _ROUNDING * abs(self.mean.value))


def _standard_error(values: Floats) -> float:
    return means.standard_error(values[np.isfinite(values)])
