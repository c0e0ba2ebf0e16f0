"""Centering: time, pushes and offset against the strategy, for the same offsets at the start."""

from typing import Any

import numpy as np

from hwsim._report.statistics import mean
from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Interval

CHARGED = ("time", "offset", "pushes", "peak_force")
_RUNS = 400  # simulated parts; chosen: means to 5 % of the scatter


def planned(log: Any, plan: Any) -> dict[str, Interval | Floats]:
    """Return what a `Strategy` promises: time (s), pushes, offset (mm)."""
    if plan is None:
        return {}
    start = _start(log, plan)
    found = plan.simulate(runs=_RUNS, rng=0, start=np.resize(start, _RUNS))
    expected = np.array([plan.cycle_time(float(offset)) for offset in start])
    pushes, offset = (np.asarray(each, dtype=float) for each in (found.pushes, found.offset))
    return {"time": expected, "pushes": mean(pushes), "offset": mean(offset)}


def _start(log: Any, plan: Any) -> Any:
    """Offset of each part at the start, mm, within the plan."""
    outcome = log.outcome
    offset = np.hypot(outcome.center_x.values[:, 0], outcome.center_y.values[:, 0])
    return np.clip(offset, 0.0, plan.problem.offset_max)


def reasons(log: Any, plan: Any) -> dict[str, str]:
    """Return reasons for differences, by outcome."""
    outcome = log.outcome
    mu, believed = float(outcome.true_mu_kinetic.values.mean()), plan.problem.model.mu_kinetic
    pushes = float(outcome.pushes.values.mean())
    text = f"{pushes:.3g} pushes a part; friction was {mu:.3g} on average, {believed:.3g} is planned"
    return {"time": text, "pushes": f"friction was {mu:.3g} on average, {believed:.3g} is planned"}
