"""Checks of the residuals of a fit: normality and independence."""

import dataclasses

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc, log_ndtr

from centering.circle._fit.fit_noise_kernels import factor
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored

LIMIT = 0.752  # source: Stephens; normal samples exceed this A2* with probability 0.05
LEAST = 8  # chosen: fewer residuals make the tests meaningless
SHARE = 0.05  # chosen: probability to reject independence wrongly


@stored("centering.circle.residual_checks")
@dataclasses.dataclass(frozen=True)
class ResidualChecks(Frozen):
    """Normality and independence of the residuals of a fit.

    Estimates and standard deviations rest on independence, not on normality: form of the part passes as
    normal noise though each residual resembles the last. Never judge by `anderson_darling` alone.

    Parameters
    ----------
    samples, lags : int
        Number of residuals and of correlations, unit 1.
    anderson_darling, anderson_darling_limit : float
        A2* = A2 (1 + 0.75/m + 2.25/m^2) with mean and sd of the residuals, unit 1, and the limit that a
        normal sample exceeds with probability 0.05.
    lag_1 : float
        Correlation of successive residuals, unit 1.
    ljung_box, probability : float
        Ljung and Box's Q of `lags` correlations, unit 1, and probability of a larger one if independent.

    Examples
    --------
    >>> checks = residual_checks(np.random.default_rng(0).normal(0.0, 0.01, 360))
    >>> checks.normal, checks.independent
    (True, True)
    """

    samples: int
    anderson_darling: float
    anderson_darling_limit: float
    lag_1: float
    ljung_box: float
    lags: int
    probability: float

    @property
    def normal(self) -> bool:
        """Whether normality is accepted, at a probability of 0.05 to reject it wrongly."""
        return self.anderson_darling <= self.anderson_darling_limit

    @property
    def independent(self) -> bool:
        """Whether independence is accepted, at a probability of 0.05 to reject it wrongly."""
        return self.probability >= SHARE

    @property
    def inflation(self) -> float:
        """Factor on standard deviations for AR(1) noise of correlation `lag_1`, unit 1, >= 1."""
        return float(factor(min(max(self.lag_1, 0.0), 1.0 - 1.0 / self.samples)))


def residual_checks(residual: npt.ArrayLike, *, lags: int | None = None) -> ResidualChecks:
    """Check residuals, in the order of the readings, for normality and independence.

    Parameters
    ----------
    residual : array_like, shape (m,)
        Reading minus model, mm (any unit: the checks are scale-free), at least 8, not all equal.
    lags : int, optional
        Number of correlations in Ljung and Box's Q, unit 1. Default: the lesser of 10 and m/5.

    Returns
    -------
    ResidualChecks
        Statistics and their limits.

    Raises
    ------
    ValueError, TypeError
        For too few residuals, residuals without scatter, values that are not finite, or as many lags as
        residuals.

    Examples
    --------
    >>> slow = residual_checks(np.sin(np.linspace(0.0, 12.0, 360)))
    >>> slow.independent, round(slow.lag_1, 2), round(slow.inflation, 1)
    (False, 1.0, 26.8)
    """
    left = checks.finite_array("residual", residual, "mm").ravel()
    if left.size < LEAST:
        raise checks.refuse("residual", f"at least {LEAST} residuals", left.size)
    away = left - left.mean()
    if np.abs(away).max() <= 1e-14 * np.abs(left).max():
        raise checks.refuse("residual", "not all the same", float(left[0]), "mm")
    count = min(10, left.size // 5) if lags is None else checks.count("lags", lags)
    if count >= left.size:
        raise checks.refuse("lags", f"< the number of residuals, {left.size}", count)
    correlation = _autocorrelation(away, count)
    statistic = float(
        left.size * (left.size + 2) * np.sum(correlation**2 / (left.size - np.arange(1, count + 1)))
    )
    return ResidualChecks(
        samples=left.size,
        anderson_darling=_anderson_darling(away),
        anderson_darling_limit=LIMIT,
        lag_1=float(correlation[0]),
        ljung_box=statistic,
        lags=count,
        probability=float(chdtrc(count, statistic)),
    )


def _autocorrelation(away: Floats, count: int) -> Floats:
    """Autocorrelation at lags 1 to `count`."""
    return np.array([away[lag:] @ away[:-lag] for lag in range(1, count + 1)]) / (away @ away)


def _anderson_darling(away: Floats) -> float:
    """A2* of centred values: squared distance of their distribution from the normal, tails weighted."""
    m = away.size
    z = np.sort(away) / away.std(ddof=1)
    weights = 2 * np.arange(m) + 1
    square = -m - float(weights @ (log_ndtr(z) + log_ndtr(-z[::-1]))) / m
    return square * (1 + 0.75 / m + 2.25 / m**2)
