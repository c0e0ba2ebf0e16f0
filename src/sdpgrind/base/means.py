"""Means of values and of estimates, with their standard errors and 95 % intervals."""

import math

from sdpgrind.base.checks import Floats

PROBABILITY = 0.975  # chosen: both sides leave 5 %
_ROUNDING = 1e-12  # relative; chosen: above the rounding of an exact estimate, whose variance is 0
_TINY = 1e-300  # chosen: keeps the weight of an exact zero finite


def standard_error(values: Floats) -> float:
    """Return the standard error of the mean of known values; NaN of fewer than two."""
    return float(values.std(ddof=1)) / math.sqrt(values.size) if values.size > 1 else math.nan


def half_interval(values: Floats) -> float:
    """Return half of the 95 % interval of the mean of known values (Student); NaN of fewer than two."""
    from scipy.special import stdtrit

    if values.size < 2:
        return math.nan
    return float(stdtrit(values.size - 1, PROBABILITY)) * standard_error(values)


def pooled(values: Floats, variances: Floats, freedom: float) -> tuple[float, float, float]:
    """Return the mean of estimates of one value by inverse variance, its variance and degrees of freedom.

    Where the estimates scatter by more than their variances (with `freedom` in all), their scatter counts.
    """
    variances = variances + (_ROUNDING * values) ** 2 + _TINY
    weight = 1 / variances
    mean = float(weight @ values / weight.sum())
    if values.size < 2:
        return mean, float(variances[0]), freedom
    scatter = float(weight @ (values - mean) ** 2) / (values.size - 1)
    if scatter <= 1:
        return mean, float(1 / weight.sum()), freedom
    return mean, scatter / float(weight.sum()), float(values.size - 1)
