"""Grinding along the locus: time and removal rate against the best point of each wheel."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from hwsim._report.worst import finished, mean_and_worst
from sdpgrind.base.brief import listed
from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Interval
from sdpgrind.base.units import UM

CHARGED = ("time", "slack", "removal_rate", "convergence_time", "burned")
_MOST = 5  # chosen: numbers of parts that fit a line


def planned(log: Any, plan: Any) -> dict[str, Interval | Floats]:
    """Return what `best_point` gives, and the margin (W) of the controller, the slack that it plans."""
    margin = _margin(log)
    kept = {} if margin is None else {"slack": Interval(margin, 0.0)}
    return {**best_point(log, plan), **kept}


def best_point(log: Any, plan: Any) -> dict[str, Floats]:
    """Return time (s) and removal rate (mm^3/s) at the best point of each part's true wheel."""
    best = _best(log)
    if best is None:
        return {}
    found = {"time": float(log.outcome.attrs["stock"]) / best}
    if plan is not None:
        model = plan.problem.model
        wheel = getattr(model, "grinding", model)  # of a dressed wheel
        across = np.pi * wheel.work_diameter * wheel.width
        found["removal_rate"] = across * best
    return found


def _margin(log: Any) -> float | None:
    """Margin of the controller to the burn limit, W; None: there is none, or the log does not hold it."""
    margin = getattr((log.made_of or {}).get("controller"), "margin", None)
    return float(margin) if isinstance(margin, int | float) else None


def _best(log: Any) -> Any:
    """Best infeed rate of each part, mm/s, in the middle of its course; None: not in the log."""
    return (
        np.nanmedian(log.outcome.best_infeed_rate.values, axis=1)
        if "best_infeed_rate" in log.outcome
        else None
    )


def events(log: Any) -> Iterator[str]:
    """Yield a sentence on the parts after which the wheel was dressed: its wear flats grow otherwise."""
    outcome = log.outcome
    if "true_wear_flat_area" not in outcome or "dressing_lead" in outcome:  # with a lead: before each part
        return
    dressed = np.flatnonzero(np.diff(outcome.true_wear_flat_area.values) < 0)
    if dressed.size:
        more = [f"{dressed.size - _MOST} more"] if dressed.size > _MOST else []
        told = listed([*map(str, dressed[:_MOST].tolist()), *more])
        yield f"the wheel was dressed after {'part' if dressed.size == 1 else 'parts'} {told}"


def reasons(log: Any, plan: Any) -> dict[str, str]:
    """Return reasons for differences, by outcome."""
    done = finished(log.outcome)
    if not done.any():
        return {}
    outcome = log.outcome.isel(part=np.flatnonzero(done))
    reached = log.outcome.convergence_time.values
    known = np.flatnonzero(done & np.isfinite(reached))
    slow = "the controller begins below the best point"
    if known.size:
        first = f"part {known[0]} after {reached[known[0]]:.3g} s"
        slow += f", reaches it after {reached[known].mean():.3g} s on average ({first})"
    true = float(np.nanmean(outcome.true_infeed_rate.values))
    best = float(np.nanmean(outcome.best_infeed_rate.values))
    rates = f"mean infeed rate {UM * true:.3g} µm/s, best {UM * best:.3g} µm/s"
    told_apart = _margin(log) is not None  # as a figure of its own
    text = f"{slow}: {rates}" if told_apart else f"{slow}: {rates}; {_kept(log)}"
    return {"time": text, "removal_rate": text, "slack": _kept(log)}


def _kept(log: Any) -> str:
    """Least slack of the parts, and the margin that was planned, in words."""
    slack = np.where(finished(log.outcome), log.outcome.slack.values, np.nan)
    margin = _margin(log)
    of = "" if margin is None else f", where {margin:.3g} W were planned"
    return f"the least distance to burning was {mean_and_worst('slack', slack, 'W')}{of}"
