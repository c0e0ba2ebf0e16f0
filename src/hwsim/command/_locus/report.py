"""Report of ``hwsim locus``: the first parts, and the optimum on the locus next to the outcome."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from hwsim._report.locus import best_point
from hwsim.command._report import CommandReport, Finished, of_all, summary_line
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from hwsim._log.log import Log

_SHORT = {"convergence_time": "converged", "removal_rate": "removal", "true_wear_flat_area": "wear flats"}
_COLUMNS = (
    ("time", ".2f"), ("convergence_time", ".1f"), ("slack", ".2f"), ("burned", "d"), ("removal_rate", ".2f"),
    ("true_wear_flat_area", ".5f"),
)  # fmt: skip


def _head(title: str, plan: Any, job: Any) -> Iterator[str]:
    stand, controller = job.stand, job.controller(plan)
    low, high = plan.problem.controls["work_rotation"]
    limits = (
        f"infeed up to {UM * plan.problem.controls['infeed_rate'][1]:g} µm/s, work {low:g} to {high:g} rad/s"
    )
    yield f"{title}: {stand.stock:g} mm of stock, {limits}"
    area = stand.wear_flat_area
    best = plan.at(wear_flat_area=area).controls
    point = f"{UM * best['infeed_rate']:.3f} µm/s, {best['work_rotation']:.3f} rad/s"
    yield f"curve: {plan.status}; best at {area:g}: {point}"
    start = controller.command
    begin = f"{UM * start['infeed_rate']:.3f} µm/s, {start['work_rotation']:.3f} rad/s"
    yield f"controller: begins at {begin}; margin {controller.margin:g} W"


def _summary(log: "Log", plan: Any, job: Any, finished: Finished) -> Iterator[str]:
    outcome = log.outcome
    if finished.any():
        yield from _rates(log, plan, finished)
        yield summary_line(
            "least slack (W)", outcome.slack.values[finished], ".2f", job.controller(plan).margin
        )
    yield summary_line(of_all("burned", finished), 100.0 * outcome.burned.values, ".1f", 0.0)
    converged = outcome.convergence_time.values
    if (known := finished & np.isfinite(converged)).any():
        yield summary_line("converged (s)", converged[known], ".2f")
    if not np.isfinite(converged).all():
        yield summary_line("never converged (%)", 100.0 * np.isnan(converged), ".1f", 0.0)


def _rates(log: "Log", plan: Any, finished: Any) -> Iterator[str]:
    best = best_point(log, plan)
    for title, name, digits in (
        ("time (s)", "time", ".3f"),
        ("removal rate (mm^3/s)", "removal_rate", ".3f"),
    ):
        mean = float(np.mean(best[name][finished]))
        yield summary_line(title, log.outcome[name].values[finished], digits, mean)


report = CommandReport(_COLUMNS, _SHORT, _head, _summary)
