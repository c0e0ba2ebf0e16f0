"""Doubts about a weld bead: process and scatter against the readings of passes."""

from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base.doubts.advice import to_plan_with
from sdpgrind.base.doubts.assumed import reader_of
from sdpgrind.base.doubts.record import Doubts
from sdpgrind.base.doubts.rows import Doubt, compared, complete, untold
from sdpgrind.base.tables import table_of
from sdpgrind.weldbead._doubts import cost, passes
from sdpgrind.weldbead._identify.attribution import ScatterEstimate
from sdpgrind.weldbead._identify.identify import identify
from sdpgrind.weldbead.sequence._problem import SequenceProblem

_FACT = "the drawing or the machine; no column shows it"
_HINTS = {
    "specific_energy": "the columns grinding_power and removal_rate",
    "idle_power": "the columns grinding_power and removal_rate",
    "friction_ratio": "the columns normal_force and tangential_force",
    "relative_sd": "the columns normal_force, feed_rate and cut_depth",
    "speed_droop": "the speed of the disc under load",
    "free_speed": "the speed of the disc without load",
    **dict.fromkeys(("disk_radius", "bead_width"), _FACT),
}
_COLUMNS = {
    "power": ("grinding_power", "removal_rate"),
    "friction": ("normal_force", "tangential_force"),
    "scatter": ("normal_force", "feed_rate", "cut_depth"),
}
_CALLS = {
    "power": 'weldbead.identify(log, "power")',
    "friction": 'weldbead.identify(log, "friction")',
    "scatter": 'weldbead.identify(log, "scatter", model=problem.model)',
}
_FEWEST = 4  # derived: two coefficients and a scatter about them


def doubts(problem: SequenceProblem, data: Any) -> Doubts:
    """Compare a problem with passes; see `SequenceProblem.doubts`."""
    table, _ = table_of(data, "sequence")
    there = [what for what, names in _COLUMNS.items() if all(_held(table, name) for name in names)]
    if not there:
        raise ValueError(
            "data must hold grinding_power and removal_rate, normal_force and tangential_force, or"
            f" normal_force, feed_rate and cut_depth; they hold {', '.join(map(str, table))}"
        )
    found, sentences = [], passes.checks_of(problem, table)
    model = problem.model
    taken: list[Any] = []  # what the calls below take over
    if "power" in there:
        power = identify(table, "power", throw=False)
        found += [
            compared(power, name, getattr(model, name), scale=_scale(problem, name)) for name in power.names
        ]
        sentences += [*passes.of_power(problem, table), *_warned(power)]
        taken += [power] * power.ok
    if "friction" in there:
        friction = identify(table, "friction", throw=False)
        found.append(compared(friction, "friction_ratio", model.friction_ratio))
        sentences += _warned(friction)
        taken += [friction] * friction.ok
    row, words = _untold_scatter(problem), list[str]()
    if "scatter" in there:
        row, words, scatter = _scatter(problem, table)
        taken += [scatter] * row.measured
    every = complete([*found, row], model, _HINTS)
    words += to_plan_with(_CALLS[what] for what in there if what != "scatter" or row.measured)
    reader = reader_of(data, table)
    figure, stakes = cost.of_plan(problem, every, taken)
    return Doubts(_subject(table), (*every, *reader.rows), [*sentences, *words], None, figure, stakes)


def _warned(estimate: idf.Estimate) -> list[str]:
    """What the estimate says beside its origin, as that its interval is too short."""
    told = estimate.message.partition("; ")[2]
    return [f"{' and '.join(estimate.names)}: {told}."] if estimate.ok and told else []


def _held(table: Any, name: str) -> bool:
    return name in table or f"{name}_command" in table


def _scale(problem: SequenceProblem, name: str) -> float:
    """Size against which the error of a coefficient is small or not: an idle power may be 0."""
    return float(problem.model.grinding_power(problem.force_max)) if name == "idle_power" else 0.0


def _untold_scatter(problem: SequenceProblem, why: str = "") -> Doubt:
    return untold("relative_sd", "1", float(problem.scatter.total), why or _HINTS["relative_sd"])


def _scatter(problem: SequenceProblem, table: Any) -> tuple[Doubt, list[str], ScatterEstimate | None]:
    """Row of the scatter under its believed attribution, a sentence on the favoured one, the estimate."""
    scatter = problem.scatter
    try:
        found = identify(table, "scatter", model=problem.model)
    except ValueError as error:
        return _untold_scatter(problem, str(error)), [], None
    name = scatter.attribution
    if not isinstance(name, str):
        return _untold_scatter(problem, "several coefficients scatter, and passes tell only one"), [], None
    spread = found.standard_error[found.names.index(name)]
    told = idf.Estimate(("relative_sd",), np.array([found[name]]), np.array([[spread**2]]), units=("1",))
    row = compared(told, "relative_sd", float(scatter.total), note=f"if {name} scatters")
    return row, _attributed(found, name), found


def _attributed(found: ScatterEstimate, believed: str) -> list[str]:
    if believed in found.plausible:
        others = [name for name in found.plausible if name != believed]
        if not others or found.distinguishable:
            return []
        return [
            f"That {believed} scatters is plausible, and so is {', '.join(others)}: more passes at several"
            " forces and feeds would tell."
        ]
    return [f"The depths scatter as if {found.favoured} did, not {believed}."]


def _subject(table: Any) -> str:
    first = next(table[name] for names in _COLUMNS.values() for name in names if name in table)
    return f"weld bead, {np.size(first)} passes"
