"""Sentences on RONt and its limit: measured value, value that the decision is of, interval, decision."""

from centering.roundness._circle_noise import is_mostly_noise
from centering.roundness._circle_protocol import Circle
from centering.roundness._roundness_interval import (
    ACCEPTED,
    CALIBRATED,
    NOT_DECIDED,
    RoundnessInterval,
    decided,
)
from sdpgrind.base.units import UM


def told_ront(kind: str, measured: float, ends: RoundnessInterval | None) -> str:
    """RONt (mm) as measured and without the lift of noise, which the interval is about, as text in µm.

    The guaranteed method does not know the lift: its ends alone stand beside the measured value.
    """
    told = f"RONt ({kind}) {UM * measured:.4g} µm as measured"
    if ends is None:
        return told
    lifted = f", {ends.middle} without the lift of noise" if ends.method == CALIBRATED else ""
    return f"{told}{lifted} ({ends.ends}, 95 % {ends.method})"


def ront_decision(ends: RoundnessInterval, limit: float, disagreement: str) -> str:
    """Decision on a limit (mm); none where steps of a separation do not agree."""
    return NOT_DECIDED if disagreement else decided(ends, limit)


def ront_verdict(circle: Circle, ends: RoundnessInterval | None, limit: float) -> str:
    """Sentence on a limit (mm) of RONt; where the measured value is no guide, on what the decision stands."""
    told = f"{told_ront(circle.kind, circle.ron_t, ends)}; limit {UM * limit:.4g} µm"
    if circle.origin.disagreement:
        return f"{told}: {NOT_DECIDED}, the steps do not agree"
    if ends is None:
        return f"{told}: {NOT_DECIDED}, {circle.why_no_interval}"
    found = decided(ends, limit)
    if found == NOT_DECIDED and is_mostly_noise(circle, ends):
        return f"{told}: {found}, most of the measured value is noise"
    if found == ACCEPTED and circle.ron_t > limit:
        return f"{told}: {found} after the correction for noise, as measured it is above the limit"
    return f"{told}: {found}"


def without_interval(value: float, limit: float) -> str:
    """No decision on a limit of a value (both mm) that has no interval, and which side it is on."""
    side = "within" if value <= limit else "above"
    return f"{NOT_DECIDED}, {side} the limit as measured, no interval"


def worst_above(worst: float, limit: float) -> str:
    """Sentence on a worst case of the spindle (mm) above a limit (mm) beside the verdict; else empty."""
    if worst <= limit:
        return ""
    return f"; the worst case of the spindle, {UM * worst:.4g} µm, is above the limit"
