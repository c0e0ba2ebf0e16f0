"""Smallest form of a policy's tables that loses no more than asked."""

from collections.abc import Mapping
from decimal import ROUND_CEILING, Context
from functools import partial
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.progress import Progress, portion, silent
from sdpgrind.sdp._policy.small_tables import PRECISIONS, Small, small_of
from sdpgrind.sdp._policy.value_lost import ValueLost, value_lost_within

_HALVES = (0.0, 0.5, 0.75, 1.0)  # chosen: shares at which a form begins; most often the first one does
_TOLD_DIGITS = 3  # chosen: significant digits of a value lost in a message


def small_tables(
    policy: Any,
    precision: str,
    lost_max: float | None,
    told: tuple[str, ...] = (),
    tell: Progress = silent,
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
    tell : callable(share, text)
        Progress of what is computed of the value lost.

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
    within = np.inf if lost_max is None else lost_max
    known: dict[str, float] = {}
    for k, form in enumerate(forms):
        small = small_of(policy, form, told)
        # one between the smallest and the finest loses about what the finest does: not followed to its end
        most = within if form in forms[1:-1] else np.inf
        share = portion(tell, *_HALVES[k : k + 2]) if len(forms) > 1 else tell
        lost = value_lost_within(policy, small.control, most, partial(_told_of, share, form))
        if lost is None:
            continue
        known[form] = lost.all_stages
        if np.isfinite(lost.all_stages) and lost.all_stages <= within:
            return small, {"precision": form, "lost": _noted(lost, policy)}
    if lost_max is None:
        raise checks.refuse("precision", "one with which the actions end", precision)
    raise checks.refuse("lost_max", _least(known), lost_max, "$")


def _told_of(tell: Progress, form: str, share: float) -> None:
    """Tell how far the value lost by a form is known."""
    tell(share, f"value lost by tables in {form}")


def _least(lost: Mapping[str, float]) -> str:
    """Return what may be asked for: the least that forms lose, $; unrounded actions lose by the search."""
    best = min(lost, key=lambda form: lost[form])
    rule = f">= {_up(lost[best]):.3g}, what {best}, the best of the forms, loses"
    if "double" not in lost:
        return rule
    return (
        f"{rule} (double loses {_up(lost['double']):.3g}: the plan's own error of its search between levels)"
    )


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
