"""What of a profile is to be separated, checked at the door."""

import dataclasses
from math import ceil

import numpy as np

from centering._roundness.part_frame import into_part
from centering._roundness.sampling import checked_degree, highest_degree, supported, turns_of, widest_gap
from centering._roundness.scan import Scan
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

INTEGER = 0.02
"""A ratio as near as that to a whole number is refused unless told."""

_CENTRED = 2e-3  # offset over radius: rad by which the phase of a roller is wrong whose radius is not known
_USUAL, _BROAD = 50, 200
_LEFT = 0.25  # of the samples: degrees of freedom that all harmonics must leave


@dataclasses.dataclass(frozen=True)
class Task:
    """What is to be separated: the ratio belongs to the tip radius where none is given, as `origin` tells; refined or kept."""

    angle: Floats
    reading: Floats
    tip_radius: float
    ratio: float | None
    upr_max: int
    refine: bool
    near_integer: bool
    turns: float
    origin: str


def task_of(scan: Scan, *, ratio: float | None, upr_max: int | None, refine: bool, near_integer: bool) -> Task:
    """What is to be separated, checked: the ratio, the harmonics, the samples."""
    angle, tip_radius = scan.angle, scan.tip_radius
    if ratio is None and tip_radius == 0:
        raise ValueError(
            "tip_radius must be > 0 (mm) to know how fast the roller turns; got 0.0: give Profile its tip_radius, or the ratio"
        )
    _refuse_offset(scan)
    turned = float(scan.circle[0]) / abs(tip_radius) if ratio is None else checks.positive("ratio", ratio, "1")
    origin = "" if ratio is not None else f" ({scan.circle[0]:.6g} mm over a tip_radius of {abs(tip_radius):.6g} mm)"
    refuse_integer(turned, origin, near_integer)
    turns = turns_of(angle)
    degree = _degree(turned, scan, angle.size / turns, upr_max)
    return Task(angle, scan.reading, tip_radius, ratio, degree, bool(refine), bool(near_integer), turns, origin)


def _degree(ratio: float, scan: Scan, points: float, upr_max: int | None) -> int:
    """The harmonics that are asked for; by default all that are sure: form that is left out would count as noise."""
    samples = scan.angle.size
    if upr_max is None:
        usual = max(min(max(_USUAL, ceil(ratio) + 10), highest_degree(points), (samples - 4) // 2), 1)
        sure = min(_sure(scan, points), _BROAD)
        return max(usual, sure) if samples - 2 * sure - 4 >= _LEFT * samples else usual
    degree = checked_degree("upr_max", upr_max, points)
    if samples < 2 * degree + 3:
        raise ValueError(
            f"reading must have at least {2 * degree + 3} samples for {degree} harmonics and the runout; got {samples}"
        )
    return degree


def _sure(scan: Scan, points: float) -> int:
    """Highest harmonic that points and gaps of a turn leave sure."""
    part_angle = into_part(scan.angle, scan.reading, scan.tip_radius, scan.circle[1:])[0]
    return min(highest_degree(points), supported(widest_gap(part_angle)))


def _refuse_offset(scan: Scan) -> None:
    """Refuse an offset ring without tip radius: the phase of a roller would be wrong by offset over radius, to and fro."""
    offset = float(np.hypot(*scan.circle[1:]))
    if scan.tip_radius == 0 and offset > _CENTRED * scan.circle[0]:
        raise ValueError(
            f"tip_radius must be > 0 (mm) for a ring that is {offset:.3g} mm off the spindle, more than {_CENTRED:g} of its"
            " radius: the roller's phase follows its centre about the part; got 0.0"
        )


def refuse_integer(ratio: float, origin: str, near_integer: bool) -> None:
    """Refuse a ratio near a whole number unless told."""
    near = round(ratio)
    if not near_integer and near >= 1 and abs(ratio - near) < INTEGER:
        raise ValueError(
            f"ratio must be at least {INTEGER:g} from a whole number; got {ratio:.6g}{origin}: runout of the roller looks like"
            f" form of {near} upr however many turns are read (near_integer=True tries all the same)"
        )
