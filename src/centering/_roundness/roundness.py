"""A reference circle, the roundness about it, and what proves it."""

import dataclasses
from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored

KINDS = ("LSC", "MCC", "MIC", "MZC")


@stored("centering.roundness")
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Roundness(Frozen):
    """A reference circle and the roundness about it, as `reference_circle` gives them.

    Parameters
    ----------
    kind : {"LSC", "MCC", "MIC", "MZC"}
        Which circle.
    center : array, (2,)
        Of the circle, mm, where the points are.
    radius : float
        Of the part's reference circle, mm: the tip's is taken off. For MZC the mean of the two.
    contacts : array of int, (m,)
        Points that fix the circle; none for LSC.
    outer : array of bool, (m,)
        Whether a contact lies on the outer circle.
    lower_bound : float
        mm.
    points : array, (n, 2)
        Of the profile, mm.
    tip_radius : float
        mm.
    value_sd : float, optional
        Standard deviation of `value`, mm.
    filter : str
        What the points have been through.
    certificate : str
        What is proved, and how.
    """

    kind: str
    center: Floats
    radius: float
    contacts: Any
    outer: Bools
    lower_bound: float
    points: Floats
    tip_radius: float = 0.0
    value_sd: float | None = None
    filter: str = ""
    certificate: str = ""

    def __post_init__(self) -> None:
        for name, kind in (("center", float), ("contacts", np.int64), ("outer", bool), ("points", float)):
            array = np.array(getattr(self, name), dtype=kind)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @cached_property
    def deviation(self) -> Floats:
        """Of each point from the circle, (n,), mm; positive outside."""
        return np.asarray(np.hypot(*(self.points - self.center).T) - (self.radius + self.tip_radius))

    @property
    def ron_p(self) -> float:
        """Highest peak above the circle, RONp, mm."""
        return float(self.deviation.max())

    @property
    def ron_v(self) -> float:
        """Depth of the deepest valley below the circle, RONv, mm."""
        return float(-self.deviation.min())

    @property
    def ron_q(self) -> float:
        """Root mean square deviation, RONq, mm."""
        return float(np.sqrt(np.mean(self.deviation**2)))

    @property
    def value(self) -> float:
        """Roundness RONt, mm: from the highest peak to the deepest valley."""
        return float(np.ptp(self.deviation))

    @property
    def angle(self) -> Floats:
        """Direction of each point about the circle's centre, (n,), rad."""
        across, up = (self.points - self.center).T
        return np.asarray(np.arctan2(up, across))

    @property
    def contact_angles(self) -> Floats:
        """Directions of the contacts about the circle's centre, (m,), rad."""
        return self.angle[self.contacts]
