"""Normal and log-normal laws, accurate in both tails."""

from functools import lru_cache
from math import pi, sqrt

import numpy as np
import numpy.typing as npt
from scipy.special import erfcx, ndtr, roots_hermitenorm

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed, generator
from sdpgrind.sdp._distributions.law import (
    Law,
    LocationScale,
    Size,
    amounts,
    atom_over,
    atom_under,
    checked_power,
)

ROOT2 = sqrt(2.0)
HALF_PI = sqrt(pi / 2)  # derived: also the mean of the unit Rayleigh law
NORMAL_REACH = 8.5  # derived: P(Z > 8.5) < 1e-17


def _mills(x: Floats) -> Floats:
    """Phi(x)/phi(x) for x <= 0."""
    ratio: Floats = HALF_PI * erfcx(-x / ROOT2)
    return ratio


def normal_density(x: Floats) -> Floats:
    """Density of the standard normal law."""
    return np.exp(-0.5 * x * x) / sqrt(2 * pi)


def normal_under(v: Floats, power: int) -> Floats:
    """E((v - Z)+)^power of a standard normal Z, accurate in both tails."""
    if power == 0:
        return np.asarray(ndtr(v))
    low = np.minimum(v, 0.0)
    ratio = _mills(low)
    if power == 1:
        tail = normal_density(low) * np.maximum(1 + low * ratio, 0.0)
        return np.where(v < 0, tail, v * ndtr(v) + normal_density(v))
    tail = normal_density(low) * np.maximum((1 + low * low) * ratio + low, 0.0)
    return np.where(v < 0, tail, (1 + v * v) * ndtr(v) + v * normal_density(v))


@lru_cache(maxsize=64)
def hermite(n: int) -> tuple[Floats, Floats]:
    """Gauss rule of the standard normal law."""
    points, weights = roots_hermitenorm(n)
    return points, weights / weights.sum()


class Normal(LocationScale):
    """Normal law.

    Parameters
    ----------
    mean, sd : array_like
        Mean and standard deviation >= 0, in the unit of D; sd = 0 gives a point mass.

    Raises
    ------
    ValueError
        When an sd is negative, or a value is not finite.

    Examples
    --------
    >>> float(Normal(0.0, 1.0).under(0.0).round(6))
    0.398942
    """

    def __init__(self, mean: npt.ArrayLike, sd: npt.ArrayLike) -> None:
        self._set(amounts("mean", mean), amounts("sd", sd, 0.0))
        self.mean, self.sd = self._location, self._scale

    @property
    def support(self) -> tuple[Floats, Floats]:
        """Ends (two arrays of `shape`, unit of D) beyond each of which the probability is below 1e-17."""
        reach = NORMAL_REACH * self._scale
        return self._location - reach, self._location + reach

    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        """Draw from `rng`; `size` (by default `shape`) must broadcast with `shape`. Unit of D."""
        return self._location + self._scale * generator(rng).standard_normal(
            self.shape if size is None else size
        )

    def nodes(self, n: int) -> tuple[Floats, Floats]:
        """Return the Gauss-Hermite rule with `n` points on the last axis; see `Law.nodes`. Unit of D."""
        unit, weights = hermite(checks.count("n", n))
        return self._placed(unit), np.broadcast_to(weights, (*self.shape, n))

    def _fine(self) -> tuple[Floats, Floats]:
        return self.nodes(128)

    _panel_count = 9  # each about two standard deviations wide

    def _unit_density(self, v: Floats) -> Floats:
        return normal_density(v)

    def _unit_under(self, v: Floats, power: int) -> Floats:
        return normal_under(v, power)

    def _unit_over(self, v: Floats, power: int) -> Floats:
        return normal_under(-v, power)


class LogNormal(Law):
    """Log-normal law with a given mean and standard deviation.

    ln D has variance ln(1 + sd^2/mean^2) and mean ln(mean) minus half of it: Brown (1988), Table 4-1.

    Parameters
    ----------
    mean, sd : array_like
        Mean >= 0 and standard deviation >= 0 of D itself, in the unit of D; 0 gives a point mass.

    Raises
    ------
    ValueError
        When a mean or an sd is negative or not finite.

    Examples
    --------
    >>> law = LogNormal(1.0, 0.2)
    >>> float(law.over(1.5, power=0).round(6))
    0.015921
    """

    def __init__(self, mean: npt.ArrayLike, sd: npt.ArrayLike) -> None:
        mean, sd = np.broadcast_arrays(amounts("mean", mean, 0.0), amounts("sd", sd, 0.0))
        relative = np.divide(sd, mean, out=np.zeros(mean.shape), where=mean > 0)
        self.shape, self.mean = mean.shape, mean.copy()
        self._sigma = np.sqrt(np.log1p(relative**2))
        self._spread = self._sigma > 1e-100  # smaller ones overflow in squares of standard values
        self.sd = np.where(self._spread, sd, 0.0)
        self._safe_mean = np.where(self._spread, mean, 1.0)
        self._safe_sigma = np.where(self._spread, self._sigma, 1.0)

    def under(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((y - D)+)^power for power 1 and 2, P(D <= y) for power 0; unit of D to that power."""
        y = np.asarray(y, dtype=float)
        power = checked_power(power)
        z, inside, top = self._standard(y)
        low, s = np.minimum(z, 0.0), self._safe_sigma
        tail = top**power * normal_density(low) * _difference(low, -s, power)
        body = self._incomplete(top, z, power)
        smooth = np.where(inside, np.where(z < 0, tail, body), 0.0)
        return np.where(self._spread, smooth, atom_under(y - self.mean, power))

    def over(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((D - y)+)^power for power 1 and 2, P(D > y) for power 0; unit of D to that power."""
        y = np.asarray(y, dtype=float)
        power = checked_power(power)
        z, inside, top = self._standard(y)
        s = self._safe_sigma
        far = np.maximum(z, power * s)
        tail = top**power * normal_density(far) * _difference(-far, s, power)
        gap = self.mean - y
        whole = (1.0, gap, self.sd**2 + gap**2)[power]
        body = whole - np.array([1, -1, 1])[power] * self._incomplete(top, z, power)
        smooth = np.where(inside, np.where(z > power * s, tail, body), whole)
        return np.where(self._spread, smooth, atom_over(y - self.mean, power))

    @property
    def support(self) -> tuple[Floats, Floats]:
        """Ends (two arrays of `shape`, unit of D) beyond each of which the probability is below 1e-17."""
        reach, shift = NORMAL_REACH * self._sigma, 0.5 * self._sigma**2
        return self.mean * np.exp(-reach - shift), self.mean * np.exp(reach - shift)

    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        """Draw from `rng`; `size` (by default `shape`) must broadcast with `shape`. Unit of D."""
        unit = generator(rng).standard_normal(self.shape if size is None else size)
        return np.asarray(self.mean * np.exp(self._sigma * unit - 0.5 * self._sigma**2))

    def _fine(self) -> tuple[Floats, Floats]:
        unit, weights = hermite(128)
        sigma = self._sigma[..., None]
        points = self.mean[..., None] * np.exp(sigma * unit - 0.5 * sigma**2)
        return points, np.broadcast_to(weights, points.shape)

    def _standard(self, y: Floats) -> tuple[Floats, npt.NDArray[np.bool_], Floats]:
        """Standard value of ln y, the mask y > 0, and y there (the mean elsewhere)."""
        inside = y > 0
        top = np.where(inside, y, self._safe_mean)
        return (
            (np.log(top) - np.log(self._safe_mean)) / self._safe_sigma + 0.5 * self._safe_sigma,
            inside,
            top,
        )

    def _incomplete(self, y: Floats, z: Floats, power: int) -> Floats:
        """E((y - D)^power; D <= y), by incomplete moments of D."""
        m, s = self._safe_mean, self._safe_sigma
        if power == 0:
            return np.asarray(ndtr(z))
        if power == 1:
            return np.asarray(y * ndtr(z) - m * ndtr(z - s))
        return np.asarray(y * y * ndtr(z) - 2 * y * m * ndtr(z - s) + m * m * np.exp(s * s) * ndtr(z - 2 * s))


def _difference(x: Floats, step: Floats, power: int) -> Floats:
    """Difference of order `power` of Mills' ratio, by y^k phi(z) = E(D^k) phi(z - k s)."""
    if power == 0:
        return _mills(x)
    if power == 1:
        return np.maximum((_mills(x + step) - _mills(x)) * np.sign(step), 0.0)
    return np.maximum(_mills(x) - 2 * _mills(x + step) + _mills(x + 2 * step), 0.0)
