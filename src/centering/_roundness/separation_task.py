"""What of a profile is to be separated, checked at the door."""

import dataclasses
from math import ceil

from centering._roundness.sampling import checked_degree, highest_degree, turns_of
from centering._roundness.scan import Scan
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

INTEGER = 0.02
"""A ratio as near as that to a whole number is refused unless told."""


@dataclasses.dataclass(frozen=True)
class Task:
    """What is to be separated: the ratio belongs to the tip radius where none is given; a ratio is refined or kept."""

    angle: Floats
    reading: Floats
    tip_radius: float
    ratio: float | None
    upr_max: int
    refine: bool
    near_integer: bool
    turns: float


def task_of(scan: Scan, *, ratio: float | None, upr_max: int | None, refine: bool, near_integer: bool) -> Task:
    """What is to be separated, checked: the ratio, the harmonics, the samples."""
    angle, tip_radius = scan.angle, scan.tip_radius
    if ratio is None and tip_radius == 0:
        raise ValueError(
            "tip_radius must be > 0 (mm) to know how fast the roller turns; got 0.0: give Profile its tip_radius, or the ratio"
        )
    turned = float(scan.circle[0]) / abs(tip_radius) if ratio is None else checks.positive("ratio", ratio, "1")
    refuse_integer(turned, near_integer)
    turns = turns_of(angle)
    degree = _degree(turned, angle.size, angle.size / turns, upr_max)
    return Task(angle, scan.reading, tip_radius, ratio, degree, bool(refine), bool(near_integer), turns)


def _degree(ratio: float, samples: int, points: float, upr_max: int | None) -> int:
    """The harmonics that are asked for; by default 50, or 10 beyond the runout's own place, if the samples allow that."""
    if upr_max is None:
        return max(min(max(50, ceil(ratio) + 10), highest_degree(points), (samples - 4) // 2), 1)
    degree = checked_degree("upr_max", upr_max, points)
    if samples < 2 * degree + 3:
        raise ValueError(
            f"reading must have at least {2 * degree + 3} samples for {degree} harmonics and the runout; got {samples}"
        )
    return degree


def refuse_integer(ratio: float, near_integer: bool) -> None:
    """Refuse a ratio near a whole number unless told."""
    near = round(ratio)
    if not near_integer and near >= 1 and abs(ratio - near) < INTEGER:
        raise ValueError(
            f"ratio must be at least {INTEGER:g} from a whole number; got {ratio:.6g}: runout of the roller looks like form of"
            f" {near} upr however many turns are read (near_integer=True tries all the same)"
        )
