"""Centering: time, pushes and offset against the strategy, for the same offsets at the start."""

from typing import Any

import numpy as np
import numpy.typing as npt

from hwsim._report.statistics import mean
from hwsim._report.worst import finished
from sdpgrind.base.checks import Floats
from sdpgrind.base.sheets.amounts import Interval
from sdpgrind.base.units import UM

CHARGED = ("time", "offset", "pushes", "peak_force")
_RUNS = 400  # simulated parts; chosen: means to 5 % of the scatter


def planned(log: Any, plan: Any) -> dict[str, Interval | Floats]:
    """Return what a `Strategy` promises: time (s), pushes, offset (mm)."""
    if plan is None:
        return {}
    found = _simulated(log, plan)
    pushes, offset = (np.asarray(each, dtype=float) for each in (found.pushes, found.offset))
    return {"time": _expected(log, plan), "pushes": mean(pushes), "offset": mean(offset)}


def _simulated(log: Any, plan: Any) -> Any:
    """Parts centred on the plan's own model, from the offsets of the log."""
    return plan.simulate(runs=_RUNS, rng=0, start=np.resize(_start(log, plan), _RUNS))


def _expected(log: Any, plan: Any) -> Floats:
    """Expected time of each part, s."""
    return np.array([plan.cycle_time(float(offset)) for offset in _start(log, plan)])


def _start(log: Any, plan: Any) -> Any:
    """Offset of each part at the start, mm, within the plan."""
    outcome = log.outcome
    offset = np.hypot(outcome.center_x.values[:, 0], outcome.center_y.values[:, 0])
    return np.clip(offset, 0.0, plan.problem.offset_max)


def reasons(log: Any, plan: Any) -> dict[str, str]:
    """Return reasons for differences, by outcome; of the parts that were finished, as their means are."""
    done = np.flatnonzero(finished(log.outcome))
    if not done.size:
        return {}
    model, outcome = _simulated(log, plan), log.outcome.isel(part=done)
    friction = _friction(outcome, plan)
    found = {
        "time": [_legs(log, plan, model, done), friction],
        "pushes": [friction],
        "offset": [_accepted(outcome, plan, model), friction],
    }
    return {name: "; ".join(filter(None, told)) for name, told in found.items()}


def _friction(outcome: Any, plan: Any) -> str:
    """Friction realised and planned; "": alike in the digits that are told."""
    true, believed = f"{outcome.true_mu_kinetic.values.mean():.3g}", f"{plan.problem.model.mu_kinetic:.3g}"
    return "" if true == believed else f"friction was {true} on average, {believed} is planned"


def _legs(log: Any, plan: Any, model: Any, done: npt.NDArray[np.intp]) -> str:
    """Where the time of parts goes, realised and planned: up to the first push, between, after the last."""
    before, after = (each[done] for each in _around(log))
    between = float(np.mean(log.outcome.time.values[done] - before - after))
    first = float(np.mean([plan.start_time(float(offset)) for offset in _start(log, plan)[done]]))
    last = float(np.mean(np.nan_to_num(model.last)))
    rest = float(np.mean(_expected(log, plan)[done])) - first - last
    return (
        f"{np.mean(before):.3f} s up to the first push (planned {first:.3f}), {between:.3f} s from push"
        f" to push ({rest:.3f}), {np.mean(after):.3f} s after the last one ({last:.3f}); realised"
        " pushes begin with the tip, planned ones with the offset under the tip, some 0.1 s later"
    )


def _around(log: Any) -> tuple[Floats, Floats]:
    """Time up to the first push and from the begin of the last one on, s; without a push all before."""
    table, ends = log[log.tiers[0]], log.outcome.time.values
    part, time, pushing = (np.asarray(table[name].values) for name in ("part", "time", "pushing"))
    begins = (pushing > 0) & ~((np.roll(pushing, 1) > 0) & (np.roll(part, 1) == part))
    before, after = np.array(ends, dtype=float), np.zeros(ends.size)
    for k in range(ends.size):
        pushed = time[begins & (part == k)]
        if pushed.size:
            before[k], after[k] = pushed[0], ends[k] - pushed[-1]
    return before, after


def _accepted(outcome: Any, plan: Any, model: Any) -> str:
    """Share of parts that ended beyond what the plan pushes again, and mean offset of the others."""
    told = []
    for offset in (outcome.offset.values, model.offset):
        near = offset <= plan.finish
        told += [100.0 * float(np.mean(~near)), UM * float(np.mean(offset[near])) if near.any() else np.nan]
    share, offset, planned_share, planned_offset = told
    return (
        f"{share:.1f} % of the parts ended above {UM * plan.finish:.3g} µm (planned {planned_share:.1f} %),"
        " where the plan pushes again and the controller ends as soon as it is certain of the tolerance;"
        f" the others ended at {offset:.3f} µm on average ({planned_offset:.3f})"
    )
