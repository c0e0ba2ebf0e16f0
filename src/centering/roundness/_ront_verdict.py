"""Sentences on RONt and its limit: measured value, value that the decision is of, interval, decision."""

from centering.roundness._roundness_interval import CALIBRATED, RoundnessInterval, decided
from sdpgrind.base.units import UM

NOT_DECIDED = "not decided"


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


def ront_verdict(told: str, ends: RoundnessInterval | None, limit: float, why: str, disagreement: str) -> str:
    """Sentence on a limit (mm) of RONt; `why` there is no interval, and so no decision."""
    reason = "the steps do not agree" if disagreement else why
    found = decided(ends, limit) if ends is not None and not disagreement else f"{NOT_DECIDED}, {reason}"
    return f"{told}; limit {UM * limit:.4g} µm: {found}"


def without_interval(value: float, limit: float) -> str:
    """No decision on a limit of a value (both mm) that has no interval, and which side it is on."""
    side = "within" if value <= limit else "above"
    return f"{NOT_DECIDED}, {side} the limit as measured, no interval"


def worst_above(worst: float, limit: float) -> str:
    """Sentence on a worst case of the spindle (mm) above a limit (mm) beside the verdict; else empty."""
    if worst <= limit:
        return ""
    return f"; the worst case of the spindle, {UM * worst:.4g} µm, is above the limit"
