"""Plunge grinding: time, slack of damage, roundness; what the margins and the last infeed rate explain."""

from typing import Any

import numpy as np

from hwsim._report.worst import finished, mean_and_worst
from sdpgrind.base.sheets.amounts import Interval
from sdpgrind.base.units import UM

CHARGED = ("time", "part_slack", "roundness", "burned", "out_of_round")
MEANINGS = {
    "reserve": "logarithm of the temperature of damage over the greatest that the finished surface saw; below"
    " 0 it is burned",
    "severity": "that greatest temperature over the one of damage; above 1 the finished surface is burned",
    "severity_reading": "severity as the inspection reads it",
}


def planned(log: Any, plan: Any) -> dict[str, Interval]:
    """Return what a `CyclePlan` promises: time (s), slack and roundness (mm)."""
    if plan is None:
        return {}
    slack, roundness = Interval(plan.safety_margin, 0.0), Interval(plan.roundness, 0.0)
    return {"time": Interval(plan.time, plan.error), "part_slack": slack, "roundness": roundness}


def reasons(log: Any, plan: Any) -> dict[str, str]:
    """Return reasons for differences, by outcome."""
    outcome = log.outcome
    slack = np.where(finished(outcome), UM * outcome.part_slack.values, np.nan)
    least = mean_and_worst("part_slack", slack, "µm")
    margin = f"{UM * plan.safety_margin:.2g} µm were planned"
    kept = f"the least distance between damage and size was {least}, where {margin}"
    time = outcome.time.values
    found = f"{kept}{_reading(plan.problem)}"
    learns = (log.made_of or {}).get("adapt") is not None
    if learns and len(log) > 1:
        found += f"; {time[0]:.4g} s in the first part, before it had learned, {time[1:].mean():.4g} s after"
    return {"time": found, "part_slack": kept, "roundness": _last_rate(log, plan)}


def _reading(problem: Any) -> str:
    """What the controller reads, and what stays in doubt during a part."""
    if problem.model.linear_time_constant is None:
        return ", and reads size and power with noise"
    sharpness, deflection = problem.uncertainty.sharpness_sd, problem.uncertainty.deflection_sd
    return (
        ": where the lag is linear the controller reads the size alone, and sharpness and deflection stay"
        f" known to {sharpness:.3g} and {deflection:.3g} of their value (standard deviations)"
    )


def _last_rate(log: Any, plan: Any) -> str:
    table = log[log.tiers[0]]
    rates = table.infeed_rate_planned.values
    last = [rates[rows][np.isfinite(rates[rows])][-1:] for rows in _rows(table.part.values)]
    found, wanted = float(np.mean(np.concatenate(last))), float(plan.trajectory.infeed_rate[-1])
    rates = f"{UM * found:.3g} µm/s on average by the controller, {UM * wanted:.3g} µm/s by the plan"
    return f"the infeed rate at the end was {rates}"


def _rows(parts: Any) -> list[Any]:
    return [np.flatnonzero(parts == part) for part in np.unique(parts)]
