"""Laws truncated at 0, and the law of a sample, by partial moments of the untruncated law."""

from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PPoly
from scipy.special import roots_legendre

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.rng import Seed, generator
from sdpgrind.sdp._distributions.law import Law, LocationScale, Size, WrappedLaw, amounts, checked_power
from sdpgrind.sdp._distributions.normal import NORMAL_REACH, Normal, hermite, normal_density, normal_under


class Rectified(Law):
    """max(D, 0) of another law: the probability below 0 becomes an atom at 0."""

    def __init__(self, base: Law) -> None:
        self._base, self.shape = base, base.shape
        self._lack = base.under(0.0, 1)
        self._lack2 = base.under(0.0, 2)
        self.mean = base.over(0.0, 1)
        # The first form keeps its digits if little is below 0, the second if nearly all is.
        kept = base.sd**2 - self._lack2 - 2 * base.mean * self._lack - self._lack**2
        left = base.over(0.0, 2) - self.mean**2
        self.sd = np.sqrt(np.maximum(np.where(base.mean > 0, kept, left), 0.0))

    @property
    def lost(self) -> Floats:
        """Probability moved from below 0 to 0, unit 1: Phi(-mean/sd) of a normal law."""
        return self._base.under(np.nextafter(0.0, -1.0), 0)

    def under(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((y - D)+)^power for power 1 and 2, P(D <= y) for power 0; unit of D to that power."""
        y = np.asarray(y, dtype=float)
        top = np.maximum(y, 0.0)
        value = self._base.under(top, checked_power(power))
        if power == 1:
            value = value - self._lack
        if power == 2:
            value = value - self._lack2 - 2 * top * self._lack
        return np.where(y < 0, 0.0, np.maximum(value, 0.0))

    def over(self, y: npt.ArrayLike, power: int = 1) -> Floats:
        """Return E((D - y)+)^power for power 1 and 2, P(D > y) for power 0; unit of D to that power."""
        y = np.asarray(y, dtype=float)
        gap = self.mean - y
        whole = (1.0, gap, self.sd**2 + gap**2)[checked_power(power)]
        return np.where(y < 0, whole, self._base.over(np.maximum(y, 0.0), power))

    @property
    def support(self) -> tuple[Floats, Floats]:
        """Ends (two arrays of `shape`, unit of D) beyond each of which the probability is below 1e-17."""
        low, high = self._base.support
        return np.maximum(low, 0.0), np.maximum(high, 0.0)

    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        """Draw from `rng`; `size` (by default `shape`) must broadcast with `shape`. Unit of D."""
        return np.maximum(self._base.sample(rng, size), 0.0)

    def _fine(self) -> tuple[Floats, Floats]:
        if not isinstance(self._base, Normal | _Smoothed):
            points, weights = self._base._fine()
            return np.maximum(points, 0.0), weights
        return _above_zero(self._base, self.lost)


class RectifiedNormal(Rectified):
    """max(N, 0) of a normal N.

    Parameters
    ----------
    mean, sd : array_like
        Mean and standard deviation >= 0 of N, in the unit of D; the attributes ``mean`` and ``sd`` are those
        of max(N, 0).

    Raises
    ------
    ValueError
        When an sd is negative, or a value is not finite.

    Examples
    --------
    >>> law = RectifiedNormal(1.0, 0.5)
    >>> float(law.lost.round(5)), float(law.mean.round(5))
    (0.02275, 1.00425)
    """

    def __init__(self, mean: npt.ArrayLike, sd: npt.ArrayLike) -> None:
        super().__init__(Normal(mean, sd))


@lru_cache(maxsize=8)
def _panels(number: int) -> tuple[Floats, Floats]:
    """Gauss-Legendre rule of 16 points in each of `number` equal parts of [0, 1]."""
    x, w = roots_legendre(16)
    starts = np.arange(number)[:, None]
    return ((starts + 0.5 * (x + 1)) / number).ravel(), np.tile(0.5 * w / number, number)


def _above_zero(base: "Normal | _Smoothed", lost: Floats) -> tuple[Floats, Floats]:
    """Quadrature of the density above 0, and the atom at 0."""
    low, high = (np.maximum(end, 0.0) for end in base.support)
    x, w = _panels(base._panel_count)
    points = low[..., None] + (high - low)[..., None] * x
    scale = np.where(base._scale > 0, base._scale, 1.0)[..., None]
    weights = w * base._unit_density((points - base._location[..., None]) / scale)
    total = weights.sum(axis=-1, keepdims=True)
    # A point mass, or a law wholly below 0, has no density: one point at the low end.
    first = np.where(np.arange(x.size) == 0, 1.0, 0.0)
    weights = np.where(total > 0, weights / np.where(total > 0, total, 1.0), first)
    share = np.where(base._scale > 0, 1 - lost, 1.0)[..., None]
    zero = np.zeros((*base.shape, 1))
    return np.concatenate([zero, points], axis=-1), np.concatenate(
        [zero + 1 - share, share * weights], axis=-1
    )


class _Steps(LocationScale):
    """location + scale * (member of a sorted sample), by running sums from either end."""

    def __init__(self, mean: Floats, sd: Floats, sample: Floats) -> None:
        self._set(mean, sd)
        self.mean, self.sd = self._location, self._scale
        self._sorted = sample
        self._below = _running(sample)
        self._above = _running(-sample[::-1])

    @property
    def support(self) -> tuple[Floats, Floats]:
        return self._location + self._scale * self._sorted[0], self._location + self._scale * self._sorted[-1]

    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        drawn = generator(rng).choice(self._sorted, size=self.shape if size is None else size)
        return np.asarray(self._location + self._scale * drawn)

    def _fine(self) -> tuple[Floats, Floats]:
        points = self._placed(self._sorted)
        return points, np.full(points.shape, 1 / self._sorted.size)

    def _unit_under(self, v: Floats, power: int) -> Floats:
        return _step_moment(v, self._below, np.searchsorted(self._sorted, v, side="right"), power)

    def _unit_over(self, v: Floats, power: int) -> Floats:
        rank = self._sorted.size - np.searchsorted(self._sorted, v, side="right")
        return _step_moment(-v, self._above, rank, power)


def _running(ordered: Floats) -> Floats:
    """Running sums of the 0th, 1st and 2nd powers, over the sample size."""
    powers = np.stack([np.ones(ordered.size), ordered, ordered**2])
    return np.concatenate([np.zeros((3, 1)), np.cumsum(powers, axis=1)], axis=1) / ordered.size


def _step_moment(v: Floats, sums: Floats, rank: npt.NDArray[np.intp], power: int) -> Floats:
    number, first, second = sums[:, rank]
    if power == 0:
        return np.asarray(number)
    value = number * v - first if power == 1 else (number * v - 2 * first) * v + second
    return np.asarray(np.maximum(value, 0.0))


class _Smoothed(LocationScale):
    """location + scale * (the sample smoothed by a normal kernel).

    Sums over the kernels are tabulated at knots a 32nd of the kernel's sd apart and interpolated by
    polynomials of degree 5 (error below 1e-13 of the scale).
    """

    def __init__(self, mean: Floats, sd: Floats, sample: Floats, width: float) -> None:
        self._set(mean, sd)
        self.mean, self.sd = self._location, self._scale
        self._sorted, self._width = sample, width
        self._lower = _kernel_tables(sample.tobytes(), width)
        self._upper = _kernel_tables((-sample[::-1]).tobytes(), width)

    @property
    def support(self) -> tuple[Floats, Floats]:
        reach = NORMAL_REACH * self._width
        low, high = self._sorted[0] - reach, self._sorted[-1] + reach
        return self._location + self._scale * low, self._location + self._scale * high

    def sample(self, rng: Seed, size: Size | None = None) -> Floats:
        size, rng = self.shape if size is None else size, generator(rng)
        unit = rng.choice(self._sorted, size=size) + self._width * rng.standard_normal(size)
        return self._location + self._scale * unit

    @property
    def _panel_count(self) -> int:
        return int(np.ceil((self._sorted[-1] - self._sorted[0]) / (2 * self._width) + NORMAL_REACH))

    def _fine(self) -> tuple[Floats, Floats]:
        x, w = hermite(32)
        points = self._placed((self._sorted[:, None] + self._width * x).ravel())
        return points, np.broadcast_to(np.tile(w, self._sorted.size) / self._sorted.size, points.shape)

    def _unit_density(self, v: Floats) -> Floats:
        total = np.zeros(v.shape)
        for centre in self._sorted:
            total += normal_density((v - centre) / self._width)
        return total

    def _unit_under(self, v: Floats, power: int) -> Floats:
        return _kernel_moment(v, self._lower, self._upper, power)

    def _unit_over(self, v: Floats, power: int) -> Floats:
        return _kernel_moment(-v, self._upper, self._lower, power)


@lru_cache(maxsize=16)
def _kernel_tables(sample_bytes: bytes, width: float) -> tuple[PPoly, PPoly, PPoly]:
    """Piecewise polynomials of P(U <= v), E(v - U)+ and E((v - U)+)^2."""
    sample = np.frombuffer(sample_bytes)
    reach = NORMAL_REACH * width
    count = int(np.ceil((sample[-1] - sample[0] + 2 * reach) / (width / 32))) + 1
    knots = np.linspace(sample[0] - reach, sample[-1] + reach, count)
    value, slope, curvature = (np.zeros(count) for _ in range(3))
    for centre in sample:
        v = (knots - centre) / width
        value += width * normal_under(v, 1)
        slope += normal_under(v, 0)
        curvature += normal_density(v) / width
    mean = _hermite_spline(knots, value / sample.size, slope / sample.size, curvature / sample.size)
    double = mean.antiderivative()
    double.c *= 2
    return mean.derivative(), mean, double


def _hermite_spline(knots: Floats, value: Floats, slope: Floats, curvature: Floats) -> PPoly:
    """Quintic Hermite spline of values and two derivatives at the knots."""
    h = np.diff(knots)
    rise, first, second = np.diff(value), slope * h[0], curvature * h[0] ** 2
    f0, f1, s0, s1 = first[:-1], first[1:], second[:-1], second[1:]
    cubic = 10 * rise - 4 * f1 - 6 * f0 + (s1 - 3 * s0) / 2
    quartic = -15 * rise + 7 * f1 + 8 * f0 + (3 * s0 - 2 * s1) / 2
    quintic = 6 * rise - 3 * (f1 + f0) + (s1 - s0) / 2
    terms = [quintic, quartic, cubic, s0 / 2, f0, value[:-1]]
    return PPoly(np.stack([term / h**k for term, k in zip(terms, range(5, -1, -1), strict=True)]), knots)


def _kernel_moment(v: Floats, near: tuple[PPoly, ...], far: tuple[PPoly, ...], power: int) -> Floats:
    """E((v - U)+)^power: below the mean 0 by its own table, above it as complement of the other side."""
    whole = (1.0, v, 1 + v * v)[power]
    other = _looked_up(np.minimum(-v, 0.0), far[power])
    return np.where(
        v < 0, _looked_up(np.minimum(v, 0.0), near[power]), whole + other if power == 1 else whole - other
    )


def _looked_up(v: Floats, table: PPoly) -> Floats:
    low, high = table.x[0], table.x[-1]
    inside = np.maximum(table(np.clip(v, low, high)), 0.0)
    return np.where((v < low) | (v > high), 0.0, inside)


class Empirical(WrappedLaw):
    """Law with the shape of a sample, and a given mean and standard deviation.

    D = mean + sd U, U the sample standardised, smoothed by a normal kernel of sd `bandwidth`, and rescaled to
    variance 1; max(D, 0) if `rectified`.

    Parameters
    ----------
    mean, sd : array_like
        Mean and standard deviation >= 0 before rectification, in the unit of D.
    sample : array_like
        At least two different numbers, any unit.
    bandwidth : float
        Sd of the kernel over that of the sample, 0 (no smoothing) or in [0.01, 10], unit 1.
    rectified : bool
        Truncate at 0; the attributes ``mean`` and ``sd`` are those of the result.

    Raises
    ------
    ValueError
        When a number is not finite, an sd or the bandwidth is out of range, or the sample has no spread.

    Examples
    --------
    >>> law = Empirical(1.0, 0.1, sample=[1.0, 2.0, 2.0, 3.0])
    >>> float(law.mean), float(law.sd.round(12)), float(law.over(1.1, power=0))
    (1.0, 0.1, 0.25)
    """

    def __init__(
        self,
        mean: npt.ArrayLike,
        sd: npt.ArrayLike,
        sample: npt.ArrayLike,
        bandwidth: float = 0.0,
        rectified: bool = True,
    ) -> None:
        mean, sd = np.broadcast_arrays(amounts("mean", mean), amounts("sd", sd, 0.0))
        unit, bandwidth = _standardised(sample), _checked_bandwidth(bandwidth)
        shrink = np.sqrt(1 + bandwidth**2)
        core = _Smoothed(mean, sd, unit / shrink, bandwidth / shrink) if bandwidth else _Steps(mean, sd, unit)
        self._law: Law = Rectified(core) if rectified else core
        self.shape, self.mean, self.sd = self._law.shape, self._law.mean, self._law.sd

    @property
    def lost(self) -> Floats:
        """Probability that rectification moved to 0, unit 1; else 0."""
        return self._law.lost if isinstance(self._law, Rectified) else np.zeros(self.shape)


def _standardised(sample: npt.ArrayLike) -> Floats:
    values = np.sort(checks.finite_array("sample", sample).ravel())
    if values.size == 0 or values[0] == values[-1]:
        raise checks.refuse("sample", "at least two different numbers", values.tolist())
    return np.asarray((values - values.mean()) / values.std())


def _checked_bandwidth(bandwidth: float) -> float:
    value = checks.nonnegative("bandwidth", bandwidth)
    if value and not 0.01 <= value <= 10:
        raise checks.refuse("bandwidth", "0 or in [0.01, 10] (standard deviations of the sample)", value)
    return value
