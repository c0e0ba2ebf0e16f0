"""Weld beads: penalty, deepest place, height, time; what passes took against what they were asked for."""

from typing import Any

import numpy as np

from hwsim._report.statistics import mean
from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Interval

CHARGED = ("penalty", "overground_worst", "height", "passes", "time", "lateness", "stalls", "burned")


def planned(log: Any, plan: Any) -> dict[str, Interval | Floats]:
    """Return what a `SequencePolicy` promises: penalty ($), passes."""
    outcome = log.outcome
    found: dict[str, Interval | Floats] = {}
    if "penalty_planned" in outcome:
        expected, error = outcome.penalty_planned.values, None if plan is None else plan.error
        found["penalty"] = expected if error is None else Interval(float(expected.mean()), float(error))
    start = _start(log)
    if plan is not None and start is not None:
        risk = plan.risk(height=start[0], time_left=start[1])
        found["passes"] = Interval(float(risk.passes), float(risk.error["passes"]))
        if plan.problem.bead_scatter is not None:  # the plan's own value counts each pass as of another bead
            found["penalty"] = Interval(float(risk.mean), float(risk.error["mean"]))
    return found


def _start(log: Any) -> tuple[float, float] | None:
    attrs = log.outcome.attrs
    known = "start_height" in attrs and "start_time" in attrs
    return (float(attrs["start_height"]), float(attrs["start_time"])) if known else None


def reasons(log: Any, plan: Any) -> dict[str, str]:
    """Return reasons for differences, by outcome."""
    outcome = log.outcome
    left = float(np.nanmean(outcome.height.values))
    found = {
        "penalty": f"beads end {left:.3g} mm above the target on average",
        "passes": "time runs out first",
    }
    if told := _passes(log):
        found["penalty"] += f"; {told}"
        found["passes"] = told
    return found


def _passes(log: Any) -> str:
    """Depth asked for and taken, and what the planner of passes left, in words; "": there is no such tier."""
    if "pass" not in log.tiers:
        return ""
    table, cuts = log["pass"], log.outcome.true_cut_depth.values
    made, parts = np.isfinite(cuts).sum(axis=1), table.part.values
    rows = np.concatenate([np.flatnonzero(parts == k)[: made[k]] for k in range(len(log))])
    wanted = table.mean_cut.values[rows]
    missing = mean(wanted - cuts[np.isfinite(cuts)])
    short = float(np.nansum(table.shortfall_planned.values[rows]))
    share = 100 * short / (short + float(np.nansum(table.volume_planned.values[rows])))
    fed, feed = (float(np.nanmean(table[n].values[rows])) for n in ("feed_rate_command", "planned_feed"))
    return (
        f"on average a pass was asked for {wanted.mean():.3g} mm and took {missing.value:.2g} ± "
        f"{missing.half:.1g} mm less, as its planner left {share:.2g} % of the volume at the limits of "
        f"force and power; what a pass leaves, the next makes up for; planned feed {feed:.4g}, realised "
        f"{fed:.4g} mm/s"
    )
