"""Checked input of a separation of form and runout."""

import dataclasses
from math import ceil

import numpy as np

from centering.roundness._samples import Samples
from centering.roundness._sampling import checked_degree, highest_degree, supported, widest_gap
from sdpgrind.base import checks

INTEGER = 0.02  # chosen: distance from a whole number below which a ratio is refused by default
_CENTRED = 2e-3  # chosen: offset over radius; error of the phase (rad) of a roller of unknown radius
_USUAL, _BROAD = 50, 200  # chosen: default harmonics over one turn and over several, at most
_LEFT = 0.25  # chosen: least degrees of freedom over samples that all harmonics must leave


@dataclasses.dataclass(frozen=True, eq=False)
class SeparationTask:
    """Samples, ratio (None: from the tip radius, see `origin`), harmonics, and the user's flags."""

    samples: Samples
    ratio: float | None
    upr_max: int
    refine: bool
    near_integer: bool
    origin: str


def task_of(
    samples: Samples, *, ratio: float | None, upr_max: int | None, refine: bool, near_integer: bool
) -> SeparationTask:
    """Ratio, harmonics and samples of a separation, checked."""
    tip_radius = samples.tip_radius
    if ratio is None and tip_radius == 0:
        raise ValueError(
            "tip_radius must be > 0 (mm) to know how fast the roller turns; got 0.0:"
            " give Profile its tip_radius, or the ratio"
        )
    _refuse_offset(samples)
    turned = (
        float(samples.circle[0]) / abs(tip_radius) if ratio is None else checks.positive("ratio", ratio, "1")
    )
    origin = (
        ""
        if ratio is not None
        else f" ({samples.circle[0]:.6g} mm over a tip_radius of {abs(tip_radius):.6g} mm)"
    )
    refuse_integer(turned, origin, near_integer)
    degree = _degree(turned, samples, samples.angle.size / samples.turns, upr_max)
    return SeparationTask(samples, ratio, degree, bool(refine), bool(near_integer), origin)


def _degree(ratio: float, samples: Samples, points: float, upr_max: int | None) -> int:
    """Requested harmonics, by default all determined ones: form that is left out would count as noise."""
    size = samples.angle.size
    if upr_max is None:
        usual = max(min(max(_USUAL, ceil(ratio) + 10), highest_degree(points), (size - 4) // 2), 1)
        sure = min(highest_degree(points), supported(widest_gap(samples.part_angle)), _BROAD)
        return max(usual, sure) if size - 2 * sure - 4 >= _LEFT * size else usual
    degree = checked_degree("upr_max", upr_max, points)
    if size < 2 * degree + 3:
        least = 2 * degree + 3
        raise ValueError(
            f"reading must have at least {least} samples for {degree} harmonics and the runout; got {size}"
        )
    return degree


def _refuse_offset(samples: Samples) -> None:
    """Refuse an offset ring without tip radius: the roller's phase would be wrong by offset over radius."""
    offset = float(np.hypot(*samples.circle[1:]))
    if samples.tip_radius == 0 and offset > _CENTRED * samples.circle[0]:
        raise ValueError(
            f"tip_radius must be > 0 (mm) for a ring that is {offset:.3g} mm off the spindle, more than"
            f" {_CENTRED:g} of its radius: the roller's phase follows its centre about the part; got 0.0"
        )


def refuse_integer(ratio: float, origin: str, near_integer: bool) -> None:
    """Refuse a ratio near a whole number unless allowed."""
    near = round(ratio)
    if not near_integer and near >= 1 and abs(ratio - near) < INTEGER:
        raise ValueError(
            f"ratio must be at least {INTEGER:g} from a whole number; got {ratio:.6g}{origin}: runout of the"
            f" roller looks like form of {near} upr however many turns are read"
            " (near_integer=True tries all the same)"
        )
