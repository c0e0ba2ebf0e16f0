"""Smallest form of a policy's tables that loses no more than asked."""

from decimal import ROUND_CEILING, Context
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.sdp._policy.small_tables import PRECISIONS, Small, small_of
from sdpgrind.sdp._policy.value_lost import ValueLost, value_lost

_TOLD_DIGITS = 3  # chosen: significant digits of a value lost in a message


def small_tables(
    policy: Any, precision: str, lost_max: float | None, told: tuple[str, ...] = ()
) -> tuple[Small, dict[str, Any]]:
    """Return small tables of a policy, and what a manifest says of them.

    Parameters
    ----------
    policy : Policy
        Solved problem.
    precision : {"double", "float32", "int16"}
        How numbers are kept; "double" with `lost_max`: the smallest form that keeps it.
    lost_max : float, optional
        Largest value lost, $. None: any, and what tables in "double" lose is not computed.
    told : tuple of str
        "gap", "value" ($): tables beside the action.

    Raises
    ------
    ValueError
        When no form keeps `lost_max`, the value lost cannot be computed, as there is no problem, or rounded
        actions never end.
    """
    if precision == "double" and lost_max is None:
        return small_of(policy, precision, told), {"precision": precision}
    policy.need_problem("the value lost by rounding")
    forms = PRECISIONS if precision == "double" else (precision,)
    least = np.inf
    for form in forms:
        small = small_of(policy, form, told)
        lost = value_lost(policy, small.control)
        least = min(least, lost.all_stages)
        if np.isfinite(lost.all_stages) and (lost_max is None or lost.all_stages <= lost_max):
            return small, {"precision": form, "lost": _noted(lost, policy)}
    if lost_max is None:
        raise checks.refuse("precision", "one with which the actions end", precision)
    best = f">= {_up(least):.3g}, what the best of the forms {', '.join(forms)} loses"
    if forms[-1] == "double":  # what unrounded actions lose, the search between levels has lost
        best += (
            f" (double loses {_up(lost.all_stages):.3g}: the plan's own error of its search between levels)"
        )
    raise checks.refuse("lost_max", best, lost_max, "$")


def _up(number: float) -> float:
    """Return a number rounded up to the digits that are told, so that asking for it succeeds."""
    return float(Context(prec=_TOLD_DIGITS, rounding=ROUND_CEILING).create_decimal_from_float(number))


def _noted(lost: ValueLost, policy: Any) -> dict[str, Any]:
    return {
        "all_stages": lost.all_stages,
        "first_stage": lost.first_stage,
        "bound": lost.bound,
        "error": policy.error,
        "search_error": policy.search_error,
        "unit": "$",
    }
