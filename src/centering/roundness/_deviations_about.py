"""A reference circle as data, its points, and the deviations about it."""

from functools import cached_property

import numpy as np
import numpy.typing as npt

from centering.roundness._origin import MEASURED, Origin
from centering.roundness._saved_side import SavedSide
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.quantities import Described, array, custom, described, flag

KINDS = {
    "LSC": "least squares circle",
    "MCC": "minimum circumscribed circle",
    "MIC": "maximum inscribed circle",
    "MZC": "minimum zone circles",
}


@described()
class DeviationsAbout(Described, ByValue, SavedSide):
    """Points about a circle, with peaks and valleys; `Roundness` describes the fields."""

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
    origin: Origin = custom(default=MEASURED)
    internal: bool = flag(default=False)

    @cached_property
    def deviation(self) -> Floats:
        """Distance of each point from the circle, (n,), mm; positive outside. Read-only."""
        across, up = self.points[:, 0] - self.center[0], self.points[:, 1] - self.center[1]
        return lasting(np.sqrt(across * across + up * up) - (self.radius + self.tip_radius))

    def _check(self) -> None:
        object.__setattr__(self, "internal", self.internal or self.tip_radius < 0)

    @cached_property
    def _sides(self) -> tuple[float, float]:
        """Deviations of the points farthest out and in, mm; nothing lies outside MCC, nothing inside MIC."""
        out = 0.0 if self.kind == "MCC" else float(self.deviation.max())
        return out, 0.0 if self.kind == "MIC" else float(self.deviation.min())

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
        """Height of the highest peak, RONp, mm: out of the material, in a bore inside the circle.

        ISO 12181-1; 0 of MCC about a shaft and of MIC in a bore.
        """
        return -self._sides[1] + 0.0 if self.internal else self._sides[0]

    @cached_property
    def ron_v(self) -> float:
        """Depth of the deepest valley, RONv, mm: into the material, in a bore outside the circle.

        ISO 12181-1; 0 of MIC in a shaft and of MCC about a bore.
        """
        return self._sides[0] if self.internal else -self._sides[1] + 0.0

    @cached_property
    def ron_q(self) -> float:
        """Root mean square deviation from the circle, RONq, mm."""
        return float(np.sqrt(np.mean(self.deviation**2)))

    @property
    def angle(self) -> Floats:
        """Direction of each point about the circle's centre, (n,), rad, in (-pi, pi]."""
        across, up = (self.points - self.center).T
        return np.asarray(np.arctan2(up, across))

    @property
    def contact_angles(self) -> Floats:
        """Directions of the contacts about the circle's centre, (m,), rad, in (-pi, pi]."""
        return self.angle[self.contacts]
