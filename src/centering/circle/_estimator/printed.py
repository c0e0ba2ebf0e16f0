"""The source's running estimators of a part's offset and its rule of validity; for comparison only."""

from math import inf, pi, sqrt
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from centering.circle._estimator import printed_kernels as kernels
from centering.circle._fit.estimate import CircleEstimate
from sdpgrind import units
from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.identify import Status

ALGORITHMS = ("rls", "prls", "kalman")
_WALK, _NOISE = units.um(0.005) ** 2, units.um(0.03) ** 2  # source: Mears, variances of the prototype, mm^2
_ROUNDING = 1e-9  # chosen: rad; smaller differences of angle are rounding


class PrintedHistory(NamedTuple):
    """Results of a `PrintedEstimator` after each reading; arrays of the shape of the readings.

    Attributes
    ----------
    radius : array
        Constant part of the fit, mm.
    offset, offset_angle : array
        Amplitude, Mears (4.8), mm, and direction in (-pi, pi], (4.9), rad.
    band : array
        Full width of the source's confidence band, mm.
    valid : array
        Whether the source's rule accepts the estimate.
    """

    radius: Floats
    offset: Floats
    offset_angle: Floats
    band: Floats
    valid: Bools


class PrintedEstimator:
    """The source's running estimate of a part's offset, with its rule of validity; for comparison only.

    ========== ===============================================================================================
    algorithm  running estimate
    ========== ===============================================================================================
    "rls"      recursive least squares of ``reading - radius`` on [cos, sin] from 0 with inverse information
               `inv_info`: Mears (4.40)-(4.44), errata corrected
    "prls"     least squares on [1, cos, sin] of all readings so far (4.45); of the first two readings the
               solution of least norm
    "kalman"   a random-walk filter (4.35)-(4.39), whose offset is half the range of its values (4.48). It
               lags and attenuates (`sdpgrind.identify.random_walk_response`), and is never valid
    ========== ===============================================================================================

    The rule "mears", (4.49)-(4.52): valid from `arc_min` on when the full width ``2 z sqrt(SSE/(m (m - 2)))``
    is at most ``max(rel_tol offset, abs_tol)``, z two-sided. This is a multiple of the standard error of a
    mean, not of the offset: the centre is inside its "99.9 %" in 1 to 90 % of all cases. All fit the
    small-offset curve. `GeometryEstimator` has neither error.

    Parameters
    ----------
    algorithm : {"rls", "prls", "kalman"}
        Running estimate.
    confidence : float
        Probability J in (0, 1).
    rel_tol, abs_tol : float
        Allowed width, the larger of two: relative to the offset (epsilon) >= 0, unit 1, and floor > 0, mm.
    arc_min : float
        Least arc, >= 0, rad.
    radius : float
        Of "rls": radius subtracted from each reading, mm.
    inv_info : float
        Of "rls": initial inverse information > 0, unit 1.
    walk_variance, noise_variance : float
        Of "kalman": Q and R >= 0, not both 0, mm^2. Default: those of the prototype.

    Raises
    ------
    ValueError, TypeError
        When a value is out of range.

    Examples
    --------
    >>> angle = np.deg2rad(np.arange(0.0, 45.0))
    >>> estimator = PrintedEstimator("prls")
    >>> for a, r in zip(angle, 61.94 + 0.5 * np.cos(angle - 1.0)):
    ...     estimator.update(angle=a, reading=r)
    >>> round(estimator.estimate.offset, 6), round(estimator.estimate.offset_angle, 6), estimator.valid
    (0.5, 1.0, True)
    """

    def __init__(
        self,
        algorithm: str = "rls",
        *,
        confidence: float = 0.999,
        rel_tol: float = 0.03,
        abs_tol: float = 0.002,
        arc_min: float = pi / 6,
        radius: float = 0.0,
        inv_info: float = 1.0,
        walk_variance: float = _WALK,
        noise_variance: float = _NOISE,
    ) -> None:
        self._algorithm = checks.one_of("algorithm", algorithm, ALGORITHMS)
        self._kind = ALGORITHMS.index(algorithm)
        self._quantile = float(ndtri(0.5 + 0.5 * checks.probability("confidence", confidence)))
        self._rel_tol = checks.nonnegative("rel_tol", rel_tol, "1")
        self._abs_tol = checks.positive("abs_tol", abs_tol, "mm")
        self._arc_min = checks.nonnegative("arc_min", arc_min, "rad")
        start = (checks.number("radius", radius, "mm"), checks.positive("inv_info", inv_info, "1"))
        variances = tuple(
            checks.nonnegative(name, value, "mm^2")
            for name, value in (("walk_variance", walk_variance), ("noise_variance", noise_variance))
        )
        if variances == (0.0, 0.0):
            raise ValueError("walk_variance and noise_variance must not both be 0 (mm^2); got 0 and 0")
        self._settings = np.array(variances if algorithm == "kalman" else start)
        self._state = np.zeros(kernels.STATES)
        self.reset()

    def reset(self) -> None:
        """Forget every reading."""
        kernels.printed_start(self._state, self._kind, self._settings)

    def update(self, *, angle: float, reading: float) -> None:
        """Take one reading.

        Parameters
        ----------
        angle, reading : float
            Spindle angle, rad, and radial position, mm.

        Raises
        ------
        ValueError
            When one is not finite.
        """
        at, seen = checks.number("angle", angle, "rad"), checks.number("reading", reading, "mm")
        kernels.printed_step(self._state, self._kind, self._settings, at, seen)

    def extend(self, angle: npt.ArrayLike, reading: npt.ArrayLike) -> None:
        """Take many readings, bit-equal to `update` one by one.

        Parameters
        ----------
        angle, reading : array_like, shape (m,)
            Spindle angles (rad) and readings (mm).

        Raises
        ------
        ValueError
            For unequal lengths, or values that are not finite.
        """
        at, seen = _pairs(angle, reading)
        for one in seen:
            outputs = np.empty((at.size, kernels.OUTPUTS))
            kernels.printed_extend(self._state, self._kind, self._settings, at, one, outputs)

    def history(self, angle: npt.ArrayLike, reading: npt.ArrayLike) -> PrintedHistory:
        """Return the results after each reading from an empty start; the estimator itself does not change.

        Parameters
        ----------
        angle, reading : array_like, shapes (m,) and (m,) or (runs, m)
            Spindle angles (rad), and readings of one part or of many, each from its own start, mm.

        Returns
        -------
        PrintedHistory
            Arrays of the shape of `reading`; mm, rad.

        Raises
        ------
        ValueError
            For unequal lengths, or values that are not finite.

        Examples
        --------
        >>> angle = np.deg2rad(np.arange(0.0, 360.0))
        >>> estimator = PrintedEstimator("kalman", walk_variance=0.0005, noise_variance=0.03)
        >>> round(100 * (float(estimator.history(angle, np.sin(angle)).offset[-1]) - 1), 2)
        -0.9
        """
        at, seen = _pairs(angle, reading)
        outputs = np.empty((*seen.shape, kernels.OUTPUTS))
        kernels.printed_histories(self._kind, self._settings, at, seen, outputs)
        return self._judged(outputs.reshape(*np.shape(reading), kernels.OUTPUTS))

    def first_valid(self, angle: npt.ArrayLike, reading: npt.ArrayLike) -> int | None:
        """Return the index of the first reading at which the rule holds, from an empty start; None: never.

        Parameters
        ----------
        angle, reading : array_like, shape (m,)
            Spindle angles (rad) and readings (mm).

        Raises
        ------
        ValueError
            For unequal lengths, or values that are not finite.
        """
        found = np.flatnonzero(self.history(angle, np.ravel(reading)).valid)
        return int(found[0]) if found.size else None

    def _judged(self, outputs: Floats) -> PrintedHistory:
        """Apply (4.8), (4.9) and the rule to the outputs of the kernels."""
        count, x, y = (outputs[..., k] for k in (kernels.COUNT, kernels.CENTER_X, kernels.CENTER_Y))
        free = np.where(count > 2, count - 2, np.nan)
        mean_variance = outputs[..., kernels.SQUARES] / (np.maximum(count, 1.0) * free)
        band = np.where(np.isnan(mean_variance), inf, 2 * self._quantile * np.sqrt(mean_variance))
        offset = np.hypot(x, y)
        turned = outputs[..., kernels.HIGH] - outputs[..., kernels.LOW] >= self._arc_min - _ROUNDING
        valid = turned & (band <= np.maximum(self._rel_tol * offset, self._abs_tol))
        return PrintedHistory(outputs[..., kernels.RADIUS], offset, np.arctan2(y, x), band, valid)

    @property
    def valid(self) -> bool:
        """Whether the rule "mears" accepts the estimate (unit 1)."""
        return bool(self._judged(self._state[: kernels.OUTPUTS]).valid)

    @property
    def band(self) -> float:
        """Full width ``2 z sqrt(SSE/(m (m - 2)))``, mm; inf before three readings and for "kalman"."""
        return float(self._judged(self._state[: kernels.OUTPUTS]).band)

    @property
    def estimate(self) -> CircleEstimate:
        """Estimate so far, mm, with (4.50) as the standard deviation of the centre in every direction.

        The radius is the constant part of the fit, not corrected by (4.22).
        """
        state, known = self._state, self._has_band
        free = float(state[kernels.COUNT]) - 2
        noise = sqrt(state[kernels.SQUARES] / free) if known else 0.0
        spread = noise**2 / state[kernels.COUNT] if known else inf
        limit, needed = self._lack
        return CircleEstimate(
            value=state[: kernels.CENTER_Y + 1],
            covariance=np.diag([0.0 if self._algorithm == "rls" else spread, spread, spread]),
            status=Status.OK if not limit else Status.UNSURE if known else Status.UNDETERMINED,
            freedom=max(free, 1.0),
            samples=int(state[kernels.COUNT]),
            swept=self._swept,
            noise_sd=noise,
            model="limacon",
            limited_by=limit,
            arc_needed=needed,
        )

    @property
    def _has_band(self) -> bool:
        """Whether the readings determine a band."""
        return self._algorithm != "kalman" and bool(self._state[kernels.COUNT] > 2)

    @property
    def _swept(self) -> float:
        """Range of the angles, rad."""
        return max(float(self._state[kernels.HIGH] - self._state[kernels.LOW]), 0.0)

    @property
    def _lack(self) -> tuple[str, float]:
        """Limiting cause and the angle still to be turned, rad: the band narrows as 1/sqrt(m)."""
        if self.valid:
            return "", 0.0
        if not self._has_band:
            return "samples", inf
        if self._swept < self._arc_min - _ROUNDING:
            return "arc", self._arc_min - self._swept
        now = self._judged(self._state[: kernels.OUTPUTS])
        times = (float(now.band) / max(self._rel_tol * float(now.offset), self._abs_tol)) ** 2
        return "noise", self._swept * (times - 1)


def _pairs(angle: npt.ArrayLike, reading: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Angles (m,) and readings (runs, m)."""
    at, seen = checks.finite_array("angle", angle, "rad"), checks.finite_array("reading", reading, "mm")
    if at.ndim != 1 or seen.ndim not in (1, 2) or seen.shape[-1] != at.size:
        raise ValueError(
            f"angle and reading must be of shape (m,) and (m,) or (runs, m); got {at.shape} and {seen.shape}"
        )
    return np.ascontiguousarray(at), np.ascontiguousarray(np.atleast_2d(seen))
