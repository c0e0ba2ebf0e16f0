"""Stage coordinates that a table answers, as range and words for an export."""

from sdpgrind.sdp._policy.table import Solution

_EARLIEST = -1e9  # chosen: in the unit of the stages; beyond what any is late


def stage_told(policy: Solution) -> tuple[tuple[float, float], str]:
    """Return range of the stage coordinate (unit of the stages: s), and what its negative values are."""
    layout, count = policy.layout, policy.countdown
    lowest = count.lowest * layout.step
    low = _EARLIEST if count.has_base else lowest
    told = "< 0: late" if low < 0.0 else ""
    if lowest < 0.0:  # slices of late stages are not interpolated
        told += f", from {lowest:g} on in whole stages of {layout.step:g} {layout.stage_unit}".rstrip()
        told += ", others are refused (-1)"
    return (low, layout.count * layout.step), told
