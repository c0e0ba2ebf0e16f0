"""Figures of a policy on its page."""

from typing import Any

import numpy as np

from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable

_HEIGHTS = 6  # heights in the table; chosen: a glance shows where the duration changes


def first_passes(policy: Any) -> AmountTable:
    """Return the first pass of a `SequencePolicy` for a few heights, with all the time of the plan left."""
    left = policy.problem.horizon
    heights = np.linspace(0.0, policy.problem.height_max, _HEIGHTS + 1)[1:]
    found = [policy.action(float(height), left) for height in heights]
    columns = (
        Amounts.of("height", heights, "mm"),
        Amounts.of("duration", [action.duration for action in found], "s"),
        Amounts.of("normal_force", [action.normal_force for action in found], "N"),
        Amounts.of("mean_cut", [action.mean_cut for action in found], "mm"),
        Amounts.of(
            "value", [policy.value(float(height), left) for height in heights], "$", "expected penalty"
        ),
    )
    known = "not known" if policy.error is None else f"{policy.error:.1g} ${policy.told_away}"
    return AmountTable(f"First pass with {left:g} s left (error of the penalty {known})", columns)
