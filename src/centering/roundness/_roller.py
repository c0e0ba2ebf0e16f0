"""The runout of the probe's roller: amplitude, phase and ratio with their uncertainty, and slip."""

from math import hypot, sqrt

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, array, custom, described
from sdpgrind.base.results import Result

SURE = 1e-3  # chosen: probability of a false slip
SEEN = 2.448  # derived: sqrt(2 ln 20), standard deviations that 5 % of Rayleigh amplitudes of noise exceed


@described("centering.runout")
class RollerError(Described, ByValue, Result):
    """Runout of the roller over part angle: ``cosine cos(ratio part_angle) + sine sin(ratio part_angle)``.

    A roller of radius rho on a part of radius R turns R/rho times as fast, Mears (6.19): its phase follows
    the arc along the part, at any offset.

    Parameters
    ----------
    value : array, shape (3,)
        Cosine and sine parts in mm, and the ratio, unit 1.
    covariance : array, shape (3, 3)
        Covariance of the value, in products of these units; 0 in the row of a given ratio.
    tip_radius : float
        Rolling radius of the roller, mm: the part's radius over the ratio.
    condition : float
        Condition of the least-squares separation of runout and form, unit 1: largest growth of reading
        errors.
    turns : float
        Turns covered by the readings, unit 1.
    upr_max : int
        Highest harmonic of the part in the fit, upr.
    noise_sd : float
        Standard deviation of one reading about form and runout, mm.
    slip : float
        Slip of the roller along the part, mm: spread of its phase over pieces of a turn.
    slip_probability : float
        Probability of as much spread by noise alone, unit 1; uniform without slip, 1 where the turns do not
        show it.

    Examples
    --------
    >>> runout = RollerError([1.2e-3, 0.9e-3, 16.517], np.diag([1e-11, 1e-11, 1e-8]), tip_radius=3.7501)
    >>> round(runout.amplitude, 6), round(runout.phase, 4), round(runout.tip_radius_sd, 6)
    (0.0015, 0.6435, 2.3e-05)
    """

    value: Floats = array("", finite=False)
    covariance: Floats = array("", finite=False)
    tip_radius: float = custom(unit="mm", default=0.0)
    condition: float = custom(unit="1", default=1.0)
    turns: float = custom(unit="1", default=0.0)
    upr_max: int = custom(unit="upr", default=0)
    noise_sd: float = custom(unit="mm", default=0.0)
    slip: float = custom(unit="mm", default=0.0)
    slip_probability: float = custom(unit="1", default=1.0)

    @property
    def ratio(self) -> float:
        """Turns of the roller for one of the part, unit 1."""
        return float(self.value[2])

    @property
    def ratio_sd(self) -> float:
        """Standard deviation of the ratio, unit 1; 0 for a given ratio."""
        return sqrt(self.covariance[2, 2])

    @property
    def amplitude(self) -> float:
        """Amplitude, mm: half of the runout from peak to peak."""
        return hypot(self.value[0], self.value[1])

    @property
    def amplitude_sd(self) -> float:
        """Standard deviation of the amplitude, mm."""
        return self._sd(np.array([np.cos(self.phase), np.sin(self.phase)]))

    @property
    def seen(self) -> bool:
        """Whether the amplitude (mm) is significant: noise exceeds it in less than one profile of 20."""
        return self.amplitude > SEEN * self.amplitude_sd

    @property
    def phase(self) -> float:
        """Phase at part angle 0, rad: the runout is ``amplitude cos(ratio part_angle - phase)``."""
        return float(np.arctan2(self.value[1], self.value[0]))

    @property
    def phase_sd(self) -> float:
        """Standard deviation of the phase, rad; infinite without runout."""
        across = self._sd(np.array([-np.sin(self.phase), np.cos(self.phase)]))
        return across / self.amplitude if self.amplitude > 0 else np.inf

    def _sd(self, direction: Floats) -> float:
        """Standard deviation of the amplitude vector in a direction, mm."""
        with np.errstate(invalid="ignore"):
            variance = float(direction @ self.covariance[:2, :2] @ direction)
        return sqrt(max(variance, 0.0)) if np.isfinite(variance) else np.inf

    @property
    def tip_radius_sd(self) -> float:
        """Standard deviation of the rolling radius, mm; 0 for a given ratio."""
        return self.tip_radius * self.ratio_sd / self.ratio

    @property
    def slipped(self) -> bool:
        """Whether the phase (rad) spreads more than by noise in one profile of a thousand."""
        return self.slip_probability < SURE

    def deviation(self, part_angle: npt.ArrayLike) -> Floats:
        """Return the runout, mm, of the shape of `part_angle`.

        Parameters
        ----------
        part_angle : array_like
            Angle about the part's centre, continuous over the turns, rad.
        """
        turned = self.ratio * checks.finite_array("part_angle", part_angle, "rad")
        return np.asarray(self.value[0] * np.cos(turned) + self.value[1] * np.sin(turned))

    def derivatives(self, part_angle: Floats) -> Floats:
        """Return the derivatives of the runout by its three values, shape (n, 3): 1, 1 and mm.

        Parameters
        ----------
        part_angle : array, shape (n,)
            Angle about the part's centre, rad.
        """
        turned = self.ratio * part_angle
        cosine, sine = np.cos(turned), np.sin(turned)
        return np.column_stack([cosine, sine, part_angle * (self.value[1] * cosine - self.value[0] * sine)])

    def __repr__(self) -> str:
        slipped = f", SLIPPED by {self.slip:.2g} mm" if self.slipped else ""
        return (
            f"RollerError({1e3 * self.amplitude:.4g} ± {1e3 * self.amplitude_sd:.2g} µm"
            f" at {self.ratio:.7g} ± {self.ratio_sd:.2g} upr,"
            f" tip radius {self.tip_radius:.6g} ± {self.tip_radius_sd:.2g} mm;"
            f" condition {self.condition:.3g}{slipped})"
        )
