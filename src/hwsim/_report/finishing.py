"""Finishing in the cell: time, feed, force and roughness against the motion and the model."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sdpgrind.base.sheets.amounts import Interval

_KNOWN = "zigzag"  # a pattern that each roughness model knows
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


def unknown(model: Any, pattern: str, tools: Sequence[float], forces: Sequence[float]) -> str:
    """Return what of pattern, tools (mm) and forces (N) a roughness model does not know; empty: nothing."""
    (tool, _), (force, _) = known = model.tool_diameter_range, model.normal_force_range
    found = [] if model.covers(pattern, tool, force) else [f"pattern {pattern}"]
    strange = (
        [each for each in tools if not model.covers(_KNOWN, each, force)],
        [each for each in forces if not model.covers(_KNOWN, tool, each)],
    )
    for name, unit, values, (low, high) in zip(("tool", "force"), ("mm", "N"), strange, known, strict=True):
        if values:
            each = " or ".join(f"{value:g}" for value in values)
            found.append(f"a {name} of {each} {unit} ({low:g} to {high:g} {unit})")
    return " or ".join(found)
