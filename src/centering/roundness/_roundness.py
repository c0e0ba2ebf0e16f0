"""A reference circle, the roundness about it, and what proves it."""

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
    """A reference circle and the roundness about it, as `reference_circle` gives them.

    Parameters
    ----------
    kind : {"LSC", "MCC", "MIC", "MZC"}
        Which circle.
    center : array, (2,)
        Centre of the circle, mm, in the frame of the points.
    radius : float
        Radius of the part's circle, mm; that of the tip is taken off. For MZC the mean of the two.
    contacts : array of int, (m,)
        Which points fix the circle; none for LSC.
    outer : array of bool, (m,)
        Whether a contact lies on the outer circle: all of MCC, none of MIC, two of the four of MZC.
    bound : float
        What is proved of the length that the circle makes extreme, mm. From below: no centre has a smaller `ron_q` (LSC, nearby),
        `radius` (MCC) or, within half the inner radius, `value` (MZC). From above: none among the points has a larger `radius`
        (MIC).
    points : array, (n, 2)
        Points of the profile, mm; those of the tip's centre where there is a tip.
    tip_radius : float
        Radius of the tip, mm; less than 0 where a bore was read from within.
    noise_sd : array, (1,) or (n,)
        Standard deviation of the readings, mm, of all or each; empty where it was not given.
    noise_upr : array, (m,)
        Amplitudes of the undulations 0 to m - 1 of noise that has been through a filter, to scale; empty for that of readings.
    filter : str
        What the points have been through.
    certificate : str
        What is proved, and by what.

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
    def value(self) -> float:
        """Roundness RONt, mm: from the highest peak to the deepest valley."""
        return self.ron_p + self.ron_v

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
        """Standard deviation of `value`, mm, that the noise of the readings makes; None where that was not given.

        By simulation from a fixed seed, as contacts that noise swaps do not follow a linear law: 128 profiles with noise on top,
        each with its own circle; it takes as long as these when it is first asked for. Of round, oval, lobed and rough rings it
        is on average within 0.8 to 1.3 times what a Monte-Carlo study of the true form shows. Infinite where most of the
        profiles hold no inscribed circle.
        """
        return None if self._noise_effect is None else self._noise_effect.sd

    @property
    def value_bias(self) -> float | None:
        """By how much noise has widened `value`, about, mm; None where noise was not given. It is not taken off.

        Noise lifts the highest of many points and lowers the lowest: of n readings of a perfect circle with noise of sd s,
        `value` is about 2 s sqrt(2 ln n). How much the noise on top of `value_sd` adds tells what the first has added, as if that
        grew with s: so it does without form; of lobes it is told up to 1.4 times too large, of rough profiles up to 2 s. One
        estimate of it is as unsure as `value` is.
        """
        return None if self._noise_effect is None else self._noise_effect.bias

    @cached_property
    def _noise_effect(self) -> NoiseEffect | None:
        """What noise does to the value."""
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
        """Draw the profile about the circle's centre, magnified, with the circles and their contacts; return the figure.

        One ring of the paper is a division of the scale, in µm; inner circles are dashed, contacts dots. The peak and the
        valley of LSC are marked by triangles.

        Parameters
        ----------
        ax : matplotlib polar axes, optional
            Where; by default in a new figure.
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
        """Mark contacts, or the highest and lowest point where there are none."""
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
        told = f"; {self.contacts.size} contacts" if self.contacts.size else ""
        filtered = f"; {self.filter}" if self.filter else ""
        value = f"{self.value / units.um(1.0):.4g}{spread} µm"
        return f"Roundness({self.kind}: RONt {value} about ({x:.6g}, {y:.6g}) mm, radius {self.radius:.8g} mm{told}{filtered})"
