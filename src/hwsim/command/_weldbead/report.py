"""Report of ``hwsim weldbead``: the first beads, and the plan's prediction next to the outcome."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._report.worst import broken_off
from hwsim.command._report import broken_lines, parts_table, summary_head, summary_line

if TYPE_CHECKING:
    from hwsim._log.log import Log

_SHORT = {
    "overground": "mean over",
    "overground_worst": "deepest",
    "penalty_planned": "planned",
    "penalty": "realised",
}
_COLUMNS = (
    ("passes", "d"), ("time", ".1f"), ("height", ".3f"), ("overground", ".4f"), ("overground_worst", ".3f"),
    ("lateness", ".1f"), ("stalls", "d"), ("penalty_planned", ".4f"), ("penalty", ".4f"),
)  # fmt: skip


def report(
    title: str, log: "Log", policy: Any, start: tuple[float, float], assumed: tuple[str, ...] = ()
) -> str:
    """Return the whole report as text; `assumed`: which of height (mm) and time (s) nobody told."""
    risk = policy.risk(height=start[0], time_left=start[1])
    why = broken_off(log.outcome)
    ended = np.array([not each for each in why])
    beads = [
        *_head(title, policy, start, assumed),
        "",
        *_beads(log, why),
        "",
        summary_head(int(ended.sum()), len(log), "bead"),
    ]
    outcome = log.outcome.isel(part=ended)
    if policy.problem.bead_scatter is None:
        planned = float(outcome.penalty_planned.values.mean()) if ended.any() else None
        return "\n".join([*beads, *_summary(outcome, risk, planned), *broken_lines(why, "bead")])
    # the plan's own value counts each pass as one of another bead
    told = [*_summary(outcome, risk, float(risk.mean)), *broken_lines(why, "bead"), _learned(risk)]
    return "\n".join([*beads, *told])


def _head(title: str, policy: Any, start: tuple[float, float], assumed: tuple[str, ...]) -> Iterator[str]:
    known = f" ({' and '.join(assumed)} assumed, as no [stand] tells)" if assumed else ""
    yield f"{title}: beads of {start[0]:.4g} mm, {start[1]:g} s to the deadline{known}"
    problem = policy.problem
    durations = f"{problem.durations[0]:g} ... {problem.durations[-1]:g} s"
    error = "" if policy.error is None else f"{policy.error:.0e} ${policy.told_away}"
    known = error and f"; expected penalty known to {error}"
    yield f"policy: passes of {durations}, up to {problem.force_max:g} N{known}"


def _beads(log: "Log", why: list[str]) -> Iterator[str]:
    outcome = log.outcome
    level = "overground_worst" not in outcome  # level beads: the height says how much is missing
    columns = [
        (name, form) for name, form in _COLUMNS if name in outcome and not (level and name == "overground")
    ]
    return parts_table(log, "bead", columns, _SHORT, why)


def _summary(outcome: Any, risk: Any, planned: float | None) -> Iterator[str]:
    if not outcome.sizes["part"]:
        return
    yield summary_line("penalty ($)", outcome.penalty.values, ".4f", planned)
    yield summary_line("passes", outcome.passes.values, ".2f", float(risk.passes))
    yield summary_line("height left (mm)", outcome.height.values, ".4f")
    level = "overground_worst" not in outcome
    below = 100.0 * (outcome.height.values < 0)
    name = "overground (%)" if level else "mean overground (%)"
    yield summary_line(name, below, ".1f", 100.0 * float(risk.overground))
    if not level:
        yield summary_line("overground in places (%)", 100.0 * (outcome.overground.values > 0), ".1f")
    yield summary_line("overground depth (mm)", outcome.overground.values, ".4f")
    if not level:
        yield summary_line("deepest place (mm)", outcome.overground_worst.values, ".4f")
    yield summary_line("late (%)", 100.0 * (outcome.lateness.values > 0), ".1f")
    yield summary_line("time used (s)", outcome.time.values, ".1f")
    for name, words in (("burned", "burned passes"), ("stalls", "stalls")):
        if name in outcome and outcome[name].values.any():
            yield summary_line(words, outcome[name].values, ".2f")


def _learned(risk: Any) -> str:
    """What learning the bead saves, and what knowing it would."""
    saved, left = (f"{getattr(risk, n):.3f} ± {risk.error[n]:.3f} $" for n in ("learning", "knowing"))
    return f"learning the bead is planned to save {saved}; to know it before the first pass, {left} more"
