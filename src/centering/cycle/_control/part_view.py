"""Estimate of the part on the table: readings in, centre and radius out."""

from math import atan2, hypot, inf, pi

import numpy as np

from centering.circle._estimator import printed_kernels as printed
from centering.circle._estimator import slots as at
from centering.circle._estimator.estimator import GeometryEstimator
from centering.circle._estimator.printed import PrintedEstimator
from centering.circle._estimator.validity_kernels import judge
from centering.cycle._measuring.form import RingFilter, RingPlace
from centering.cycle._measuring.rotations import FEWEST, looks
from centering.cycle._measuring.settings import CycleSettings
from sdpgrind.base.checks import Floats

_ANGLE = 2e-3  # rad, chosen: error of a reading's angle, 0.2 ms of skew at 10 rad/s
_HOLD = 20.0  # chosen: deviations of a centre within which it is believed at all
# measured: four lobes of 2 um, twenty times `form_sd`, put readings of a ring at rest up to 0.1 mm and 11 sd
# off on an arc not yet seen; from less than a seventh of a turn, where lobes look like curvature, 0.2 mm
_ROUGH, _FINE, _ARC = 3.0, 0.02, 0.15  # of the sd of the place; mm; turns
_BETTER = 0.7  # chosen: sd of an estimate over that of the place held; nearer to 1 a slow slip is taken in


class PlaceEstimator(GeometryEstimator):
    """`GeometryEstimator` that also gives the readings of the current place and an approximate centre.

    Examples
    --------
    >>> from math import cos
    >>> estimator = PlaceEstimator(noise_sd=0.001)
    >>> for k in range(20):
    ...     estimator.update(angle=0.1 * k, reading=60.0 + 0.001 * cos(0.1 * k - 1.0))
    >>> estimator.center == (estimator.estimate.center_x, estimator.estimate.center_y), estimator.used.all()
    (True, np.True_)
    """

    @property
    def center(self) -> tuple[float, float]:
        """Centre by least squares, mm."""
        judge(self._state, 0.0)
        return float(self._state[at.FIT_X]), float(self._state[at.FIT_Y])

    @property
    def refused(self) -> bool:
        """Whether the latest reading was rejected as an outlier."""
        return bool(self._state[at.IN_A_ROW] > 0.0)

    @property
    def sorted_anew(self) -> bool:
        """Whether the latest reading changed the classification of earlier ones, `used`."""
        seen = int(self._state[at.SEEN])
        return seen == at.RING or (seen < at.RING and self.restarts > 0)

    @property
    def used(self) -> Floats:
        """Which of the first 30 readings of the current place belong to the part."""
        cells = self._state[at.RING_AT : at.TAIL].reshape(at.RING, at.CELL)
        return np.asarray(cells[: int(self._state[at.SEEN]), 2] == 0.0)


class PrintedPlace(PrintedEstimator):
    """`PrintedEstimator` that only gives the place of the part.

    Examples
    --------
    >>> from math import cos
    >>> fit = PrintedPlace("prls")
    >>> for k in range(20):
    ...     fit.update(angle=0.1 * k, reading=60.0 + 0.001 * cos(0.1 * k))
    >>> [round(value, 6) for value in fit.place]  # mm
    [60.0, 0.001, 0.0]
    """

    @property
    def place(self) -> tuple[float, float, float]:
        """Radius and centre, mm."""
        state = self._state
        return float(state[printed.RADIUS]), float(state[printed.CENTER_X]), float(state[printed.CENTER_Y])


class PartView:
    """Place of the part from the readings since its last move; radius and form persist over pushes.

    Parameters
    ----------
    radius : float
        Prior radius, mm.
    settings : CycleSettings
        Probe, and prior uncertainty of radius and form (mm).
    noise_sd : float
        Prior standard deviation of a reading, mm.

    Examples
    --------
    >>> from math import cos
    >>> view = PartView(60.0, CycleSettings(tip_radius=0.0), 3e-4)
    >>> for k in range(70):
    ...     view.take(0.1 * k, 60.0 + 0.001 * cos(0.1 * k - 1.0))
    >>> view.known, round(view.offset, 5), round(view.offset_angle, 2)
    (True, 0.001, 1.0)
    """

    def __init__(self, radius: float, settings: CycleSettings, noise_sd: float) -> None:
        prior, tip = (radius, settings.radius_sd), settings.tip_radius
        self._estimator = PlaceEstimator(noise_sd=settings.noise_sd, tip_radius=tip, radius_prior=prior)
        self._tip = tip
        self._ring = RingFilter(
            *prior, settings.form_sd, max(noise_sd, settings.noise_sd), settings.angle_sd, tip
        )
        self._forget()

    def reset(self) -> None:
        """Forget the part."""
        self._estimator.reset()
        self._ring.reset()
        self._forget()

    def moved(self) -> None:
        """Forget the place of a pushed part; keep its radius and form."""
        self._estimator.reset()
        self._ring.moved()
        self._forget()

    def _forget(self) -> None:
        self.samples = self._looked = 0
        self._first = self._last = 0.0
        self.x = self.y = self.offset = self.offset_angle = 0.0
        self.sd = self.band = inf
        self._held: RingPlace | None = None  # where the ring lay when it was known well

    def take(self, angle: float, reading: float) -> None:
        """Store a reading.

        Parameters
        ----------
        angle : float
            Angle of the spindle, rad, turns counted.
        reading : float
            Distance of the rim on the push line from the axis, mm.
        """
        if self.samples == 0:
            self._first = angle
        self._estimator.update(angle=angle, reading=reading - self._ring.lobes_at(angle))
        self._ring.take(angle, reading, not self._estimator.refused)
        if self._estimator.sorted_anew:
            self._ring.use(self._estimator.used)
            self._held = None  # from readings that are sorted in another way now
        self._last = angle
        self.samples += 1
        if looks(self.samples, self._looked):
            self.look()

    def look(self) -> None:
        """Update the estimate."""
        if self.samples < FEWEST or self._looked == self.samples:
            return
        self._looked, ring = self.samples, self._ring
        ring.look(None if self.known else self._estimator.center)
        self.sd, self.band = ring.sd, ring.band
        self.x, self.y = ring.x, ring.y
        self.offset, self.offset_angle = hypot(self.x, self.y), atan2(self.y, self.x)
        self._hold()

    def _hold(self) -> None:
        """Hold the place as known now, if better than the one held: readings of a slip make it worse."""
        if self.known and self.turns > _ARC and (self._held is None or self.sd < _BETTER * self._held.sd):
            self._held = self._ring.place()

    def missed(self, angle: float, reading: float) -> tuple[float, float]:
        """Return a reading less that of the ring at the place held, and the sd of that difference, mm.

        The place held is the best one known since the last move: readings of a slipping ring cannot shift it,
        nor widen its sd, which allows for lobes of 2 um. Before there is one, the sd is inf.

        Parameters
        ----------
        angle, reading : float
            As for `take`, rad and mm.
        """
        held = self._held
        if held is None:
            return 0.0, inf
        return reading - held.reading(angle), hypot(_ROUGH * held.sd, _FINE, _ANGLE * held.offset)

    @property
    def known(self) -> bool:
        """Whether there is a centre, known better than the radius of the part."""
        return bool(self.sd * _HOLD < self.radius)

    @property
    def radius(self) -> float:
        """Current radius of the part, mm."""
        return self._ring.radius

    @property
    def rim(self) -> float:
        """Furthest rim, with the high point under the tip, mm from the axis."""
        return self.offset + self.radius + self._ring.lobes_at(self.offset_angle)

    @property
    def turns(self) -> float:
        """Turns of the table since the first reading."""
        return (self._last - self._first) / (2 * pi) if self.samples else 0.0
