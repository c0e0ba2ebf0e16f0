"""A reference circle, the roundness about it, and its certificate."""

from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from centering.roundness._polar import draw_circle, draw_profile, polar_axes, polar_scale
from centering.roundness._sensitivity import NoiseEffect, noise_effect
from sdpgrind.base import units
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.quantities import Described, array, custom, described

KINDS = {
    "LSC": "least squares circle",
    "MCC": "minimum circumscribed circle",
    "MIC": "maximum inscribed circle",
    "MZC": "minimum zone circles",
}


@described("centering.roundness")
class Roundness(Described, ByValue):
    """Reference circle with the roundness about it, the result of `reference_circle`.

    Parameters
    ----------
    kind : {"LSC", "MCC", "MIC", "MZC"}
        Kind of circle.
    center : array, (2,)
        Centre of the circle, mm, in the frame of the points.
    radius : float
        Radius of the part's circle, mm, without the tip; for MZC the mean of the two.
    contacts : array of int, (m,)
        Indices of the points that fix the circle; none for LSC.
    outer : array of bool, (m,)
        Whether a contact is on the outer circle: all of MCC, none of MIC, two of the four of MZC.
    bound : float
        Proved bound of the extreme length, mm. Lower: of `ron_q` (LSC, nearby), `radius` (MCC) or, within
        half the inner radius, `value` (MZC). Upper: of the `radius` of circles centred among the points
        (MIC).
    points : array, (n, 2)
        Points of the profile, mm; those of the tip's centre if there is a tip.
    tip_radius : float
        Radius of the tip, mm; negative for a bore read from within.
    noise_sd : array, (1,) or (n,)
        Standard deviation of the readings, mm, of all or each; empty if unknown.
    noise_upr : array, (m,)
        Relative amplitudes of filtered noise at 0 to m - 1 upr; empty for that of readings.
    filter : str
        Filter of the points.
    certificate : str
        Sentence on the proof.

    Examples
    --------
    >>> import numpy as np
    >>> from centering.roundness import reference_circle
    >>> angle = np.radians(np.arange(360.0))
    >>> radius = 30.0 + 0.001 * np.cos(2.0 * angle - np.pi / 3)
    >>> found = reference_circle(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]), "MZC")
    >>> found
    Roundness(MZC: RONt 2 µm about (0, 0) mm, radius 30 mm; 4 contacts)
    >>> np.degrees(found.contact_angles).round().tolist(), found.outer.tolist()
    ([30.0, 120.0, -150.0, -60.0], [True, False, True, False])
    >>> print(found.certificate)
    contacts alternate, two outer and two inner: no centre within 15 mm, half the inner radius, is better
    """

    kind: str = custom()
    center: Floats = array("mm", finite=False)
    radius: float = custom(unit="mm")
    contacts: npt.NDArray[np.int64] = array("", np.int64, finite=False)
    outer: Bools = array("", bool, finite=False)
    bound: float = custom(unit="mm")
    points: Floats = array("mm", finite=False)
    tip_radius: float = custom(unit="mm", default=0.0)
    noise_sd: Floats = array("mm", finite=False, default_factory=lambda: np.empty(0))
    noise_upr: Floats = array("", finite=False, default_factory=lambda: np.empty(0))
    filter: str = custom(default="")
    certificate: str = custom(default="")

    @cached_property
    def deviation(self) -> Floats:
        """Distance of each point from the circle, (n,), mm; positive outside. Read-only."""
        across, up = self.points[:, 0] - self.center[0], self.points[:, 1] - self.center[1]
        return lasting(np.sqrt(across * across + up * up) - (self.radius + self.tip_radius))

    @property
    def ron_t(self) -> float:
        """Roundness RONt, mm: highest peak to deepest valley."""
        return self.ron_p + self.ron_v

    @property
    def value(self) -> float:
        """Roundness RONt, mm, as `ron_t`."""
        return self.ron_t

    @property
    def offset(self) -> float:
        """Distance of the centre from the origin of the points, mm."""
        return float(np.hypot(*self.center))

    @property
    def offset_angle(self) -> float:
        """Direction of the centre from the origin of the points, rad, in (-pi, pi]."""
        return float(np.arctan2(self.center[1], self.center[0]))

    @cached_property
    def ron_p(self) -> float:
        """Height of the highest peak above the circle, RONp, mm."""
        return float(self.deviation.max())

    @cached_property
    def ron_v(self) -> float:
        """Depth of the deepest valley below the circle, RONv, mm."""
        return float(-self.deviation.min())

    @cached_property
    def ron_q(self) -> float:
        """Root mean square deviation from the circle, RONq, mm."""
        return float(np.sqrt(np.mean(self.deviation**2)))

    @property
    def value_sd(self) -> float | None:
        """Standard deviation of `value` by the noise of the readings, mm; None if that is unknown.

        By simulation of 128 profiles with added noise from a fixed seed, each with its own circle, at the
        first call. For round, oval, lobed and rough rings it is on average 0.8 to 1.3 times the result of a
        Monte-Carlo study. Infinite where most of the profiles hold no inscribed circle.
        """
        return None if self._noise_effect is None else self._noise_effect.sd

    @property
    def value_bias(self) -> float | None:
        """Increase of `value` by noise, about, mm, not subtracted from it; None if the noise is unknown.

        Noise raises the highest of many points and lowers the lowest: n readings of a perfect circle with
        noise of sd s have a `value` of about 2 s sqrt(2 ln n). The bias follows from the increase by the
        added noise of `value_sd`, as if proportional to s: true without form; up to 1.4 times too large for
        lobes, up to 2 s for rough profiles.
        """
        return None if self._noise_effect is None else self._noise_effect.bias

    @cached_property
    def _noise_effect(self) -> NoiseEffect | None:
        """Effect of noise on the value."""
        if not self.noise_sd.size:
            return None
        return noise_effect(self.kind, self.points - self.center, self.noise_sd, self.noise_upr)

    @property
    def angle(self) -> Floats:
        """Direction of each point about the circle's centre, (n,), rad, in (-pi, pi]."""
        across, up = (self.points - self.center).T
        return np.asarray(np.arctan2(up, across))

    @property
    def contact_angles(self) -> Floats:
        """Directions of the contacts about the circle's centre, (m,), rad, in (-pi, pi]."""
        return self.angle[self.contacts]

    def plot(self, ax: Any = None) -> Any:
        """Draw the profile magnified about the circle's centre, with circles and contacts; return the figure.

        A ring of the paper is a division of the scale, in µm; inner circles are dashed, contacts dots, peak
        and valley of LSC triangles.

        Parameters
        ----------
        ax : matplotlib polar axes, optional
            Axes to draw into. Default: a new figure.
        """
        scale, angle = polar_scale(self.deviation), self.angle
        ax = polar_axes(scale, self.deviation, ax)
        draw_profile(ax, scale, angle, self.deviation, color="C0")
        if self.kind in ("LSC", "MCC", "MIC"):
            draw_circle(ax, scale, color="C3", label=KINDS[self.kind])
        if self.kind != "MCC":
            draw_circle(ax, scale, self.ron_p, color="C3" if self.kind == "MZC" else "0.4")
        if self.kind != "MIC":
            draw_circle(ax, scale, -self.ron_v, color="C3" if self.kind == "MZC" else "0.4", linestyle="--")
        self._mark(ax, scale, angle)
        filtered = f", {self.filter}" if self.filter else ""
        ax.set_title(f"{self.kind}: RONt {self.value / units.um(1.0):.4g} µm{filtered}")
        return ax.figure

    def _mark(self, ax: Any, scale: Any, angle: Floats) -> None:
        """Mark the contacts, or the highest and lowest point of LSC."""
        marked = zip(self.contacts, self.outer, strict=True)
        pairs = list(marked) or [
            (int(np.argmax(self.deviation)), True),
            (int(np.argmin(self.deviation)), False),
        ]
        for point, outer in pairs:
            symbol = "o" if self.contacts.size else ("v" if outer else "^")
            style = {
                "color": "C3",
                "markerfacecolor": "C3" if outer else "white",
                "markersize": 5,
                "zorder": 4,
            }
            ax.plot(angle[point], scale.height(self.deviation[point]), symbol, **style)

    def __repr__(self) -> str:
        x, y = (np.round(self.center, 9) + 0.0).tolist()
        spread = "" if self.value_sd is None else f" ± {self.value_sd / units.um(1.0):.2g}"
        contacts = f"; {self.contacts.size} contacts" if self.contacts.size else ""
        filtered = f"; {self.filter}" if self.filter else ""
        value = f"{self.value / units.um(1.0):.4g}{spread} µm"
        place = f"about ({x:.6g}, {y:.6g}) mm, radius {self.radius:.8g} mm"
        return f"Roundness({self.kind}: RONt {value} {place}{contacts}{filtered})"
