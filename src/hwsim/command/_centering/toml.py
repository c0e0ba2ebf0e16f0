"""A centering job as a TOML file: part, friction and limits, controller, and the machine.

Missing values are those of the preset.
"""

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import centering
from centering.push import Part, PushModel
from hwsim.command._toml import Table
from hwsim.command._toml import read as read_toml
from hwsim.plants._centering.plant import CenteringMachine
from hwsim.plants._probe.plant import ProbeErrors
from sdpgrind.base import checks
from sdpgrind.base.quantities import specs, units_of

_BY_HAND = ("problem", "truth", "ring", "scatter", "errors", "scheduler", "tick")  # fields not read by kind
_NOT_SET = ("tip_radius", "angle_sd")  # settings of the controller that follow from the machine


@dataclass(frozen=True)
class Job:
    """A machine, the table speed of its strategy (rad/s or "scheduled"), and settings of its controller."""

    stand: CenteringMachine
    spindle_speed: str | float = "scheduled"
    settings: centering.CycleSettings = field(default_factory=centering.CycleSettings)

    @property
    def problem(self) -> centering.CenteringProblem:
        """The planned problem."""
        return self.stand.problem

    def controller(self, plan: centering.Strategy) -> centering.CenteringController:
        """Controller of every part."""
        return centering.CenteringController(plan, settings=self.settings)

    def source(self, plan: centering.Strategy) -> centering.PrintedController:
        """The source's controller, at the table speeds of a strategy."""
        return centering.PrintedController(self.problem, scheduled=plan, settings=self.settings)


def planned(job: Job, progress: Any) -> centering.Strategy:
    """Strategy of a job; the report, not a warning, says that stick and slip limit the tolerance."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*stick and slip.*", category=UserWarning)
        return centering.plan(job.problem, spindle_speed=job.spindle_speed, progress=progress)


def read(path: Path) -> Job:
    """Read the job in the file at `path`; ValueError names the file and the key."""
    return read_toml(path, _job)


def _job(file: Table) -> Job:
    problem = _problem(file)
    speed: str | float = "scheduled"
    if file.has("spindle_speed") and file.take("spindle_speed") != "scheduled":
        speed = file.number("spindle_speed", "rad/s")
        file.made(
            checks.at_most,
            "spindle_speed",
            speed,
            "spindle_speed_max",
            problem.limits.spindle_speed_max,
            "rad/s",
        )
    settings = _changed(centering.CycleSettings(), file.maybe("controller"), _NOT_SET)
    machine = _machine(problem, file.maybe("machine"))
    return Job(machine, speed, settings.replace(tip_radius=machine.tip_radius))


def _problem(file: Table) -> centering.CenteringProblem:
    """A preset changed by the file."""
    name = (
        file.text("preset", tuple(info.name for info in centering.presets()))
        if file.has("preset")
        else "printed"
    )
    known = centering.preset(name)
    part = _changed(known.model.part, file.maybe("part"))
    model = _changed(known.model.replace(part=part), file.maybe("model"))
    limits = _changed(known.limits, file.maybe("limits"))
    scatter = _changed(known.scatter, file.maybe("scatter"))
    options = file.values(centering.CenteringProblem, every=False, skip=_inside(known))
    if file.has("friction_range"):
        options["friction_range"] = tuple(file.list_of("friction_range", "1"))
    return file.made(known.replace, model=model, limits=limits, scatter=scatter, **options)


def _changed(known: Any, table: Table, skip: Iterable[str] = ()) -> Any:
    """A known object with values of a table; its inner objects are left as they are."""
    changed = table.made(
        known.replace, **table.values(type(known), every=False, skip=(*_inside(known), *skip))
    )
    table.done()
    return changed


def _inside(known: Any) -> tuple[str, ...]:
    """Fields that are objects, each in a table of its own."""
    return tuple(name for name, spec in specs(type(known)).items() if spec.kind == "part")


def _machine(problem: centering.CenteringProblem, table: Table) -> CenteringMachine:
    options = table.values(CenteringMachine, every=False, skip=_BY_HAND)
    if table.has("start_offset"):
        options["start_offset"] = _offset(table)
    if table.has("scheduler") and not table.flag("scheduler"):
        options["scheduler"] = None
    if table.has("truth"):
        options["truth"] = _truth(problem.model, table.table("truth"))
    if table.has("scatter"):
        options["scatter"] = _changed(problem.scatter, table.table("scatter"))
    if table.has("errors"):
        options["errors"] = _errors(table.table("errors"))
    table.done()
    return table.made(CenteringMachine, problem, **options)


def _truth(model: PushModel, table: Table) -> PushModel:
    """A model with values of a table, in which values of its part are, too."""
    values = table.values(Part, every=False) | table.values(type(model), every=False, skip=("part",))
    truth = table.made(model.replace, **values)
    table.done()
    return truth


def _errors(table: Table) -> ProbeErrors:
    errors = table.made(
        ProbeErrors(noise_sd=0.0, runout=0.0).replace,
        **table.values(ProbeErrors, every=False, skip=("counts", "runout_phase")),
    )
    table.done()
    return errors


def _offset(table: Table) -> Any:
    """One offset, or the smallest and the largest."""
    unit = units_of(CenteringMachine)["start_offset"]
    if not isinstance(table.take("start_offset"), list):
        return table.number("start_offset", unit)
    return tuple(table.list_of("start_offset", unit))
