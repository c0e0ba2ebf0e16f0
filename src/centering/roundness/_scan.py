"""Readings over angle and height: of sections, a helix, or lines along a part."""

import dataclasses
from math import copysign

import numpy as np
import numpy.typing as npt

from centering.circle._fit.arguments import readings
from centering.roundness._part_frame import tip_centers
from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue, lasting
from sdpgrind.base.checks import Floats


@dataclasses.dataclass(frozen=True, eq=False)
class PathScan(ByValue):
    """Angle (rad), height and reading (mm) of points of one part, tip radius (mm) and flag of a bore."""

    angle: Floats
    height: Floats
    reading: Floats
    tip_radius: float
    internal: bool

    @property
    def tip(self) -> float:
        """Distance of the tip's centre beyond the surface, mm; negative in a bore."""
        return copysign(self.tip_radius, -1.0 if self.internal else 1.0)

    @property
    def points(self) -> Floats:
        """Centres of the tip about the spindle axis and heights, (n, 3), mm."""
        return np.column_stack([tip_centers(self.angle, self.reading, self.tip), self.height])


def scan_of(
    angle: npt.ArrayLike, height: npt.ArrayLike, reading: npt.ArrayLike, tip_radius: float, internal: bool
) -> PathScan:
    """Return readings along any path, checked."""
    turned, read = readings(angle, reading)
    level = checks.finite_array("height", height, "mm")
    if level.shape != read.shape:
        raise ValueError(f"height must be one for each of {read.size} readings (mm); got {level.shape}")
    refuse_one_height("height", level)
    tip, bore = checks.nonnegative("tip_radius", tip_radius, "mm"), checks.kind("internal", internal, bool)
    return PathScan(lasting(turned), lasting(level), lasting(read), tip, bore)


def refuse_one_height(name: str, height: Floats) -> None:
    """Refuse heights (mm) that are all equal: they fix no axis."""
    if np.ptp(height) == 0:
        raise checks.refuse(name, "different: one height fixes no axis", float(height.flat[0]), "mm")
