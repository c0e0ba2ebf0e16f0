"""What a controller knows of the part on the table: readings go in, centre and radius come out."""

from math import atan2, hypot, inf, isfinite, pi

from centering._cycle.settings import CycleSettings
from centering._geometry import estimator_slots as at
from centering._geometry import printed_kernels as printed
from centering._geometry.estimator import GeometryEstimator
from centering._geometry.printed import PrintedEstimator
from centering._geometry.validity_kernels import judge

_FEWEST = 4  # readings: three fix a circle, a fourth says how well
_EVERY = 4  # readings between two looks at what they say, once there are many
_MANY = 12
_HOLD = 20.0  # deviations of a centre within which it is believed at all


class PlaceEstimator(GeometryEstimator):
    """A `GeometryEstimator` that tells where the part is without all else that an estimate says: at each sample.

    Examples
    --------
    >>> from math import cos
    >>> estimator = PlaceEstimator(noise_sd=0.001)
    >>> for k in range(20):
    ...     estimator.update(angle=0.1 * k, reading=60.0 + 0.001 * cos(0.1 * k - 1.0))
    >>> radius, x, y, sd, band = estimator.place
    >>> (x, y, sd) == (estimator.estimate.center_x, estimator.estimate.center_y, estimator.estimate.center_sd)
    True
    """

    @property
    def place(self) -> tuple[float, float, float, float, float]:
        """Radius, centre, its sd in the worst direction, and its band, mm; the latter two infinite where nothing is known."""
        state = self._state
        if state[at.USED] == 0.0:
            return 0.0, 0.0, 0.0, inf, inf
        judge(state, 0.0)
        scale = max(float(state[at.SCALE]), float(state[at.NOISE]))
        sd = scale * float(state[at.INFLATION] * state[at.SPREAD]) if isfinite(state[at.SCALE]) else inf
        return float(state[at.RADIUS]), float(state[at.FIT_X]), float(state[at.FIT_Y]), sd, float(state[at.BAND])


class PrintedPlace(PrintedEstimator):
    """A `PrintedEstimator` that tells where the part is without all else that an estimate says.

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
    """Where the part is, by the readings since it last moved; the radius stays known over pushes.

    Parameters
    ----------
    radius : float
        As it is known beforehand, mm.
    settings : CycleSettings
        Of the probe, and how well the radius is known (mm).

    Examples
    --------
    >>> from math import cos
    >>> view = PartView(60.0, CycleSettings(tip_radius=0.0))
    >>> for k in range(20):
    ...     view.take(0.1 * k, 60.0 + 0.001 * cos(0.1 * k - 1.0))
    >>> view.known, round(view.offset, 5), round(view.offset_angle, 2)
    (True, 0.001, 1.0)
    """

    def __init__(self, radius: float, settings: CycleSettings) -> None:
        self._estimator = PlaceEstimator(
            noise_sd=settings.noise_sd, tip_radius=settings.tip_radius, radius_prior=(radius, settings.radius_sd)
        )
        self._nominal = self.radius = radius
        self._forget()

    def reset(self) -> None:
        """Forget the part."""
        self._estimator.reset()
        self._forget()

    def moved(self) -> None:
        """Forget where the part is, as it is pushed; keep its radius."""
        radius = self.radius
        self._estimator.reset(keep_radius=True)
        self._forget()
        self.radius = radius

    def _forget(self) -> None:
        self.samples = 0
        self._looked = self._banded = 0
        self._first = self._last = 0.0
        self.radius = self._nominal
        self.x = self.y = self.offset = self.offset_angle = 0.0
        self.sd = self._band = inf

    def take(self, angle: float, reading: float) -> None:
        """Take a reading in.

        Parameters
        ----------
        angle : float
            Of the spindle, rad, turns counted.
        reading : float
            Of the rim on the push line, mm from the axis.
        """
        if self.samples == 0:
            self._first = angle
        self._estimator.update(angle=angle, reading=reading)
        self._last = angle
        self.samples += 1
        if self.samples >= _FEWEST and (self.samples < _MANY or self.samples - self._looked >= _EVERY):
            self.look()

    def look(self) -> None:
        """Take the estimate as it is now."""
        if self.samples < _FEWEST or self._looked == self.samples:
            return
        self._looked = self.samples
        radius, x, y, self.sd, self._band = self._estimator.place
        self._banded = self.samples
        if isfinite(self.sd):
            self.radius, self.x, self.y = radius, x, y
            self.offset, self.offset_angle = hypot(self.x, self.y), atan2(self.y, self.x)

    @property
    def known(self) -> bool:
        """Whether there is a centre at all, better known than the radius of the part."""
        return bool(self.sd * _HOLD < self.radius)

    @property
    def turns(self) -> float:
        """Turns of the table since the first reading, unit 1."""
        return (self._last - self._first) / (2 * pi) if self.samples else 0.0

    @property
    def band(self) -> float:
        """Greatest error of the centre at 99.9 %, mm."""
        if self._banded != self.samples:
            self._band, self._banded = self._estimator.band, self.samples
        return self._band

    @property
    def restarts(self) -> int:
        """How often the part was found moved."""
        return self._estimator.restarts
