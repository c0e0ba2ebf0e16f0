"""Report of ``hwsim centering``: the first parts, predictions next to outcomes, or two controllers."""

import argparse
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from centering.cycle import CycleState
from hwsim._report.worst import GAVE_UP, broken_off
from hwsim.command._report import broken_lines, parts_table, summary_head, summary_line
from hwsim.command._run_folder import drawn, paged, refuse_no_folder, with_kept
from hwsim.command._work import PARTS, announce, run_page
from sdpgrind.base.brief import counted
from sdpgrind.base.units import UM

if TYPE_CHECKING:
    from hwsim._log.log import Log

_SHORT = {"peak_force": "force", "true_mu_kinetic": "mu_kinetic"}
_COLUMNS = (
    ("time", ".2f"), ("pushes", "d"), ("offset", ".2f"), ("finished", "d"), ("peak_force", ".0f"),
    ("true_mu_kinetic", ".4f"),
)  # fmt: skip
_PREDICTED = 400  # simulated parts; chosen: means to 5 % of the scatter


class _InMicrometres:
    """A log with its offset in µm."""

    def __init__(self, log: "Log") -> None:
        offset = (UM * log.outcome.offset).assign_attrs(units="µm")
        self.outcome, self._parts = log.outcome.assign(offset=offset), len(log)

    def __len__(self) -> int:
        return self._parts


def report(title: str, log: "Log", plan: Any) -> str:
    """Return the whole report as text."""
    shown: Any = _InMicrometres(log)
    why = _given_up(log.outcome)
    lines = parts_table(shown, "part", _COLUMNS, _SHORT, why)
    return "\n".join([*_head(title, plan), "", *lines, "", *_summary(log, plan, why)])


def _given_up(outcome: Any) -> list[str]:
    """Reason why each part was broken off, with the state of the controller."""
    why = broken_off(outcome)
    if "state" not in outcome:
        return why
    states = (CycleState(int(state)).name.lower().replace("_", " ") for state in outcome.state.values)
    return [
        f"{GAVE_UP}: {state}" if each == GAVE_UP else each for each, state in zip(why, states, strict=True)
    ]


def side_by_side(title: str, log: "Log", plan: Any) -> str:
    """Return the outcomes of the same parts with each controller, as text."""
    outcome = log.outcome
    names = [str(name) for name in outcome.controller.values]
    count = f"{outcome.sizes['part']} parts"
    lines = [f"{count:<26}" + "".join(f"{name:>12}" for name in names)]
    for label, values, form in _figures(outcome):
        lines.append(f"{label:<26}" + "".join(f"{format(float(value), form):>12}" for value in values))
    return "\n".join([*_head(title, plan), "", *lines])


def _figures(outcome: Any) -> Iterator[tuple[str, Any, str]]:
    """Rows of the comparison: name, a value per controller, format; unfinished parts are in no mean."""
    yield "finished (%)", 100 * outcome.finished.mean("part").values, ".1f"
    broken = outcome.said_finished == 0
    if broken.any():
        yield "broken off (%), left out", 100 * broken.mean("part").values, ".1f"
    done = outcome[["time", "pushes", "offset"]].where(~broken)
    for name, label, form in (("time", "time (s)", ".2f"), ("pushes", "pushes", ".2f")):
        yield f"{label}, mean", done[name].mean("part").values, form
        yield f"{label}, 95 % of parts", done[name].quantile(0.95, "part").values, form
    yield "offset at the end (µm)", UM * done.offset.mean("part").values, ".2f"
    yield "peak force (N), mean", outcome.peak_force.mean("part").values, ".1f"


def _head(title: str, plan: Any) -> Iterator[str]:
    problem, model = plan.problem, plan.problem.model
    yield (
        f"{title}: a ring of {model.part.mass:g} kg, radius {model.part.radius:g} mm, "
        f"from up to {problem.offset_max:g} mm to {UM * problem.tolerance:g} µm"
    )
    places = ", ".join(f"{plan.cycle_time(offset):.2f} s from {offset:g} mm" for offset in _places(problem))
    yield f"strategy: {places}; finished where {UM * plan.finish:.3g} µm are measured"
    yield f"risk: {plan.robust().told}"
    if problem.quantum_note:
        yield f"note: {problem.quantum_note}"


def _places(problem: Any) -> list[float]:
    return [
        round(share * problem.offset_max, 6)
        for share in (0.01, 0.1, 1.0)
        if share * problem.offset_max > problem.tolerance
    ]


def _summary(log: "Log", plan: Any, why: list[str]) -> Iterator[str]:
    outcome, done = log.outcome, np.array([not each for each in why])
    start = np.clip(
        np.hypot(outcome.center_x.values[:, 0], outcome.center_y.values[:, 0]), 0.0, plan.problem.offset_max
    )
    model = plan.simulate(runs=_PREDICTED, rng=0, start=np.resize(start, _PREDICTED))
    yield summary_head(int(done.sum()), len(log), "part")
    if done.any():
        expected = float(np.mean([plan.cycle_time(float(offset)) for offset in start[done]]))
        yield summary_line("time (s)", outcome.time.values[done], ".3f", expected)
        yield summary_line("pushes", outcome.pushes.values[done], ".3f", float(model.pushes.mean()))
        yield summary_line(
            "offset at the end (µm)",
            UM * outcome.offset.values[done],
            ".3f",
            UM * float(np.mean(model.offset)),
        )
    yield summary_line(
        "finished (%)", 100 * outcome.finished.values, ".1f", 100 * float(np.mean(model.finished))
    )
    if done.any():
        yield summary_line("peak force (N)", outcome.peak_force.values[done], ".1f")
    for name, label in (("collisions", "collisions"), ("slipped", "slipped on the table (%)")):
        if outcome[name].values.any():
            yield summary_line(
                label, (1.0 if name == "collisions" else 100.0) * outcome[name].values, ".2f", 0.0
            )
    yield from broken_lines(why, "part")


def compared(area: Any, title: str, job: Any, arguments: argparse.Namespace) -> str:
    """Run both controllers, write files where a folder is given, and return the report."""
    from hwsim._loop.compare import compare

    if arguments.live:
        raise ValueError("--live must be left out with --source, which runs every part twice")
    folder = _folder(arguments.out, arguments.problem)
    plan = _strategy(area, job, arguments)
    both = {"source": job.source(plan), "ours": job.controller(plan)}
    parts = PARTS if arguments.parts is None else arguments.parts
    announce(f"running {counted(parts, 'part')} twice")
    log = compare(job.stand, both, parts=parts, rng=arguments.rng, progress=arguments.run_progress)
    text = side_by_side(title, log, plan)
    if folder is None:
        return text
    page = partial(run_page, area, arguments, title, log, plan)
    pictures = {} if arguments.no_pictures else {"strategy.png": plan, "compare.png": log}
    return with_kept(text, folder, _keep(folder, plan, log, pictures, page))


def _strategy(area: Any, job: Any, arguments: argparse.Namespace) -> Any:
    """The given strategy (checked before to be of this problem), or a new one."""
    import sdpgrind

    if arguments.plan is not None:
        return sdpgrind.load(arguments.plan)
    announce("planning")
    return area.plan(job, arguments, arguments.plan_progress)


def _folder(path: Path | None, job: Path | None) -> Path | None:
    """Refuse a folder that holds more than the file of the job."""
    refuse_no_folder(path)
    own = None if job is None else job.resolve()
    if path is not None and path.exists() and any(held.resolve() != own for held in path.iterdir()):
        raise ValueError(f"--out must be a new or empty folder with --source; {path} holds something")
    return path


def _keep(
    folder: Path, plan: Any, log: Any, pictures: Mapping[str, Any], page: Callable[[Path], str]
) -> list[str]:
    folder.mkdir(parents=True, exist_ok=True)
    plan.save(folder / "strategy.nc")
    log.save(folder / "compare.nc")
    return ["strategy.nc", "compare.nc", *(drawn(folder, pictures) if pictures else []), *paged(folder, page)]
