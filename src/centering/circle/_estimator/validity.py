"""Limiting cause of an estimate, its sentence, and the fields of the estimate that hold the evidence."""

from math import degrees, exp, expm1, inf, isfinite, log, pi
from typing import Any

import numpy as np
from scipy.optimize import brentq

from centering.circle._estimator import slots as at
from centering.circle._estimator.forecast_kernels import turn_needed
from centering.circle._estimator.validity_kernels import holds_axis, in_doubt, may_have_moved, never_changed
from centering.circle._fit.estimate import CircleEstimate, reach
from centering.circle._fit.form import gain_of_two
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Status

_FULL = 0.97 * 2 * pi  # chosen: rad; a larger arc counts as a turn


def limited_by(state: Floats) -> str:
    """Limiting cause of a judged state, one of the estimate's `limited_by`."""
    if in_doubt(state):
        return "outliers"
    if state[at.FREEDOM] < 1:
        return "correlation" if state[at.INFLATION] > 1 and state[at.WEIGHT] - 3 >= 1 else "samples"
    if state[at.COVERED] < state[at.ARC_MIN]:
        return "arc"
    if never_changed(state) or not holds_axis(state):
        return "noise"
    band, tolerance, form = state[at.BAND], state[at.TOLERANCE], state[at.FORM_BOUND]
    if band <= tolerance:
        return "move" if may_have_moved(state) else ""
    if band - form <= tolerance:
        return "form"
    if state[at.INFLATION] > 1 and (band - form) / state[at.INFLATION] <= tolerance:
        return "correlation"
    even_turn = state[at.REACH] * (2 / state[at.WEIGHT]) ** 0.5  # the same readings, spread over a turn
    return (
        "arc"
        if state[at.COVERED] < _FULL and even_turn <= 0.7 * state[at.REACH] * state[at.SPREAD]
        else "noise"
    )


def sentence(state: Floats, limit: str, arc: float) -> str:
    """Sentence on a judged state: band, limiting cause, remedy."""
    if limit == "samples":
        return f"{int(state[at.USED])} readings are too few to tell" + _further(state, arc)
    band, tolerance = _um(state[at.BAND]), _um(state[at.TOLERANCE])
    head = f"centre within {band}, {tolerance} asked"
    if in_doubt(state):
        latest = f"{int(state[at.BAD])} of the latest {at.RING} readings disagree"
        return f"{head}, by readings before; {latest}: dust, or the part has moved"
    if limit == "noise" and not holds_axis(state):
        return "the centre lies outside the part that is found: look for bad readings or a wrong unit"
    if never_changed(state):
        return "all readings are the same: give noise_sd, which is to hold half of the probe's step"
    if limit == "move":
        after = f"after a whole turn, in {np.ceil(degrees(arc)):.0f} deg, taken for form"
        return f"{head}; readings disagree within the turn: a move (then reset) or form; {after}"
    if not limit:
        return head + _form_warning(state)
    reason = _REASONS[limit].format(**_numbers(state))
    return f"{head}; limited by {reason}{_further(state, arc)}{_form_warning(state)}"


_REASONS = {
    "arc": "the arc of {covered:.0f} deg",
    "noise": "noise of {noise} a reading",
    "correlation": "correlation from reading to reading (band times {inflation:.2g})",
    "form": "the form of the part ({form})",
}


def _numbers(state: Floats) -> dict[str, float | str]:
    return {
        "covered": degrees(state[at.COVERED]),
        "noise": _um(state[at.SCALE]),
        "inflation": float(state[at.INFLATION]),
        "form": _um(state[at.FORM_BOUND]),
    }


def _further(state: Floats, arc: float) -> str:
    if not isfinite(arc):
        return "; keep turning" if arc == inf else ""
    if arc > 0 and arc == turn_needed(state):
        return f"; a whole turn tells form from noise, after {np.ceil(degrees(arc)):.0f} deg more"
    return f"; valid after {np.ceil(degrees(arc)):.0f} deg more at this noise" if arc > 0 else ""


def _form_warning(state: Floats) -> str:
    """Warning where no form is given and less than a turn has been seen; else ""."""
    if state[at.FORMS] or state[at.KNOWN] or state[at.COVERED] >= _FULL or state[at.COVERED] <= 0:
        return ""
    gain = gain_of_two(float(state[at.COVERED]))
    return f"; no form given: lobes of 2 upr would shift the centre by up to {gain:.2g} times their amplitude"


def _um(value: float) -> str:
    return f"{1e3 * value:.3g} µm" if isfinite(value) else "no bound"


def scale_of(state: Floats) -> tuple[float, float]:
    """Standard deviation of a reading, at least the given one, and degrees of freedom of the same band."""
    sd, freedom, least = float(state[at.SCALE]), float(state[at.SCALE_FREEDOM]) or inf, float(state[at.NOISE])
    if sd >= least or not np.isfinite(sd):
        return sd, freedom
    share, joint, wanted = -expm1(state[at.BEYOND]), bool(state[at.JOINT]), float(state[at.REACH]) / least
    if wanted <= reach(share, 1e9, joint) or freedom < 1:
        return least, inf if freedom >= 1 else freedom
    return least, exp(brentq(lambda n: reach(share, exp(n), joint) - wanted, 0.0, log(1e9), xtol=1e-12))


def evidence_of(state: Floats, limit: str, arc: float) -> dict[str, Any]:
    """Fields of an estimate that hold its evidence."""
    measured = np.isfinite(state[at.FIT_NOISE]) and state[at.FREEDOM] > 0
    return {
        "samples": int(state[at.USED]),
        "swept": float(state[at.COVERED]),
        "noise_sd": float(state[at.FIT_NOISE] if measured else state[at.NOISE]),
        "inflation": float(state[at.INFLATION]),
        "form_bound": float(state[at.FORM_BOUND]),
        "limited_by": limit,
        "arc_needed": arc,
    }


def unknown(value: Any, message: str, fields: dict[str, Any]) -> CircleEstimate:
    """Estimate without information."""
    every: dict[str, Any] = {"limited_by": "samples", "arc_needed": inf} | fields
    return CircleEstimate(np.asarray(value), np.diag([inf] * 3), Status.UNDETERMINED, message, **every)
