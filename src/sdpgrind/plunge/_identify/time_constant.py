"""Time constant of the linear model v' = (u - v)/tau from command and size: Dong (1), (4) and (5).

The deflection x = tau v obeys x' = u - x/tau; the size is the commanded infeed less x plus an offset of the
gauge. For a command held between samples this is exact at any sample time.
"""

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import chdtri

from sdpgrind import identify as idf
from sdpgrind.base import checks, serial
from sdpgrind.base.checks import Floats
from sdpgrind.plunge._identify import rounding
from sdpgrind.plunge._identify.cycles import MOVING, Cycle, concluded, fault_of_lag, not_identified
from sdpgrind.plunge._plan.replay_kernels import lagged_sizes

NAME, UNIT = "time_constant", "s"
RANGE = (0.05, 50.0)  # chosen: range of the time constant, s
FAINT = "command and size say too little of it: take readings while the rate changes, as after the start"
_CURVED = (
    "the linear model leaves more than noise: at other rates the lag is another; in spark-out with `problem`"
)
_BLOCK, _RARELY = 32, 1e-3  # measured, chosen: readings of a mean; white noise counts as curvature so rarely
_STRAIGHT = 48  # measured: readings over which a misfit of the lag is a line
_SIGNIFICANT = 8.0  # derived: square of a normal value exceeded once in 200 by chance, in variances
_AT_END = 1e-8  # chosen: distance from the end of its range at which a touch-in counts as held there, mm
_ENTRIES = 25  # chosen: time constants among which a fit starts; fewer miss its valley
_KEPT = 2  # derived: a fit asks for sizes, and for slopes there or at the values before
_ALIKE = 0.866  # chosen: correlation with the touch-in from which it doubles the sd of the time constant


def by_output_error(cycle: Cycle) -> idf.Estimate:
    """Least squares of the size over time constant, offset of the gauge and touch-in."""
    if reason := fault_of_lag(cycle):
        return not_identified(NAME, UNIT, reason)
    found = fitted(cycle)
    told = concluded(_of_logarithm(found), FAINT)
    return told.replace(message=_CURVED) if told.ok and _curved(cycle, found) else told


def fitted(cycle: Cycle, noise: str = "first order") -> idf.Estimate:
    """Logarithm of the time constant, offset of the gauge and touch-in (mm).

    Where the command hardly tells a touch-in from a lag, an insignificant one is 0 in the values; in their
    covariance it always is a fitted value, since none is known, and the step from the fitted values counts as
    an error: a small touch-in that was there biases the time constant by it.
    """
    touched = _rounded(fit(cycle, noise), cycle)
    told = touched.value[2] ** 2 > _SIGNIFICANT * touched.covariance[2, 2]
    if touched.ok and (told or abs(touched.correlation[0, 2]) < _ALIKE):
        return touched
    plain = _rounded(fit(cycle, noise, size=2), cycle)
    value, covariance = np.append(plain.value, 0.0), np.pad(plain.covariance, (0, 1))
    if touched.ok:
        step = touched.value - value
        return touched.replace(value=value, covariance=touched.covariance + np.outer(step, step))
    return plain.replace(names=touched.names, units=touched.units, value=value, covariance=covariance)


def _rounded(found: idf.Estimate, cycle: Cycle) -> idf.Estimate:
    return rounding.widened(found, cycle, lambda values: residual(cycle, values))


def fit(cycle: Cycle, noise: str = "first order", *, size: int = 3, correlation: float = 0.0) -> idf.Estimate:
    """The first `size` values of `fitted` by least squares of residuals filtered by a known correlation.

    The touch-in is sought before the first moving size. Noise that resembles the reading before may feign one
    in the air: a touch-in that ends there is sought in all that the command feeds.
    """
    first = max(float(cycle.infeed[int(np.argmax(cycle.moving))]), 1e-6)
    found = _fit_before(first, cycle, noise, size, correlation)
    if size < 3 or found.value[2] < first - _AT_END:
        return found
    return _fit_before(float(cycle.infeed[-1]), cycle, noise, size, correlation)


def _fit_before(last: float, cycle: Cycle, noise: str, size: int, correlation: float) -> idf.Estimate:
    """`fit` of a touch-in up to `last`, mm."""
    (low, high), begin = np.log(RANGE), _begin(cycle)
    time = cycle.time[cycle.read]
    apart = serial.gaps(time, time.size)
    white = serial.whitening(correlation, apart)

    @lru_cache(maxsize=_KEPT)
    def model(log_tau: float, touch_in: float = 0.0) -> Floats:
        return lagged(cycle, float(np.exp(log_tau)), touch_in)

    def left(values: Floats) -> Floats:
        off = (cycle.size - model(values[0], *values[2:])[0])[cycle.read] - values[1]
        return white(off)

    def slopes(values: Floats) -> Floats:
        by_lag, by_touch = -model(values[0], *values[2:])[1:, cycle.read]
        each = np.array([by_lag, np.full(by_lag.size, -1.0), by_touch][:size])
        return white(each).T

    return idf.output_error(
        left,
        [*begin, 0.0][:size],
        scale=[0.1, 1e-3, 1e-3][:size],
        low=[low, -np.inf, -float(cycle.infeed[-1])][:size],
        high=[high, np.inf, last][:size],
        noise=noise,
        time=time,
        jacobian=slopes,
        throw=False,
    )


@lru_cache(maxsize=1)
def _begin(cycle: Cycle) -> tuple[float, float]:
    """Logarithm of the time constant and offset (mm) from which the fits of a cycle start."""
    low, high = np.log(RANGE)
    entries = np.linspace(low, high, _ENTRIES)
    begin = float(min(entries, key=lambda entry: float(np.var(residual(cycle, [entry])))))
    return begin, float(np.mean(residual(cycle, [begin])))


def residual(cycle: Cycle, values: npt.ArrayLike) -> Floats:
    """Sizes read (mm) less those of the model, for values as in `fitted`; left out: 0."""
    log_tau, offset, touch_in = np.append(np.asarray(values, dtype=float), [0.0, 0.0])[:3]
    size = lagged(cycle, float(np.exp(log_tau)), float(touch_in))[0]
    return np.asarray((cycle.size - size)[cycle.read] - offset)


def _curved(cycle: Cycle, found: idf.Estimate) -> bool:
    """Whether block means of the whitened residuals differ by more than their noise (chi-square test).

    The correlation is that about local lines, which slow misfit does not raise, and a margin for its error:
    the more alike the readings, the more an error of it would make of their means.
    """
    off = residual(cycle, found.value)
    if off.size < 2 * _BLOCK:
        return False
    alike = serial.local_correlation(off, _STRAIGHT)
    rho = min(found.noise_correlation, alike + 0.5 * (1 + alike) * float(off.size) ** -0.5)
    rho = rounding.unrounded(rho, cycle.size[cycle.read], found.noise_sd, found.value.size)
    white = serial.filtered(off, rho, serial.gaps(cycle.time[cycle.read], off.size))
    count = white.size // _BLOCK
    means = white[: count * _BLOCK].reshape(count, _BLOCK).mean(axis=1)
    noise = max(float(np.mean(np.diff(white) ** 2)) / 2, 1e-12) / _BLOCK
    noises = noise + rounding.of_means(cycle, count, _BLOCK, rho)
    return bool(means @ (means / noises) > chdtri(count - 1, _RARELY))


def _of_logarithm(found: idf.Estimate) -> idf.Estimate:
    tau = float(np.exp(found.value[0]))
    at_end = not 1.001 * RANGE[0] < tau < RANGE[1] / 1.001
    status = idf.Status.NOT_IDENTIFIED if at_end else found.status
    square = np.where(np.isfinite(found.covariance[:1, :1]), tau**2 * found.covariance[:1, :1], np.inf)
    return found.replace(
        names=(NAME,), value=np.array([tau]), covariance=square, status=status, message="", units=(UNIT,)
    )


def lagged(cycle: Cycle, time_constant: float, touch_in: float = 0.0) -> Floats:
    """Size (mm) of the linear model after `touch_in` (mm) of command; below 0: deflected at the start.

    Then its derivatives by the logarithm of the time constant, mm, and by the touch-in, unit 1.
    """
    return np.asarray(lagged_sizes(cycle.infeed, cycle.command_rate, cycle.step, time_constant, touch_in))


def recursively(cycles: tuple[Cycle, ...], forgetting: float) -> idf.Estimate:
    """Streaming estimate over all parts."""
    estimator = TimeConstantEstimator(forgetting=forgetting)
    reasons = [reason for reason in map(fault_of_lag, cycles) if reason]
    for cycle in cycles:
        if not fault_of_lag(cycle):
            estimator.begin(touch_in=float(fitted(cycle, noise="white").value[2]))
            for row in zip(
                cycle.time.tolist(), cycle.size.tolist(), cycle.command_rate.tolist(), strict=True
            ):
                estimator.update(time=row[0], size=row[1], command_rate=row[2])
    found = estimator.estimate
    return not_identified(NAME, UNIT, reasons[0]) if reasons and not found.ok else found


def as_printed(cycles: tuple[Cycle, ...], forgetting: float) -> idf.Estimate:
    """Recursive least squares of (4): q(i) = a' q(i-1) + b' p(i-1), tau = -dt/ln a'."""
    if reasons := [reason for reason in map(fault_of_lag, cycles) if reason]:
        return not_identified(NAME, UNIT, reasons[0])
    step = float(np.median(np.concatenate([cycle.step for cycle in cycles])))
    rls = idf.RecursiveLeastSquares(("pole", "gain"), forgetting=forgetting)
    for cycle in cycles:
        even = np.abs(cycle.step - step) <= 1e-6 * step
        for k in np.flatnonzero(cycle.read[:-1] & cycle.read[1:] & even):
            rls.update([cycle.size[k], cycle.infeed[k]], cycle.size[k + 1])
    fit = rls.estimate
    pole = fit.value[0]
    if not fit.ok or not 0 < pole < 1:
        return not_identified(
            NAME, UNIT, f"(4) gives a' = {pole:.4g}, which is the pole of no lag: it must be in (0, 1)"
        )
    tau = -step / np.log(pole)
    slope = tau**2 / (step * pole)
    covariance = slope**2 * fit.covariance[:1, :1]
    return idf.Estimate((NAME,), np.array([tau]), covariance, units=(UNIT,), freedom=fit.freedom)


class TimeConstantEstimator:
    """Streaming estimate of the time constant of the infeed, with forgetting.

    The linear model runs for 141 time constants at once, each with its sensitivity; the estimate is the
    interpolated zero of the slope of the squared residuals. It needs no start value; without forgetting it
    equals that of all readings at once. Each part has its own constant offset between gauge and command. The
    variance holds for first-order noise, and takes the touch-in for known.

    Parameters
    ----------
    forgetting : float
        Weight of a reading relative to the next one, in (0, 1], unit 1; 1: no forgetting.

    Raises
    ------
    ValueError
        If the forgetting is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> estimator = TimeConstantEstimator()
    >>> for t in np.arange(0.0, 6.0, 0.04):
    ...     size = 0.01 + 0.0448 * (t - 2.0 * (1 - np.exp(-t / 2.0)))
    ...     estimator.update(time=t, size=size, command_rate=0.0448)
    >>> round(estimator.estimate["time_constant"], 4)  # s
    2.0
    """

    def __init__(self, *, forgetting: float = 1.0) -> None:
        checks.share("forgetting", forgetting, "1")
        self._forgetting = float(forgetting)
        self._taus = np.geomspace(*RANGE, 141)
        self.reset()

    def reset(self) -> None:
        """Forget all readings of all parts."""
        self._closed, self._sums = np.zeros((5, self._taus.size)), np.zeros((7, 1))
        self._count = 0
        self.begin()

    def begin(self, *, touch_in: float = 0.0) -> None:
        """Begin a part, with its own offset between gauge and command.

        Parameters
        ----------
        touch_in : float
            Commanded infeed before the wheel grinds, mm: gap and deflection by ploughing. Below 0: deflected
            at the start.
        """
        self._touch = checks.number("touch_in", touch_in, "mm")
        self._closed, size = self._profiled, self._taus.size
        self._deflection, self._sensitivity = np.full(size, max(-self._touch, 0.0)), np.zeros(size)
        self._sums, self._doubles = np.zeros((7, size)), np.zeros((3, size))
        self._last = np.zeros(size)
        self._time, self._command, self._infeed = np.nan, 0.0, 0.0

    def update(self, *, time: float, size: float, command_rate: float) -> None:
        """Take in a size and the command rate that follows.

        Parameters
        ----------
        time : float
            Time since the start of the part, s; one not later than the last begins the next part.
        size : float
            Size, mm; NaN: no reading.
        command_rate : float
            Command rate from then on, mm/s.
        """
        now, u = checks.number("time", time, "s"), checks.number("command_rate", command_rate, "mm/s")
        if now <= self._time:
            self.begin(touch_in=self._touch)
        if np.isfinite(self._time):
            self._advance(now - self._time)
        self._time, self._command = now, u
        if np.isfinite(size):
            self._learn(float(size))

    def _advance(self, step: float) -> None:
        before, self._infeed = self._infeed, self._infeed + self._command * step
        if before < self._touch < self._infeed:
            step *= (self._infeed - self._touch) / (self._infeed - before)
        if self._infeed <= self._touch:
            return
        pole = np.exp(-step / self._taus)
        full = self._command * self._taus
        slope = pole * step / self._taus**2 * (self._deflection - full) + self._command * (1 - pole)
        self._sensitivity = pole * self._sensitivity + slope
        self._deflection = full + pole * (self._deflection - full)

    def _learn(self, size: float) -> None:
        """Add to sums of w(1, r, r^2, g, g^2, g r, r r-1) and w^2(1, g, g^2); r: residuals, g: slopes."""
        f, g = self._forgetting, self._sensitivity
        r = size - max(self._infeed - self._touch, 0.0) + self._deflection
        one = np.ones_like(r)
        self._sums = f * self._sums + np.stack([one, r, r * r, g, g * g, g * r, r * self._last])
        self._doubles = f * f * self._doubles + np.stack([one, g, g * g])
        self._closed = self._closed * np.array([f, f, f, f * f, f])[:, None]
        self._last, self._count = r, self._count + 1

    @property
    def _profiled(self) -> Floats:
        """Of each time constant with the best offsets: squares, slope, information, that of squared weights.

        At last the sum of products of residuals with those before.
        """
        w, r, rr, g, gg, gr, alike = self._sums
        if w[0] == 0:
            return self._closed
        mean = g / w
        double, by, square = self._doubles
        double_of_slope = square - 2 * mean * by + mean**2 * double
        fresh = [rr - r * r / w, gr - g * r / w, gg - g * mean, double_of_slope, alike - r * r / w]
        return np.asarray(self._closed + np.stack(fresh))

    @property
    def estimate(self) -> idf.Estimate:
        """Estimate of ``time_constant`` (s); not ok until the readings determine it."""
        squares, slope, information, double, products = self._profiled
        if self._count < MOVING:
            return not_identified(
                NAME, UNIT, f"{self._count} readings are too few: at least {MOVING} are needed"
            )
        best = int(np.argmin(squares))
        if not 1 < best < self._taus.size - 3:
            return not_identified(NAME, UNIT, FAINT)
        tau = _root(np.log(self._taus), slope, best)
        at = {"x": np.log(tau), "xp": np.log(self._taus)}
        known, twice = np.interp(fp=information, **at), np.interp(fp=double, **at)
        gained = slope[best] ** 2 / information[best]  # by the root between the nodes
        left = max(float(squares[best] - gained), 0.0)
        rho = serial.unbiased(float(products[best] - gained) / left, 2, self._effective) if left > 0 else 0.0
        noise = left / self._weight * self._effective / max(self._effective - 2, 1.0)
        variance = noise * twice / known**2 * (1 + rho) / (1 - rho) if known > 0 else np.inf
        found = idf.Estimate(
            (NAME,),
            np.array([tau]),
            np.full((1, 1), variance),
            message=f"from {self._count} readings",
            units=(UNIT,),
            freedom=serial.effective(self._effective, 2, rho),
            noise_sd=float(np.sqrt(noise)),
            noise_correlation=rho,
        )
        return concluded(found, FAINT)

    @property
    def _weight(self) -> float:
        f = self._forgetting
        return float(self._count) if f == 1 else (1 - f**self._count) / (1 - f)

    @property
    def _effective(self) -> float:
        """Effective number of readings: (sum of weights)^2 / sum of squared weights."""
        f = self._forgetting
        return self._weight**2 / (self._count if f == 1 else (1 - f ** (2 * self._count)) / (1 - f * f))


def _root(x: Floats, slope: Floats, best: int) -> Any:
    """Zero of the slope of the squares, by a cubic through four nodes about the best time constant."""
    first = best - 2 if slope[best] > 0 else best - 1
    nodes = slice(first, first + 4)
    left, right = first + 1, first + 2
    if slope[left] * slope[right] >= 0:
        return np.exp(x[best])
    curve = np.polynomial.Polynomial.fit(x[nodes], slope[nodes], 3)
    roots = curve.roots()
    real = roots[np.abs(roots.imag) < 1e-12].real
    inside = real[(real >= x[left]) & (real <= x[right])]
    return np.exp(inside[0]) if inside.size else np.exp(x[best])
