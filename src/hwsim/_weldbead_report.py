"""What ``hwsim weldbead`` prints: the first beads, and the plan's promise beside what came of it."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from hwsim._log import Log

_SHORT = {"overground": "mean over", "overground_worst": "deepest", "penalty_planned": "planned", "penalty": "realised"}
_SHOWN = 10  # beads printed one by one
_COLUMNS = (
    ("passes", "d"), ("time", ".1f"), ("height", ".3f"), ("overground", ".4f"), ("overground_worst", ".3f"), ("lateness", ".1f"),
    ("stalls", "d"), ("penalty_planned", ".4f"), ("penalty", ".4f"),
)  # fmt: skip


def report(title: str, log: "Log", policy: Any, start: tuple[float, float]) -> str:
    """Return the whole report as text."""
    risk = policy.risk(height=start[0], time_left=start[1])
    return "\n".join([*_head(title, policy, start), "", *_beads(log), "", *_summary(log, risk)])


def _head(title: str, policy: Any, start: tuple[float, float]) -> Iterator[str]:
    yield f"{title}: beads of {start[0]:.4g} mm, {start[1]:g} s to the deadline"
    problem = policy.problem
    durations = f"{problem.durations[0]:g} ... {problem.durations[-1]:g} s"
    known = "" if policy.error is None else f"; expected penalty known to {policy.error:.0e} $"
    yield f"policy: passes of {durations}, up to {problem.force_max:g} N{known}"


def _beads(log: "Log") -> Iterator[str]:
    outcome = log.outcome
    level = "overground_worst" not in outcome  # then the height says how much is missing
    columns = [(name, form) for name, form in _COLUMNS if name in outcome and not (level and name == "overground")]
    yield "  ".join(["bead", *(f"{_heading(outcome, name):>12}" for name, _ in columns)])
    for k in range(min(len(log), _SHOWN)):
        cells = (f"{_cell(outcome[name].values[k], form):>12}" for name, form in columns)
        yield "  ".join([f"{k:4d}", *cells])
    if len(log) > _SHOWN:
        yield f" ...  ({len(log) - _SHOWN} more)"


def _cell(value: Any, form: str) -> str:
    return format(int(value) if form == "d" else float(value), form)


def _heading(outcome: Any, name: str) -> str:
    unit = outcome[name].attrs["units"]
    return _SHORT.get(name, name) if unit == "1" else f"{_SHORT.get(name, name)} {unit}"


def _summary(log: "Log", risk: Any) -> Iterator[str]:
    """Planned (the policy on its own model) against realised (the stand), with the standard error of the mean."""
    outcome = log.outcome
    planned = float(outcome.penalty_planned.values.mean())
    yield f"{'mean of ' + str(len(log)) + ' beads':<24}{'planned':>12}{'realised':>12}{'std. error':>12}"
    yield _line("penalty ($)", outcome.penalty.values, ".4f", planned)
    yield _line("passes", outcome.passes.values, ".2f", float(risk.passes))
    yield _line("height left (mm)", outcome.height.values, ".4f")
    yield _line("overground (%)", 100.0 * (outcome.height.values < 0), ".1f", 100.0 * float(risk.overground))
    yield _line("overground depth (mm)", outcome.overground.values, ".4f")
    if "overground_worst" in outcome:
        yield _line("deepest place (mm)", outcome.overground_worst.values, ".4f")
    yield _line("late (%)", 100.0 * (outcome.lateness.values > 0), ".1f")
    yield _line("time used (s)", outcome.time.values, ".1f")
    for name, words in (("burned", "burned passes"), ("stalls", "stalls")):
        if name in outcome and outcome[name].values.any():
            yield _line(words, outcome[name].values, ".2f")


def _line(name: str, values: Any, form: str, planned: float | None = None) -> str:
    error = format(values.std(ddof=1) / np.sqrt(values.size), form) if values.size > 1 else "-"
    promise = "" if planned is None else format(planned, form)
    return f"{name:<24}{promise:>12}{format(values.mean(), form):>12}{error:>12}"
