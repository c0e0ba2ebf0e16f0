"""Finishing in the cell: time, feed, force and roughness against the motion and the model."""

from typing import Any

import numpy as np

from sdpgrind.base.sheets.amounts import Interval

CHARGED = ("force_error", "roughness_ra", "lift_off", "path_deviation", "time", "feed", "normal_force")


def planned(log: Any, plan: Any) -> dict[str, Interval]:
    """Return what motion and model promise: time (s), feed (mm/s), force (N), roughness (mm)."""
    attrs = log.outcome.attrs
    duration, force = float(attrs["motion_duration"]), attrs.get("target_force")
    exact = {"time": duration, "feed": float(attrs["path_length"]) / duration}
    if force is not None:
        exact["normal_force"] = float(force)
    if plan is not None and force is not None:
        problem = plan.problem
        settings = problem.path.pattern, problem.tool_diameter, float(force)
        if problem.model.covers(*settings):
            exact["roughness_ra"] = float(problem.model.law(*settings).mean)
    return {name: Interval(value, 0.0) for name, value in exact.items()}


def reasons(log: Any, plan: Any) -> dict[str, str]:
    """Return reasons for differences, by outcome."""
    outcome, attrs = log.outcome, log.outcome.attrs
    table = log[log.tiers[0]]
    held = 1.0 - np.nan_to_num(table.feed_override_command.values, nan=1.0)
    wait = float(held.sum() * np.median(np.diff(table.time.values))) / len(log)
    travelled = float(np.nanmean(outcome.feed.values * (outcome.time.values - outcome.touch_down.values)))
    length = float(attrs["path_length"])
    away = float(np.nanmax(outcome.path_deviation.values))
    return {
        "time": (
            f"the controller held the motion back for {wait:.3g} s a part on average, until the tool pressed"
        ),
        "feed": (
            f"the contact moved {travelled:.4g} mm on average, up to {away:.2g} mm off a path of "
            f"{length:.4g} mm"
        ),
    }
