"""Report of ``hwsim finishing``: where the work lies, the first parts, and the plan next to the outcome."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._log.columns import modelled
from hwsim.command._report import CommandReport, Finished, summary_line
from hwsim.plants._finishing.beyond import unknown
from sdpgrind.base.brief import counted
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from hwsim._log.log import Log

_SHORT = {
    "normal_force": "force", "normal_force_sd": "force sd", "lift_off": "no contact",
    "path_deviation": "off path", "roughness_ra": "Ra",
}  # fmt: skip
_COLUMNS = (
    ("time", ".2f"), ("normal_force", ".4f"), ("normal_force_sd", ".4f"), ("lift_off", ".4f"),
    ("feed", ".2f"), ("path_deviation", ".3f"), ("roughness_ra", ".5f"),
)  # fmt: skip

_SLOW = 1 / 3  # chosen: share of the feed rate; a law that holds the speed only where it must is far above


def placement_lines(problem: Any) -> Iterator[str]:
    """Yield a line that says where the work lies and what that is worth; nothing of a table's default."""
    from sdpgrind.finishing.kernels import worth_of

    if problem.placement is None:
        return
    x, y, z, *turn = problem.placement
    turned = f", turned by {math.degrees(turn[0]):.4g} deg" if turn else ""
    tool = f", azimuth of the tool {math.degrees(problem.azimuth):.4g} deg" * (problem.heading == "fixed")
    yield (
        f"placed at ({x:.5g}, {y:.5g}, {z:.5g}) mm{turned}{tool}; least margin over the path"
        f" {100 * worth_of(problem):.2g} % of a joint's range, or of the way to a singular pose"
    )


def corner_lines(motion: Any) -> Iterator[str]:
    """Yield a hint where rounded corners make a trapezoid slow."""
    rounded = getattr(motion.problem.path, "deviation", 0.0) > 0
    if motion.method != "trapezoid" or not rounded:
        return
    on_work = motion.contact[1:] & motion.contact[:-1]
    time, length = (float(np.diff(rows)[on_work].sum()) for rows in (motion.time, motion.length))
    if length < _SLOW * motion.problem.feed_rate * time:
        yield (
            "hint: all of the path is as slow as its tightest rounded corner; a greater deviation"
            ' or method = "min_time" may be faster'
        )


def _head(title: str, plan: Any, job: Any) -> Iterator[str]:
    path, problem = plan.problem.path, plan.problem
    yield (
        f"{title}: {path.pattern}, {path.length:.0f} mm of path, pitch {path.pitch:.3g} mm, "
        f"tool {problem.tool_diameter:g} mm"
    )
    share = plan.mean_feed_rate / problem.feed_rate
    feed = (
        f"{plan.mean_feed_rate:.2f} mm/s on average, {100 * share:.0f} % of the "
        f"{problem.feed_rate:g} mm/s commanded"
    )
    yield f"motion: {plan.duration:.2f} s, {feed}; {plan.status}"
    yield from placement_lines(problem)
    yield from corner_lines(plan)
    controller = job.controller(plan)
    slowest = (
        ""
        if controller.kind == "constant"
        else f"; its slowest pole decays with {controller.poles.slowest:.1f} 1/s"
    )
    yield f"controller: {controller.kind}, {job.stand.target_force:g} N{slowest}"


def _summary(log: "Log", plan: Any, job: Any, finished: Finished) -> Iterator[str]:
    if finished.any():
        yield from _means(modelled(log.outcome).isel(part=finished), plan, job.stand.target_force)


def _means(outcome: Any, plan: Any, wanted: float) -> Iterator[str]:
    yield summary_line("time (s)", outcome.time.values, ".3f", plan.duration)
    yield summary_line("feed (mm/s)", outcome.feed.values, ".3f", plan.mean_feed_rate)
    yield summary_line("force (N)", outcome.normal_force.values, ".4f", wanted)
    yield summary_line("rms off the force (N)", outcome.force_error.values, ".4f", 0.0)
    yield summary_line("without contact (%)", 100.0 * outcome.lift_off.values, ".2f", 0.0)
    yield summary_line("off the path (mm)", outcome.path_deviation.values, ".4f", 0.0)
    rough = outcome.roughness_ra.values
    told = rough[np.isfinite(rough)]
    expected = _expected(plan.problem, wanted)
    if told.size:
        some = "roughness Ra (µm)" if told.size == rough.size else f"Ra of {counted(told.size, 'part')} (µm)"
        yield summary_line(some, UM * told, ".3f", expected)
    if outcome.extrapolated.values.any():
        planned = 100.0 if expected is None else 0.0
        yield summary_line("beyond the model (%)", 100.0 * outcome.extrapolated.values, ".1f", planned)


def _expected(problem: Any, force: float) -> float | None:
    """Mean roughness (µm) of the model at the target force; None: beyond its range."""
    settings = problem.path.pattern, problem.tool_diameter, force
    return UM * float(problem.model.law(*settings).mean) if problem.model.covers(*settings) else None


def beyond_line(problem: Any, force: float) -> str:
    """Sentence on what of pattern, tool and force (N) the roughness model does not know; empty: it does."""
    found = unknown(problem.model, problem.path.pattern, [problem.tool_diameter], [force])
    return f"no roughness is told: its model does not know {found}" if found else ""


report = CommandReport(_COLUMNS, _SHORT, _head, _summary)
