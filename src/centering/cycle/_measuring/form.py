"""Estimate of a ring with its form: lobes resemble an offset until enough of the rim was measured."""

from dataclasses import dataclass
from math import cos, hypot, inf, isfinite, pi, sin, sqrt

import numpy as np
from scipy.special import stdtrit

from centering.circle._estimator import slots
from centering.circle._estimator.noise_kernels import correlation
from centering.cycle._measuring.form_kernels import SIZE, forget_center, lobes_at, residuals, solve
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen

_KEPT = 256  # chosen: stored readings; of a slow table they are thinned, so that they span a turn
_FREEDOM = 10.0  # chosen: degrees of freedom of the prior noise
_CHANGED = 1.15  # chosen: ratio of the noise that triggers a new solution
_SHARE = 0.9995  # derived: quantile of a two-sided 99.9 % interval
_LOBES = np.diag([0.0] * 3 + [1.0] * (SIZE - 3))


@dataclass(frozen=True)
class RingPlace(Frozen):
    """Place and form of a ring as they were known at one time, from `RingFilter.place`.

    Parameters
    ----------
    value : array
        Centre, radius less the nominal one, cosine and sine of each lobe, mm.
    nominal, tip_radius : float
        Nominal radius of the surface, and radius of the probe's roller, mm.
    sd : float
        Standard deviation of the centre, mm.

    Examples
    --------
    >>> place = RingPlace(np.array([1.0, 0.0, 0.05] + [0.0] * 12), 60.0, 0.0, 1e-4)
    >>> place.reading(0.0), place.offset  # mm
    (61.05, 1.0)
    """

    value: Floats
    nominal: float
    tip_radius: float
    sd: float

    @property
    def offset(self) -> float:
        """Distance of the centre from the axis, mm."""
        return hypot(self.value[0], self.value[1])

    def reading(self, angle: float) -> float:
        """Return the reading of the ring (mm) at an angle of the spindle (rad)."""
        x, y, radius = (float(value) for value in self.value[:3])
        along, across = x * cos(angle) + y * sin(angle), y * cos(angle) - x * sin(angle)
        rolled = self.nominal + radius + self.tip_radius
        rim = sqrt(max(rolled**2 - across**2, 0.0)) - self.tip_radius
        return along + rim + float(lobes_at(angle, self.value, self.nominal + self.tip_radius))


class RingFilter:
    """Centre, radius and lobes of a ring from all readings: a push makes the centre new, the rest persists.

    Lobes of 2 to 7 undulations have unknown amplitudes: their effect on the centre of a short arc is part of
    its standard deviation, which falls as more of the rim is measured. Large lobes raise the expected
    amplitude of the lobes that are still unknown. Lobes turn with the table.

    Parameters
    ----------
    radius, radius_sd : float
        Prior radius of the surface and its standard deviation, mm.
    form_sd : float
        Least prior standard deviation of each lobe's cosine and sine, mm.
    noise_sd : float
        Prior standard deviation of a reading, mm.
    angle_sd : float
        Standard deviation of the angle of a reading, rad.
    tip_radius : float
        Radius of the probe's roller, mm.

    Examples
    --------
    >>> from math import cos
    >>> ring = RingFilter(60.0, 0.05, 0.003, 3e-4, 0.0, 0.0)
    >>> for k in range(70):
    ...     ring.take(0.1 * k, 60.0 + 0.001 * cos(0.1 * k - 1.0) + 0.002 * cos(0.2 * k), True)
    >>> ring.look((0.0, 0.0))
    >>> round(hypot(ring.x, ring.y), 5), round(ring.lobes_at(0.0), 5)  # mm
    (0.001, 0.002)
    """

    def __init__(
        self,
        radius: float,
        radius_sd: float,
        form_sd: float,
        noise_sd: float,
        angle_sd: float,
        tip_radius: float,
    ) -> None:
        self._nominal, self._tip = radius, tip_radius
        self._noise, self._turning = noise_sd, angle_sd / noise_sd
        self._radius_sd, self._least_form = radius_sd, form_sd
        self._matrix, self._vector = np.zeros((SIZE, SIZE)), np.zeros(SIZE)
        self._rows = np.zeros((_KEPT, 3))
        self.reset()

    def reset(self) -> None:
        """Forget the ring."""
        self._known, self._told, self._value = np.zeros((SIZE, SIZE)), np.zeros(SIZE), np.zeros(SIZE)
        self._known[2, 2] = 1.0 / self._radius_sd**2
        self._form = self._least_form
        self._squares, self._freedom = _FREEDOM * self._noise**2, _FREEDOM
        self._forget_readings()

    def _forget_readings(self) -> None:
        self._count = self._looked = 0
        self._own = (0.0, 0.0)  # squares (mm^2) and degrees of freedom of the readings that are kept
        self.x = self.y = 0.0
        self.sd = self.band = inf

    def moved(self) -> None:
        """Begin a new place after a push; radius and lobes persist."""
        if self._looked:
            forget_center(self._matrix - self._assumed, self._vector, self._known, self._told)
            self._squares, self._freedom = self._squares + self._own[0], self._freedom + self._own[1]
        self._value[:2] = 0.0
        self._forget_readings()

    def take(self, angle: float, reading: float, used: bool) -> None:
        """Store a reading: angle of the spindle, rad, and rim, mm; `used` may change later."""
        if self._count == _KEPT:
            dropped = self._superfluous()
            self._rows[dropped:-1] = self._rows[dropped + 1 :].copy()
            self._count -= 1
        self._rows[self._count] = angle, reading + self._tip, used
        self._count += 1

    def _superfluous(self) -> int:
        """Stored reading that is missed least: the oldest if the others span a turn, else the densest.

        Lobes pass for an offset while less than a turn is known. The latest readings may be sorted anew.
        """
        angles = self._rows[: _KEPT - slots.RING, 0]
        if self._rows[-1, 0] - angles[1] >= 2.0 * pi:
            return 0
        return 1 + int(np.argmin(angles[2:] - angles[:-2]))

    def use(self, used: Floats) -> None:
        """Set which of the latest readings are used; older ones are not."""
        latest = self._rows[self._count - used.size : self._count].copy()
        latest[:, 2] = used
        self._count = used.size
        self._rows[: self._count] = latest

    def look(self, near: tuple[float, float] | None = None) -> None:
        """Update the estimate; the first one after a push starts at `near` (mm)."""
        if near is not None:
            self._value[:2] = near
        self._looked = self._count
        noise = self.noise_sd
        covariance, inflation = self._solved(noise)
        if not 1.0 / _CHANGED < self.noise_sd / noise < _CHANGED:
            covariance, inflation = self._solved(self.noise_sd)
        squares = self._value[3:] ** 2 + covariance.diagonal()[3:]
        self._form = max(self._least_form, sqrt(float(squares.sum()) / squares.size))
        self.x, self.y = float(self._value[0]), float(self._value[1])
        (a, b), (_, c) = covariance[:2, :2].tolist()
        self.sd = inflation * sqrt(0.5 * (a + c) + hypot(0.5 * (a - c), b)) if isfinite(a + c) else inf
        self.band = float(stdtrit(self._freedom + self._own[1] / inflation**2, _SHARE)) * self.sd

    @property
    def _prior(self) -> Floats:
        """Prior information on the lobes, 1/mm^2."""
        return _LOBES * (1.0 / self._form**2)

    @property
    def noise_sd(self) -> float:
        """Current standard deviation of a reading, mm."""
        return sqrt((self._squares + self._own[0]) / (self._freedom + self._own[1]))

    def _solved(self, noise: float) -> tuple[Floats, float]:
        """Covariance of the values for a noise (mm), corrected for correlation; stores values and squares."""
        rows = self._rows[: self._count]
        angles, readings = np.ascontiguousarray(rows[rows[:, 2] > 0.0, :2].T)
        ring = self._value, self._nominal + self._tip, self._turning
        self._assumed = self._prior  # as it is in the equations, whatever is made of the form after
        known = self._known + self._assumed
        covariance = solve(angles, readings, *ring, noise, known, self._told, self._matrix, self._vector)
        squares, lagged = residuals(angles, readings, *ring)
        explained = SIZE - float((covariance * known).sum())
        self._own = squares, max(angles.size - explained, 0.0)
        rho = correlation(squares, float(angles.size), lagged) if squares > 0.0 and angles.size > 4 else 0.0
        return covariance, sqrt((1.0 + rho) / (1.0 - rho))

    @property
    def radius(self) -> float:
        """Radius of the mean circle, mm."""
        return self._nominal + float(self._value[2])

    def lobes_at(self, angle: float) -> float:
        """Return the contribution of the lobes to a reading (mm) at an angle of the spindle (rad)."""
        return float(lobes_at(angle, self._value, self._nominal + self._tip))

    def place(self) -> RingPlace:
        """Return place and form as they are known now."""
        return RingPlace(self._value.copy(), self._nominal, self._tip, self.sd)
