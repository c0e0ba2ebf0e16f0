"""What a judged state of the streaming estimator tells: the fields of an estimate."""

from math import exp, expm1, inf, log
from typing import Any

import numpy as np
from scipy.optimize import brentq

from centering.circle._estimator import slots as at
from centering.circle._fit.estimate import CircleEstimate, reach
from sdpgrind.base.checks import Floats
from sdpgrind.identify import Status


def scale_of(state: Floats) -> tuple[float, float]:
    """Sd of a reading, not below the noise that was given, and the degrees of freedom with which it makes the band."""
    sd, freedom, least = float(state[at.SCALE]), float(state[at.SCALE_FREEDOM]) or inf, float(state[at.NOISE])
    if sd >= least or not np.isfinite(sd):
        return sd, freedom
    share, joint, wanted = -expm1(state[at.BEYOND]), bool(state[at.JOINT]), float(state[at.REACH]) / least
    if wanted <= reach(share, 1e9, joint) or freedom < 1:
        return least, inf if freedom >= 1 else freedom
    return least, exp(brentq(lambda n: reach(share, exp(n), joint) - wanted, 0.0, log(1e9), xtol=1e-12))


def told_by(state: Floats, limit: str, arc: float) -> dict[str, Any]:
    """Fields of an estimate that say what it rests on."""
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
    """An estimate that knows nothing."""
    told: dict[str, Any] = {"limited_by": "samples", "arc_needed": inf} | fields
    return CircleEstimate(np.asarray(value), np.diag([inf] * 3), Status.UNDETERMINED, message, **told)
