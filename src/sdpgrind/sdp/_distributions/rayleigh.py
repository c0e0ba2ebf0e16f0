"""Rayleigh law, translated or scaled."""

from functools import lru_cache
from math import factorial, pi, sqrt

import numpy as np
import numpy.typing as npt
from scipy.special import erf, erfc, erfcx, roots_legendre

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed, generator
from sdpgrind.sdp._distributions.law import LocationScale, Size, amounts, gauss_rule
from sdpgrind.sdp._distributions.normal import HALF_PI, ROOT2

RAYLEIGH_SD = sqrt(2 - pi / 2)  # derived: its standard deviation
RAYLEIGH_REACH = 8.85  # derived: P(Rho > 8.85) < 1e-17
_EMPTY = 38.61  # derived: exp(-u^2/2) is 0 in double precision from here on


def _rayleigh_series(power: int) -> Floats:
    """Coefficients, in powers of u^2, of E((u - Rho)+)^power / u^power: no cancellation for u < 1."""
    k = np.arange(1, 16)
    signs = np.where(k % 2, 1.0, -1.0) / (2.0**k * [factorial(int(n)) for n in k])
    further = 1.0 / (2 * k + 1) if power == 1 else 2.0 / ((2 * k + 1) * (2 * k + 2))
    return np.concatenate([[0.0], signs * further])


_SERIES = {power: _rayleigh_series(power) for power in (1, 2)}


class Rayleigh(LocationScale):
    """Rayleigh law with a given mean and standard deviation, translated or scaled: Brown (1988), section 4.2.

    With q = sd/sqrt(2 - pi/2) and Rho of the unit Rayleigh law: for mean/sd >= `SWITCH`, D = (mean - q
    sqrt(pi/2)) + q Rho. Below, that law would reach negative values; D = mean/sqrt(pi/2) Rho with standard
    deviation mean/`SWITCH` replaces it.

    Parameters
    ----------
    mean, sd : array_like
        Mean >= 0 and requested standard deviation >= 0, in the unit of D; 0 gives a point mass.

    Attributes
    ----------
    SWITCH : float
        Least mean/sd of a translated law, sqrt(pi/2)/sqrt(2 - pi/2), unit 1.

    Raises
    ------
    ValueError
        When a mean or an sd is negative or not finite.

    Examples
    --------
    >>> law = Rayleigh([0.1, 1.0], 0.1)
    >>> law.sd.round(6)
    array([0.052272, 0.1     ])
    >>> law.under(1.0).round(6)
    array([0.9     , 0.040192])
    """

    SWITCH = HALF_PI / RAYLEIGH_SD

    def __init__(self, mean: npt.ArrayLike, sd: npt.ArrayLike) -> None:
        mean, sd = np.broadcast_arrays(amounts("mean", mean, 0.0), amounts("sd", sd, 0.0))
        scale = np.minimum(sd / RAYLEIGH_SD, mean / HALF_PI)
        self._set(np.maximum(mean - scale * HALF_PI, 0.0), scale)
        self.mean, self.sd = mean.copy(), scale * RAYLEIGH_SD

    @property
    def support(self) -> tuple[Floats, Floats]:
        """Ends (two arrays of `shape`, unit of D) beyond each of which the probability is below 1e-17."""
        return self._location, self._location + RAYLEIGH_REACH * self._scale

    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        """Draw from `rng`; `size` (by default `shape`) must broadcast with `shape`. Unit of D."""
        return self._location + self._scale * generator(rng).rayleigh(
            size=self.shape if size is None else size
        )

    def nodes(self, n: int) -> tuple[Floats, Floats]:
        """Return the Gauss rule with `n` points on the last axis; see `Law.nodes`. Unit of D."""
        unit, weights = _rayleigh_rule(checks.count("n", n))
        return self._placed(unit), np.broadcast_to(weights, (*self.shape, n))

    def _fine(self) -> tuple[Floats, Floats]:
        unit, weights = _rayleigh_points()
        return self._placed(unit), np.broadcast_to(weights, (*self.shape, weights.size))

    def _unit_under(self, v: Floats, power: int) -> Floats:
        u = np.maximum(v, 0.0)
        if power == 0:
            return _below(u)
        mean_part = HALF_PI * erf(u / ROOT2)
        far = np.asarray(u - mean_part if power == 1 else u * u - 2 * u * mean_part + 2 * _below(u))
        near = (u > 0) & (u < 1)
        small = u[near]
        far[near] = small**power * _polynomial(_SERIES[power], small**2)
        return far

    def _unit_over(self, v: Floats, power: int) -> Floats:
        u = np.maximum(v, 0.0)
        if power == 1:
            upper: Floats = HALF_PI * erfc(u / ROOT2) + np.maximum(-v, 0.0)
            return upper
        within = np.asarray((u > 0) & (u < _EMPTY))  # elsewhere the tail is 1 or 0: on most of a grid
        tail = np.where(u > 0, 0.0, 1.0)
        np.exp(-0.5 * u * u, out=tail, where=within)
        if power == 0:
            return tail
        some, beyond = u[within], np.asarray(2 * tail)
        beyond[within] *= np.maximum(1 - some * HALF_PI * erfcx(some / ROOT2), 0.0)
        short = np.maximum(-v, 0.0)
        return np.asarray(beyond + short * (2 * HALF_PI + short))


def _below(u: Floats) -> Floats:
    """P(Rho <= u) of the unit law."""
    return -np.expm1(-0.5 * u * u)


def _polynomial(coefficients: Floats, x: Floats) -> Floats:
    """Horner's sum in place: to the bit numpy's `polyval`, which makes two new arrays a coefficient."""
    total = np.full_like(x, coefficients[-1])
    for each in coefficients[-2::-1]:
        total *= x
        total += each
    return total


@lru_cache(maxsize=1)
def _rayleigh_points() -> tuple[Floats, Floats]:
    x, w = roots_legendre(256)
    points = 0.5 * RAYLEIGH_REACH * (x + 1)
    weights = w * points * np.exp(-0.5 * points**2)
    return points, weights / weights.sum()


@lru_cache(maxsize=64)
def _rayleigh_rule(n: int) -> tuple[Floats, Floats]:
    return gauss_rule(*_rayleigh_points(), n)
