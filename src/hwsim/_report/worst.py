"""Which part is the worst by an outcome, and why a part was broken off."""

from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats

GAVE_UP = "the controller gave up"
_ENDS = {"timed_out": "time was up", "slipped": "the table threw the part", "lost": "the part was lost"}
# outcomes of which little is bad; of all others, much is
_LEAST = ("slack", "part_slack", "feed", "removal_rate", "finished", "said_finished", "normal_force_min")
_FROM_ZERO = ("height",)  # both too much and too little is bad
_KEPT = 1e-12  # relative; chosen: rounding of a constant outcome


def worst_part(name: str, values: Floats) -> int | None:
    """Return the number of the worst part by an outcome; None: no part is worse, or it is a hidden truth."""
    if name.startswith("true_"):
        return None
    known = badness(name, values)
    finite = known[np.isfinite(known)]
    if not finite.size or np.ptp(finite) <= _KEPT * np.max(np.abs(finite)):
        return None
    return int(np.nanargmax(np.where(np.isneginf(known), np.nan, known)))


def ranked(name: str, values: Floats, count: int) -> list[int]:
    """Return the numbers of the worst parts by an outcome, worst first; of parts alike the first."""
    known = badness(name, values)
    order = np.argsort(-np.where(np.isnan(known), -np.inf, known), kind="stable")
    return [int(k) for k in order[:count] if not np.isnan(known[k])]


def mean_and_worst(name: str, values: Floats, unit: str) -> str:
    """Return the mean of an outcome over the parts, its worst value and the part that has it, in words."""
    known, number = values[np.isfinite(values)], worst_part(name, values)
    if not known.size:
        return "not known"
    if number is None:
        return f"{known[0]:.3g} {unit}" + " in every part" * (known.size > 1)
    return f"{known.mean():.3g} {unit} on average, {values[number]:.3g} {unit} in part {number}, the worst"


def badness(name: str, values: Floats) -> Floats:
    """Return a number that is greatest for the worst part; NaN: not known."""
    plain = np.asarray(values, dtype=float)
    if name in _LEAST:
        return -plain
    return np.abs(plain) if name in _FROM_ZERO else plain


def broken_off(outcome: Any, otherwise: str = GAVE_UP) -> list[str]:
    """Reason why each part was broken off, from flags of the outcome; "": it was finished."""
    told = {name: outcome[name].values != 0 for name in _ENDS if name in outcome}
    if "unfinished" in outcome:
        broken = outcome.unfinished.values != 0
    elif "said_finished" in outcome:
        broken = outcome.said_finished.values == 0
    else:
        broken = told.get("timed_out", np.zeros(outcome.sizes["part"], dtype=bool))
    reasons = [
        next((_ENDS[name] for name in told if told[name][k]), otherwise) if bad else ""
        for k, bad in enumerate(broken)
    ]
    if "aborted" in outcome:  # in a run against the clock
        for k in np.flatnonzero(outcome.aborted.values == 1):
            reasons[k] = str(outcome.abort_reason.values[k])
    return reasons


def finished(outcome: Any) -> npt.NDArray[np.bool_]:
    """Whether each part was finished."""
    return np.array([not each for each in broken_off(outcome)])
