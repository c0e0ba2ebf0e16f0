"""Report of ``hwsim plunge``: the first parts, and the bound next to the outcome."""

import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim.command._report import CommandReport, Finished, of_all, summary_line
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from hwsim._log.log import Log

_SHORT = {"part_slack": "slack", "out_of_round": "out of round"}
_COLUMNS = (
    ("time", ".2f"), ("part_slack", ".4f"), ("burned", "d"), ("roundness", ".5f"), ("out_of_round", "d"),
)  # fmt: skip
_GAVE_UP = "readings of size were missing, frozen or jumped"  # the only faults for which its controller stops


def _head(title: str, plan: Any, job: Any) -> Iterator[str]:
    problem = plan.problem
    limits = f"up to {problem.command_rate_max:g} mm/s, {UM * problem.roundness_max:g} µm round"
    yield f"{title}: {problem.stock:g} mm of stock, {limits}"
    known = f"known to {plan.error:.0e} s, {plan.method}"
    yield f"plan: the fastest cycle takes {plan.time:.4f} s ({known}); {plan.binding} binds at the end"
    yield from _cold(problem)
    yield _promise(job.controller(plan))


def _cold(problem: Any) -> Iterator[str]:
    """How far the greatest rate is from burning, where no rate burns: a limit in another unit is seen so."""
    model, rate = problem.model, problem.command_rate_max
    if model.burn_rate > rate:
        share = float(model.grinding_power(rate) / model.burning_power(rate))
        yield f"burning: none up to the greatest rate, where the power is {100 * share:.2g} % of its limit"


def _promise(controller: Any) -> str:
    """What the controller keeps, and what the doubts that no reading shows cost."""
    known = f"burn threshold {controller.problem.uncertainty.burn_threshold}"
    if controller.sparkout == "printed":
        return f"controller: the printed cycle with a margin of {UM * controller.safety_margin:g} µm; {known}"
    cost = _cost(controller)
    told = f", which costs {cost:.2f} s" if cost > 0.0 else ""
    return f"controller: none burned with a confidence of {controller.confidence:g}; {known}{told}"


def _cost(controller: Any) -> float:
    """Time (s) that the doubts that stay cost; 0 where the wheel wears, too."""
    from sdpgrind import plunge

    doubts, wear = controller.problem.uncertainty, controller.problem.model.wear
    if not (doubts.burning_sd or doubts.diffusivity_sd) or (wear is not None and wear.growth):
        return 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # told where the job was read
        learned = controller.problem.replace(sharpness_sd=0.0)
        return float(plunge.plan(learned, confidence=controller.confidence).price["all"])


def _summary(log: "Log", plan: Any, job: Any, finished: Finished) -> Iterator[str]:
    outcome = log.outcome
    if finished.any():
        yield from _times(outcome.time.values, finished, plan)
    known = outcome.part_slack.values[finished & np.isfinite(outcome.part_slack.values)]
    if known.size:
        yield summary_line("slack of damage (µm)", UM * known, ".2f", 0.0)
    yield summary_line(of_all("burned", finished), 100.0 * outcome.burned.values, ".1f", 0.0)
    if finished.any():
        yield summary_line(
            "roundness (µm)", UM * outcome.roundness.values[finished], ".3f", UM * plan.roundness
        )
        yield summary_line("out of round (%)", 100.0 * outcome.out_of_round.values[finished], ".1f", 0.0)


def _times(time: Any, finished: Any, plan: Any) -> Iterator[str]:
    yield summary_line("time (s)", time[finished], ".3f", plan.time)
    if finished[1:].any():
        yield summary_line("time from part 1 on (s)", time[1:][finished[1:]], ".3f", plan.time)


report = CommandReport(_COLUMNS, _SHORT, _head, _summary, otherwise=_GAVE_UP)
