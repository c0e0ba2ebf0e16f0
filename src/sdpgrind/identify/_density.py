"""Density of an amount >= 0 from a sample: kernels, or the derivative of a curve through quantiles.

Brown (1988), section 8.3, differentiates a smooth curve through all points of the cumulative plot; a kernel
is far more accurate, a monotone curve through a few quantiles lies between.
"""

import dataclasses
from math import pi, sqrt

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator
from scipy.special import ndtr

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed, generator

METHODS = ("truncated", "reflected", "log")


@dataclasses.dataclass(frozen=True, eq=False)
class KernelDensity:
    """Sum of normal kernels on the members of a sample, made a density on amounts >= 0; see `kernel_density`.

    Parameters
    ----------
    data : array, shape (n,)
        The sample, sorted, any unit (that of the amount).
    bandwidth : float
        Standard deviation of the kernels, in the unit of the amount; of its logarithm (unit 1) for "log".
    method : {"truncated", "reflected", "log"}
        Treatment of the boundary at 0.

    Examples
    --------
    >>> density = kernel_density([0.8, 1.0, 1.2], bandwidth=0.1)
    >>> float(density.pdf(1.0).round(3)), float(density.cdf(1.0).round(3))
    (1.69, 0.5)
    """

    data: Floats
    bandwidth: float
    method: str

    def pdf(self, amount: npt.ArrayLike) -> Floats:
        """Return the density (inverse unit of the amount) at amounts, 0 below 0."""
        d = np.asarray(amount, dtype=float)
        if self.method == "log":
            inside = np.where(d > 0, d, 1.0)
            return np.where(d > 0, self._bumps(np.log(inside), np.log(self.data)) / inside, 0.0)
        bumps = self._bumps(d, self.data)
        if self.method == "reflected":
            bumps = bumps + self._bumps(d, -self.data)
        return np.where(d >= 0, bumps / (1 - self._cut), 0.0)

    def cdf(self, amount: npt.ArrayLike) -> Floats:
        """Return the probability (unit 1) of no more than an amount."""
        d = np.asarray(amount, dtype=float)
        if self.method == "log":
            return np.where(d > 0, self._steps(np.log(np.where(d > 0, d, 1.0)), np.log(self.data)), 0.0)
        steps = self._steps(d, self.data)
        if self.method == "reflected":
            steps = steps + self._steps(d, -self.data) - 1
        return np.where(d >= 0, (steps - self._cut) / (1 - self._cut), 0.0)

    @property
    def leak(self) -> float:
        """Probability (unit 1) below 0 of normal kernels without a treatment of the boundary."""
        return 0.0 if self.method == "log" else float(self._steps(np.zeros(()), self.data))

    @property
    def _cut(self) -> float:
        return self.leak if self.method == "truncated" else 0.0

    def sample(self, rng: Seed, size: int) -> Floats:
        """Draw `size` amounts (unit of the amount) from `rng`."""
        source = generator(rng)
        if self.method == "log":
            return np.exp(
                source.choice(np.log(self.data), size) + self.bandwidth * source.standard_normal(size)
            )
        drawn = source.choice(self.data, size) + self.bandwidth * source.standard_normal(size)
        if self.method == "reflected":
            return np.abs(drawn)
        while np.any(low := drawn < 0):
            count = int(low.sum())
            drawn[low] = source.choice(self.data, count) + self.bandwidth * source.standard_normal(count)
        return drawn

    def standardised(self) -> tuple[tuple[float, ...], float]:
        """Return the sample standardised to mean 0 and sd 1, and the bandwidth in its sd (both unit 1).

        An empirical outcome law is made of them. For "log" the bandwidth is that at the mean.
        """
        mean, sd = self.data.mean(), self.data.std()
        width = self.bandwidth * mean if self.method == "log" else self.bandwidth
        return tuple(((self.data - mean) / sd).tolist()), float(width / sd)

    def _bumps(self, at: Floats, centres: Floats) -> Floats:
        z = (at[..., None] - centres) / self.bandwidth
        return np.asarray(np.exp(-0.5 * z * z).mean(axis=-1) / (self.bandwidth * sqrt(2 * pi)))

    def _steps(self, at: Floats, centres: Floats) -> Floats:
        return np.asarray(ndtr((at[..., None] - centres) / self.bandwidth).mean(axis=-1))


def kernel_density(
    sample: npt.ArrayLike, *, bandwidth: float | None = None, method: str = "truncated"
) -> KernelDensity:
    """Return the density of an amount >= 0 by normal kernels on its sample.

    Parameters
    ----------
    sample : array_like
        At least two different amounts >= 0 (> 0 for "log"), any unit.
    bandwidth : float, optional
        Standard deviation of the kernels, in the unit of the amount; of its logarithm (unit 1) for "log".
        Default: Silverman's rule, (3n/4)^(-1/5) standard deviations of the sample (of its logarithms).
    method : {"truncated", "reflected", "log"}
        Truncate at 0 and renormalise (default); reflect at 0; kernels on the logarithm.

    Returns
    -------
    KernelDensity
        With ``pdf``, ``cdf``, ``sample``, ``leak``, ``standardised``.

    Raises
    ------
    ValueError
        When the sample is empty, not finite, without spread, or has negative amounts.

    Examples
    --------
    >>> float(kernel_density([0.0, 0.5, 1.0]).leak.__round__(2))
    0.21
    """
    checks.one_of("method", method, METHODS)
    data = amounts_of("sample", sample, zero=method != "log")
    shape = np.log(data) if method == "log" else data
    if bandwidth is None:
        return KernelDensity(data, float(shape.std(ddof=1)) * (0.75 * data.size) ** -0.2, method)
    return KernelDensity(data, checks.positive("bandwidth", bandwidth), method)


def amounts_of(name: str, sample: npt.ArrayLike, zero: bool = True) -> Floats:
    """Return a sorted sample of at least two different amounts >= 0 (or > 0)."""
    data = np.sort(checks.finite_array(name, sample).ravel())
    bad = int(np.sum(data < 0 if zero else data <= 0))
    if bad:
        rule = ">= 0" if zero else "> 0"
        raise ValueError(
            f"{name} must be {rule}; got {bad} of {data.size} values that are not, the least {data[0]:g}"
        )
    if data.size < 2 or data[0] == data[-1]:
        raise checks.refuse(name, "at least two different values", data.tolist())
    return data


@dataclasses.dataclass(frozen=True, eq=False)
class QuantileDensity:
    """Derivative of a monotone curve through quantiles of a sample; see `quantile_density`.

    Parameters
    ----------
    edges : array, shape (bins + 1,)
        Amounts at which the cumulative curve is known, any unit.
    probability : array, shape (bins + 1,)
        Its values there, unit 1.
    """

    edges: Floats
    probability: Floats

    @property
    def _curve(self) -> PchipInterpolator:
        return PchipInterpolator(self.edges, self.probability)

    def cdf(self, amount: npt.ArrayLike) -> Floats:
        """Return the probability (unit 1) of no more than an amount."""
        clipped = np.clip(np.asarray(amount, dtype=float), self.edges[0], self.edges[-1])
        return np.asarray(self._curve(clipped))

    def pdf(self, amount: npt.ArrayLike) -> Floats:
        """Return the density (inverse unit of the amount) at amounts."""
        d = np.asarray(amount, dtype=float)
        inside = (d >= self.edges[0]) & (d <= self.edges[-1])
        slope = self._curve(np.clip(d, self.edges[0], self.edges[-1]), 1)
        return np.where(inside, np.maximum(slope, 0.0), 0.0)


def quantile_density(sample: npt.ArrayLike, *, bins: int = 8) -> QuantileDensity:
    """Return the density of an amount >= 0 as the derivative of a monotone cubic curve through quantiles.

    Parameters
    ----------
    sample : array_like
        At least two different amounts >= 0, any unit.
    bins : int
        Number of intervals of equal probability, >= 1; few compared with the points.

    Returns
    -------
    QuantileDensity
        With ``pdf`` and ``cdf``; 0 below 0 and above the greatest amount.

    Raises
    ------
    ValueError
        As `kernel_density`, or when two quantiles coincide.

    Examples
    --------
    >>> float(quantile_density([0.5, 1.0, 1.5, 2.0], bins=2).cdf(1.25))
    0.5
    """
    data = amounts_of("sample", sample)
    share = np.linspace(0, 1, checks.count("bins", bins) + 1)
    edges = np.quantile(data, share)
    edges[0] = 0.0  # the curve starts where amounts do
    if np.any(np.diff(edges) <= 0):
        raise checks.refuse("bins", "so few that no two quantiles of the sample coincide", bins)
    return QuantileDensity(edges, share)
