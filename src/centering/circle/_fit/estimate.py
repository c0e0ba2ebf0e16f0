"""The estimate of a circle: radius and centre with covariance, evidence and limiting cause."""

import dataclasses
from math import atan2, cos, expm1, hypot, inf, isfinite, log1p, sin, sqrt
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri, stdtrit

from centering.circle._fit.curve import circle_reading
from centering.circle._fit.limacon import limacon_reading
from sdpgrind.base import checks, pictures
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.stored import stored
from sdpgrind.identify import Estimate

NAMES = ("radius", "center_x", "center_y")
MODELS = ("exact", "limacon", "printed")
LIMITS = ("", "samples", "arc", "noise", "correlation", "form", "outliers", "move")
KNOWN = 2.0  # chosen: least offset with a direction, in standard deviations of the centre


@stored("centering.circle")
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class CircleEstimate(Estimate, ByValue):
    """Offset circle: radius and centre with their covariance, the evidence and the limiting cause.

    Parameters
    ----------
    value : array, shape (3,)
        Radius and centre (x, y), mm.
    covariance : array, shape (3, 3)
        Covariance of the value, mm^2, inflated for correlated noise; infinite where the data do not determine
        it.
    status : Status
        Outcome of the estimation.
    message : str
        Sentence on the data. Default: that of the status.
    freedom : float
        Degrees of freedom of the covariance, unit 1; inf: the noise is known.
    names, units : tuple of str
        Names and units of the three values, always the same.
    samples : int
        Number of readings used, unit 1.
    down_weighted : int
        Number of these that a robust fit weighs by less than half as outliers, unit 1.
    swept : float
        Angle covered by the readings without gaps, rad; more than 2 pi for several turns.
    noise_sd : float
        Standard deviation of one reading about the fitted curve, mm; without form where whole turns separate
        it.
    noise_correlation : float
        As of every estimate, unit 1; here 0, as `inflation` tells it.
    inflation : float
        Factor on standard deviations by correlated noise, unit 1; the covariance includes it.
    form_bound : float
        Greatest error of the centre by form of the part, mm; added in `uncertainty`, not in standard
        deviations.
    tip_radius : float
        Radius of the probe's tip, mm; < 0 for a bore read from within.
    model : {"exact", "limacon", "printed"}
        Fitted curve; "printed" is the limacon with the radius corrected by Mears (4.22).
    limited_by : {"", "samples", "arc", "noise", "correlation", "form", "outliers", "move"}
        Limiting cause of the uncertainty; empty when it is as small as asked. "outliers": the latest readings
        disagree, by dust or because the part has moved; "move": readings within the first turn disagree, by a
        small move or by form.
    arc_needed : float
        Angle still to be turned for the uncertainty asked, rad; inf when no angle is enough.

    Raises
    ------
    ValueError
        For other names, shapes that do not agree, or an unknown model or limit.

    Examples
    --------
    >>> circle = CircleEstimate([61.94, 3.0, 4.0], np.diag([1e-6, 4e-6, 4e-6]), freedom=357.0, samples=360)
    >>> circle.offset, round(circle.offset_angle, 6), circle.center_sd
    (5.0, 0.927295, 0.002)
    >>> round(circle.uncertainty(0.999), 6), round(circle.uncertainty(0.999, joint=True), 6)
    (0.006636, 0.007506)
    """

    names: tuple[str, ...] = dataclasses.field(default=NAMES, kw_only=True)
    units: tuple[str, ...] = dataclasses.field(default=("mm", "mm", "mm"), kw_only=True)
    samples: int = dataclasses.field(default=0, kw_only=True)
    down_weighted: int = dataclasses.field(default=0, kw_only=True)
    swept: float = dataclasses.field(default=0.0, kw_only=True)
    noise_sd: float = dataclasses.field(default=0.0, kw_only=True)
    inflation: float = dataclasses.field(default=1.0, kw_only=True)
    form_bound: float = dataclasses.field(default=0.0, kw_only=True)
    tip_radius: float = dataclasses.field(default=0.0, kw_only=True)
    model: str = dataclasses.field(default="exact", kw_only=True)
    limited_by: str = dataclasses.field(default="", kw_only=True)
    arc_needed: float = dataclasses.field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.names != NAMES:
            raise checks.refuse("names", ", ".join(NAMES), self.names)
        checks.one_of("model", self.model, MODELS)
        checks.one_of("limited_by", self.limited_by, LIMITS)

    @property
    def radius(self) -> float:
        """Radius of the part, mm."""
        return float(self.value[0])

    @property
    def center_x(self) -> float:
        """Centre of the part along angle 0, mm from the spindle axis."""
        return float(self.value[1])

    @property
    def center_y(self) -> float:
        """Centre of the part along angle pi/2, mm from the spindle axis."""
        return float(self.value[2])

    @property
    def offset(self) -> float:
        """Distance of the part's centre from the spindle axis, mm, Mears (4.8)."""
        return hypot(self.value[1], self.value[2])

    @property
    def offset_angle(self) -> float:
        """Direction of the part's centre, in (-pi, pi], rad; Mears (4.9) with the quadrant kept."""
        return atan2(self.value[2], self.value[1])

    @property
    def offset_ratio(self) -> float:
        """Offset over radius, unit 1."""
        return self.offset / self.radius

    @property
    def offset_squared(self) -> float:
        """Square of the offset, corrected for its bias by noise, mm^2; may be negative for a small offset."""
        return float(self.offset**2 - self.covariance[1, 1] - self.covariance[2, 2])

    @property
    def radius_sd(self) -> float:
        """Standard deviation of the radius, mm."""
        return sqrt(self.covariance[0, 0])

    @property
    def center_sd(self) -> float:
        """Standard deviation of the centre in its worst direction, mm."""
        a, b, c = self.covariance[1, 1], self.covariance[1, 2], self.covariance[2, 2]
        if not (isfinite(a) and isfinite(c)):
            return inf
        return sqrt((a + c) / 2 + hypot((a - c) / 2, b))

    @property
    def offset_sd(self) -> float:
        """Standard deviation of the offset, mm."""
        return self._sd_along(self.offset_angle)

    @property
    def offset_angle_sd(self) -> float:
        """Standard deviation of the direction, rad; infinite without an offset."""
        across = self._sd_along(self.offset_angle + np.pi / 2)
        return across / self.offset if self.offset > 0 else inf

    def _sd_along(self, direction: float) -> float:
        """Standard deviation of the centre in a direction, mm."""
        u, v = cos(direction), sin(direction)
        a, b, c = self.covariance[1, 1], self.covariance[1, 2], self.covariance[2, 2]
        if not (isfinite(a) and isfinite(c)):
            return inf
        return sqrt(max(u * u * a + 2 * u * v * b + v * v * c, 0.0))

    @property
    def angle_known(self) -> bool:
        """Whether the offset has a direction: at least twice the standard deviation of the centre (mm)."""
        return self.offset > 0 and self.offset >= KNOWN * self.center_sd

    def uncertainty(self, confidence: float = 0.95, joint: bool = False) -> float:
        """Return the largest distance of the true centre from the estimate, mm.

        Student's t times the standard deviation of the centre in its worst direction, plus the bound on the
        part's form.

        Parameters
        ----------
        confidence : float
            Probability in (0, 1) that the true centre lies within, unit 1.
        joint : bool
            Whether it holds for both coordinates at once, by Fisher's F; else for any one direction.

        Raises
        ------
        ValueError
            For a probability outside (0, 1).
        """
        share = checks.probability("confidence", confidence)
        return reach(share, self.freedom, joint) * self.center_sd + self.form_bound

    def reading(self, angle: npt.ArrayLike) -> Floats:
        """Return the predicted reading of the probe, mm, of the shape of `angle`.

        Parameters
        ----------
        angle : array_like
            Spindle angle, rad.
        """
        if self.model == "limacon":
            return limacon_reading(angle, self.radius, self.offset, self.offset_angle)
        tip = self.tip_radius  # the path of the tip's centre is larger by it, in a bore (< 0) smaller
        return np.asarray(circle_reading(angle, self.radius + tip, self.offset, self.offset_angle) - tip)

    def plot(self, angle: npt.ArrayLike, reading: npt.ArrayLike) -> Any:
        """Draw readings, model and residuals (µm) over the spindle angle; return the figure.

        Parameters
        ----------
        angle, reading : array_like, shape (m,)
            Spindle angle, rad, and radial position of the probe, mm.

        Raises
        ------
        ValueError, TypeError
            For unequal lengths, empty arrays, or values that are not finite.
        """
        turned, line = (
            checks.finite_array("angle", angle, "rad"),
            checks.finite_array("reading", reading, "mm"),
        )
        if turned.ndim != 1 or line.shape != turned.shape or not turned.size:
            shapes = f"{turned.shape} and {line.shape}"
            raise ValueError(f"angle and reading must be one-dimensional of one length; got shapes {shapes}")
        return pictures.drawn("centering.circle._fit.picture:plot_fit", self, turned, line)

    def __repr__(self) -> str:
        angle = (
            f"{self.offset_angle:.6g} ± {self.offset_angle_sd:.2g} rad" if self.angle_known else "not known"
        )
        return (
            f"CircleEstimate(radius = {self.radius:.7g} ± {self.radius_sd:.2g} mm,"
            f" offset = {self.offset:.6g} ± {self.offset_sd:.2g} mm, offset_angle = {angle},"
            f" from {self.samples} readings; {self.message})"
        )


def reach(share: float, freedom: float, joint: bool) -> float:
    """Quantile of the centre in standard deviations: Student's t, or sqrt(2 F) with 2 and `freedom`."""
    if joint:
        beyond = -log1p(-share)
        return sqrt(freedom * expm1(2 * beyond / freedom)) if isfinite(freedom) else sqrt(2 * beyond)
    return float(stdtrit(freedom, (1 + share) / 2) if isfinite(freedom) else ndtri((1 + share) / 2))
