"""Time constant of the linear model v' = (u - v)/tau from command and size: Dong (1), (4) and (5).

The deflection x = tau v obeys x' = u - x/tau; the size is the commanded infeed less x plus an offset of the
gauge. For a command held between samples this is exact at any sample time.
"""

from typing import Any

import numpy as np
from scipy.special import chdtri

from sdpgrind import identify as idf
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.plunge._identify.cycles import MOVING, Cycle, concluded, fault, not_identified
from sdpgrind.plunge._plan.replay_kernels import lags

NAME, UNIT = "time_constant", "s"
RANGE = (0.05, 50.0)  # chosen: range of the time constant, s
FAINT = "command and size say too little of it: take readings while the rate changes, as after the start"
_CURVED = (
    "the linear model leaves more than noise: at other rates the lag is another; in spark-out with `problem`"
)
_BLOCK, _RARELY = 16, 1e-3  # chosen: readings of a mean; probability that noise alone counts as curvature
_SIGNIFICANT = 8.0  # derived: F with one degree of freedom exceeded once in 200 by chance


def by_output_error(cycle: Cycle) -> idf.Estimate:
    """Least squares of the size over time constant, offset and, where significant, touch-in."""
    if reason := fault(cycle):
        return not_identified(NAME, UNIT, reason)
    fit = _fitted(cycle)
    found = concluded(_of_logarithm(fit), FAINT)
    return found.replace(message=_CURVED) if found.ok and _curved(cycle, fit) else found


def _curved(cycle: Cycle, fit: idf.Estimate) -> bool:
    """Whether block means of the residuals differ by more than the gauge's noise (chi-square test)."""
    off = (cycle.size - lagged(cycle, float(np.exp(fit.value[0])), *fit.value[1:]))[cycle.read]
    count = off.size // _BLOCK
    means = (off - off.mean())[: count * _BLOCK].reshape(count, _BLOCK).mean(axis=1)
    noise = max(cycle.noise_sd, 1e-6) ** 2 / _BLOCK
    return count > 1 and bool(means @ means > noise * chdtri(count - 1, _RARELY))


def _fitted(cycle: Cycle) -> idf.Estimate:
    """Logarithm of the time constant, and the touch-in (mm) where the F test finds it significant."""

    def residual(values: Floats) -> Floats:
        off = (cycle.size - lagged(cycle, float(np.exp(values[0])), *values[1:]))[cycle.read]
        return np.asarray(off - off.mean())

    def square(values: Floats) -> float:
        return float(np.sum(residual(values) ** 2))

    low, high = np.log(RANGE)
    grid = np.linspace(low, high, 25)
    begin = min(grid, key=lambda entry: square(np.array([entry])))
    plain = idf.output_error(residual, [begin], scale=[0.1], low=[low], high=[high], nuisance=1, throw=False)
    first = max(float(cycle.infeed[int(np.argmax(cycle.moving))]), 1e-6)
    start, bounds = [plain.value[0], 0.0], {"low": [low, -float(cycle.infeed[-1])], "high": [high, first]}
    touched = idf.output_error(residual, start, scale=[0.1, 1e-3], nuisance=1, throw=False, **bounds)
    least = square(plain.value)
    better = (least - square(touched.value)) * touched.freedom > _SIGNIFICANT * square(touched.value)
    return touched if touched.ok and better and least > 1e-20 * cycle.time.size else plain


def _of_logarithm(fit: idf.Estimate) -> idf.Estimate:
    tau = float(np.exp(fit.value[0]))
    at_end = not 1.001 * RANGE[0] < tau < RANGE[1] / 1.001
    status = idf.Status.NOT_IDENTIFIED if at_end else fit.status
    square = np.where(np.isfinite(fit.covariance[:1, :1]), tau**2 * fit.covariance[:1, :1], np.inf)
    return idf.Estimate((NAME,), np.array([tau]), square, status, units=(UNIT,), freedom=fit.freedom)


def lagged(cycle: Cycle, time_constant: float, touch_in: float = 0.0) -> Floats:
    """Size (mm) of the linear model after `touch_in` (mm) of command; below 0: deflected at the start."""
    after, before = cycle.infeed[1:] - touch_in, cycle.infeed[:-1] - touch_in
    moved = after - before
    share = np.where(moved > 0, np.clip(after / np.where(moved > 0, moved, 1.0), 0.0, 1.0), 1.0)
    pole = np.exp(-share * cycle.step / time_constant)
    given = cycle.command_rate[:-1] * time_constant * (1 - pole)
    return np.asarray(np.maximum(cycle.infeed - touch_in, 0.0) - lags(max(-touch_in, 0.0), pole, given))


def recursively(cycles: tuple[Cycle, ...], forgetting: float) -> idf.Estimate:
    """Streaming estimate over all parts."""
    estimator = TimeConstantEstimator(forgetting=forgetting)
    reasons = [reason for reason in map(fault, cycles) if reason]
    for cycle in cycles:
        if not fault(cycle):
            estimator.begin(touch_in=float(np.append(_fitted(cycle).value, 0.0)[1]))
            for row in zip(
                cycle.time.tolist(), cycle.size.tolist(), cycle.command_rate.tolist(), strict=True
            ):
                estimator.update(time=row[0], size=row[1], command_rate=row[2])
    found = estimator.estimate
    return not_identified(NAME, UNIT, reasons[0]) if reasons and not found.ok else found


def as_printed(cycles: tuple[Cycle, ...], forgetting: float) -> idf.Estimate:
    """Recursive least squares of (4): q(i) = a' q(i-1) + b' p(i-1), tau = -dt/ln a'."""
    if reasons := [reason for reason in map(fault, cycles) if reason]:
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
    equals that of all readings at once. Each part has its own constant offset between gauge and command.

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
        self._closed, self._sums = np.zeros((4, self._taus.size)), np.zeros((6, 1))
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
        self._sums, self._doubles = np.zeros((6, size)), np.zeros((3, size))
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
        """Add to sums of w(1, r, r^2, g, g^2, g r) and w^2(1, g, g^2); r: residuals, g: slopes."""
        f, g = self._forgetting, self._sensitivity
        r = size - max(self._infeed - self._touch, 0.0) + self._deflection
        one = np.ones_like(r)
        self._sums = f * self._sums + np.stack([one, r, r * r, g, g * g, g * r])
        self._doubles = f * f * self._doubles + np.stack([one, g, g * g])
        self._closed = self._closed * np.array([f, f, f, f * f])[:, None]
        self._count += 1

    @property
    def _profiled(self) -> Floats:
        """Squares, slope, information and that of squared weights per time constant, for the best offsets."""
        w, r, rr, g, gg, gr = self._sums
        if w[0] == 0:
            return self._closed
        mean = g / w
        double, by, square = self._doubles
        fresh = [rr - r * r / w, gr - g * r / w, gg - g * mean, square - 2 * mean * by + mean**2 * double]
        return np.asarray(self._closed + np.stack(fresh))

    @property
    def estimate(self) -> idf.Estimate:
        """Estimate of ``time_constant`` (s); not ok until the readings determine it."""
        squares, slope, information, double = self._profiled
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
        freedom = max(self._effective - 2.0, 1.0)
        left = max(float(squares[best] - slope[best] ** 2 / information[best]), 0.0)
        noise = left / self._weight * self._effective / freedom
        variance = noise * twice / known**2 if known > 0 else np.inf
        found = idf.Estimate(
            (NAME,), np.array([tau]), np.full((1, 1), variance), units=(UNIT,), freedom=freedom
        )
        return concluded(found.replace(message=f"from {self._count} readings"), FAINT)

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
