"""Kalman filter of random walks, and its steady state."""

from collections.abc import Sequence
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Complex, Floats
from sdpgrind.identify._estimate import Estimate, Status
from sdpgrind.identify.kernels import walk_step

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe


class RandomWalk:
    """Kalman filter of p values that change by independent random steps between updates.

    An update reads each value, or one known linear combination of all (`row`): with rows ``[1, cos, sin]`` of
    the spindle angle the filter tracks a slowly moving part. The one-value filter is Mears (4.35)-(4.39); its
    lag is `random_walk_response`.

    Parameters
    ----------
    names : sequence of str
        Names of the p values.
    walk_variance : float or array, shape (p,)
        Variance Q of the step of each value between two updates, >= 0, squared unit of the value.
    noise_variance : float or array, shape (p,)
        Variance R of the noise of each reading, >= 0, squared unit of the reading; one number for rows. Q and
        R are not both 0.
    units : sequence of str
        Units of the values.
    prior : Estimate, optional
        Knowledge before the first update, of the same names. Default: the first reading of a value starts it.

    Raises
    ------
    ValueError, TypeError
        For variances that are negative or both 0, or a prior of other values.

    Examples
    --------
    A closing gap over parts; the third part has no reading:

    >>> track = RandomWalk(("stroke_offset",), walk_variance=1e-6, noise_variance=4e-6, units=("mm",))
    >>> for gap in (0.120, 0.122, float("nan"), 0.131):
    ...     track.update(gap)
    >>> track.innovation.round(6).tolist(), track.innovation_sd.round(6).tolist()
    ([0.009889], [0.002867])
    >>> round(track.estimate["stroke_offset"], 6)
    0.126189
    """

    def __init__(
        self,
        names: Sequence[str],
        *,
        walk_variance: npt.ArrayLike,
        noise_variance: npt.ArrayLike,
        units: Sequence[str] = (),
        prior: Estimate | None = None,
    ) -> None:
        self._names, self._units = checks.unique("names", names), tuple(units)
        self._walk = _variances("walk_variance", walk_variance, len(self._names))
        self._noise = _variances("noise_variance", noise_variance, len(self._names))
        if np.any((self._walk == 0) & (self._noise == 0)):
            raise ValueError("walk_variance and noise_variance must not both be 0; got 0 and 0")
        self._one_noise = np.ndim(noise_variance) == 0
        self._prior = None if prior is None else _checked(prior, self._names)
        self.reset()

    def reset(self) -> None:
        """Return to the prior."""
        size = len(self._names)
        self._value, self._covariance, self._known = self._start()
        self._unit, self._gain, self._count = np.eye(size), np.zeros(size), 0
        self._innovation, self._innovation_sd = np.full(size, np.nan), np.full(size, np.inf)

    def _start(self) -> tuple[Floats, Floats, Bools]:
        """Values before the first update, their covariance, and which are known."""
        size, prior = len(self._names), self._prior
        if prior is None:
            return np.zeros(size), np.zeros((size, size)), np.zeros(size, dtype=bool)
        known = np.isfinite(np.diag(prior.covariance))
        covariance = np.where(np.outer(known, known), prior.covariance, 0.0)
        return np.where(known, prior.value, 0.0), covariance, known

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it: the filter before its first update.

        Readings of each value; of a combination (`row`) where a prior knows several values and the noise
        variance is one number.
        """
        from sdpgrind.identify._recipe import Names, walk_recipe

        value, covariance, known = self._start()
        of_row = value.size > 1 and self._one_noise and self._noise[0] > 0 and bool(known.all())
        state = np.concatenate([value, covariance.ravel(), known])
        return walk_recipe(Names(self._names, self._units), self._walk, self._noise, state, of_row)

    @property
    def count(self) -> int:
        """Number of updates, with or without a reading."""
        return self._count

    @property
    def innovation(self) -> Floats:
        """Reading minus prediction at the last update; (p,), or (1,) with a row, in the reading's unit.

        NaN: no reading, or no prediction.
        """
        return self._innovation.copy()

    @property
    def innovation_sd(self) -> Floats:
        """Standard deviation of `innovation` under the model, same shape and unit. inf: no prediction."""
        return self._innovation_sd.copy()

    def update(self, reading: npt.ArrayLike, row: npt.ArrayLike | None = None) -> None:
        """Let the values walk one step, then correct them by the reading.

        Parameters
        ----------
        reading : array_like, shape (p,), or float
            Reading of each value, or with `row` of the combination, in its own unit. NaN: no reading.
        row : array_like, shape (p,), optional
            ``reading = row @ value + noise``.

        Raises
        ------
        ValueError
            For a wrong shape, an infinite reading, or a row without a prior or without noise.
        """
        readings = np.array(reading, dtype=float, ndmin=1)
        rows = self._unit if row is None else self._row(row)
        if readings.shape != rows.shape[:1] or np.isinf(readings).any():
            raise checks.refuse("reading", f"finite or NaN, of shape {rows.shape[:1]}", readings.tolist())
        innovation, sd = np.empty(readings.size), np.empty(readings.size)
        noise = self._noise[: readings.size]
        walk_step(
            self._value,
            self._covariance,
            self._known,
            self._walk,
            readings,
            rows,
            noise,
            innovation,
            sd,
            self._gain,
        )
        self._innovation, self._innovation_sd = innovation, sd
        self._count += 1

    def _row(self, row: npt.ArrayLike) -> Floats:
        checked = checks.finite_array("row", row)
        if checked.shape != (len(self._names),):
            raise ValueError(f"row must be of shape {(len(self._names),)}; got {checked.shape}")
        if not self._known.all():
            raise checks.refuse("prior", "given, with finite variances, where rows are read", self._prior)
        if not self._one_noise or self._noise[0] == 0:
            raise checks.refuse("noise_variance", "one number > 0 where rows are read", self._noise.tolist())
        return checked[None]

    @property
    def estimate(self) -> Estimate:
        """Values after the last update, with their covariance; `Status.UNDETERMINED` until each is read."""
        status = Status.OK if self._known.all() else Status.UNDETERMINED
        endless = np.diag(np.where(self._known, 0.0, np.inf))
        return Estimate(self._names, self._value, self._covariance + endless, status, units=self._units)


def _checked(prior: Estimate, names: tuple[str, ...]) -> Estimate:
    """Return a prior of these values, with variances."""
    if checks.kind("prior", prior, Estimate).names != names:
        raise checks.refuse("prior", f"an estimate of {', '.join(names)}", ", ".join(prior.names))
    variance = np.diag(prior.covariance)
    if not np.all(variance >= 0):
        raise checks.refuse("variances of the prior", ">= 0", variance.tolist())
    return prior


def _variances(name: str, value: npt.ArrayLike, size: int) -> Floats:
    """One variance for each value."""
    given = checks.finite_array(name, value)
    if given.shape not in ((), (size,)):
        raise ValueError(f"{name} must be a number or of shape {(size,)}; got shape {given.shape}")
    if np.any(given < 0):
        raise checks.refuse(name, ">= 0", float(given.min()))
    return np.full(size, given)


def random_walk_gain(walk_variance: float, noise_variance: float) -> float:
    """Return the steady Kalman gain of the one-value `RandomWalk`, unit 1.

    ``K = P/(P + R)`` with ``P = (Q + sqrt(Q^2 + 4 Q R))/2``, the steady state of Mears (4.36)-(4.39).

    Parameters
    ----------
    walk_variance : float
        Variance of the step between two readings, Q >= 0, squared unit of the reading.
    noise_variance : float
        Variance of the noise of a reading, R >= 0, same unit; not both are 0.

    Returns
    -------
    float
        Gain in [0, 1], unit 1.

    Raises
    ------
    ValueError
        For a negative variance, or two that are 0.

    Examples
    --------
    Of the simulation, Mears (4.47), and of the prototype (in µm^2):

    >>> round(random_walk_gain(0.0005, 0.03), 6), round(random_walk_gain(0.005**2, 0.03**2), 6)
    (0.121035, 0.153355)
    """
    walk = checks.nonnegative("walk_variance", walk_variance)
    noise = checks.nonnegative("noise_variance", noise_variance)
    if walk == 0 and noise == 0:
        raise ValueError("walk_variance and noise_variance must not both be 0; got 0 and 0")
    variance = 0.5 * (walk + sqrt(walk * walk + 4 * walk * noise))
    return variance / (variance + noise)


def random_walk_response(gain: float, step: npt.ArrayLike) -> Complex:
    """Return the frequency response of the steady one-value `RandomWalk`.

    Parameters
    ----------
    gain : float
        Steady gain in (0, 1], unit 1: `random_walk_gain`.
    step : array_like
        Phase of the wave from one reading to the next, rad: undulations per revolution times the interval.

    Returns
    -------
    complex or array, shape of `step`
        ``K/(1 - (1 - K) exp(-i step))``, unit 1. A negative angle is a lag.

    Raises
    ------
    ValueError
        For a gain out of range, or steps that are not finite.

    Examples
    --------
    At 1 degree a reading: the -0.9 % of Mears, Table 4.4, with a lag of 7.2 degrees:

    >>> response = random_walk_response(random_walk_gain(0.0005, 0.03), np.deg2rad(1.0))
    >>> np.round([100 * (abs(response) - 1), np.rad2deg(np.angle(response))], 4).tolist()
    [-0.9015, -7.2153]
    """
    share = checks.share("gain", gain, "1")
    return np.asarray(share / (1 - (1 - share) * np.exp(-1j * checks.finite_array("step", step, "rad"))))[()]
