"""A centering job as a TOML file: part, friction and limits, controller, and the machine on which it is tried.

Keys are the names of the Python interface; numbers are in the library's units (mm, s, N, kg, rad) or texts with a unit. What is
left out is that of the preset. Every fault is one line that names the key.
"""

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import centering
from hwsim.command._physics import flag
from hwsim.command._toml import Table
from hwsim.command._toml import read as read_toml
from hwsim.plants._centering.plant import CenteringMachine
from hwsim.plants._probe.errors import ProbeErrors
from sdpgrind.base import checks

_LENGTHS = {"tolerance": "mm", "offset_max": "mm"}
_PART = {"mass": "kg", "radius": "mm"}
_MODEL = {
    "contact_stiffness": "N/mm",
    "contact_damping": "N s/mm",
    "mu_static": "",
    "mu_kinetic": "",
    "viscous_coefficient": "N s/mm",
    "restitution": "",
}
_LIMITS = {
    "approach_speed": "mm/s",
    "push_speed_max": "mm/s",
    "slide_speed_max": "mm/s",
    "acceleration_max": "mm/s^2",
    "settle_time": "s",
    "safety": "mm",
    "follow_gap": "mm",
    "spindle_speed_max": "rad/s",
    "spindle_acceleration_max": "rad/s^2",
    "sample_time": "s",
    "stroke_offset_max": "mm",
}
_SCATTER = {"friction_part_sd": "", "friction_push_sd": "", "direction_sd": "rad", "stop_sd": "mm", "measuring_sd": "mm"}
_SETTINGS = {
    "probe_closed": "mm",
    "probe_reach": "mm",
    "margin": "mm",
    "radius_sd": "mm",
    "form_sd": "mm",
    "noise_sd": "mm",
    "doubt": "",
    "turns_in_doubt": "",
    "following_lag": "s",
    "manual_lead": "rad",
    "timeout": "s",
    "lost_after": "s",
    "force_idle": "N",
}
_MACHINE = {"tip_radius": "mm", "start_gap": "mm", "time_max": "s"}
_ERRORS = {
    "probe_quantum": "mm",
    "slide_quantum": "mm",
    "noise_sd": "mm",
    "skew": "s",
    "runout": "mm",
    "slip": "",
    "dust": "",
    "dust_size": "mm",
}


@dataclass(frozen=True)
class Job:
    """A machine, the table speed of its strategy (rad/s, or that it is scheduled), and settings of its controller."""

    stand: CenteringMachine
    spindle_speed: str | float = "scheduled"
    settings: centering.CycleSettings = field(default_factory=centering.CycleSettings)

    @property
    def problem(self) -> centering.CenteringProblem:
        """What is planned."""
        return self.stand.problem

    def controller(self, plan: centering.Strategy) -> centering.CenteringController:
        """The controller of every part."""
        return centering.CenteringController(plan, settings=self.settings)

    def source(self, plan: centering.Strategy) -> centering.PrintedController:
        """The source's controller, at the table speeds of a strategy."""
        return centering.PrintedController(self.problem, scheduled=plan, settings=self.settings)


def planned(job: Job, progress: Any) -> centering.Strategy:
    """The strategy of a job; that its tolerance is finer than what stick and slip allow is said in the report."""
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
        file.made(checks.at_most, "spindle_speed", speed, "spindle_speed_max", problem.limits.spindle_speed_max, "rad/s")
    settings = _changed(centering.CycleSettings(), file.maybe("controller"), _SETTINGS)
    machine = _machine(problem, file.maybe("machine"))
    return Job(machine, speed, settings.replace(tip_radius=machine.tip_radius))


def _problem(file: Table) -> centering.CenteringProblem:
    """A preset with what the file says of part, model, limits and scatter."""
    name = file.text("preset", tuple(info.name for info in centering.presets())) if file.has("preset") else "printed"
    known = centering.preset(name)
    part = _changed(known.model.part, file.maybe("part"), _PART)
    model = _changed(known.model.replace(part=part), file.maybe("model"), _MODEL)
    limits = _changed(known.limits, file.maybe("limits"), _LIMITS)
    scatter = _changed(known.scatter, file.maybe("scatter"), _SCATTER)
    options: dict[str, Any] = {**file.given(_LENGTHS)}
    if file.has("pushes_max"):
        options["pushes_max"] = file.take("pushes_max")
    return file.made(known.replace, model=model, limits=limits, scatter=scatter, **options)


def _changed(known: Any, table: Table, units: dict[str, str]) -> Any:
    """Something known with the numbers of a table."""
    changed = table.made(known.replace, **table.given(units))
    table.done()
    return changed


def _machine(problem: centering.CenteringProblem, table: Table) -> CenteringMachine:
    options: dict[str, Any] = {**table.given(_MACHINE)}
    if table.has("start_offset"):
        options["start_offset"] = _offset(table)
    if table.has("gain_scheduling"):
        options["gain_scheduling"] = flag(table, "gain_scheduling")
    if table.has("scheduler") and not flag(table, "scheduler"):
        options["scheduler"] = None
    if table.has("truth"):
        options["truth"] = _changed(problem.model, table.table("truth"), _MODEL | _PART)
    if table.has("scatter"):
        options["scatter"] = _changed(problem.scatter, table.table("scatter"), _SCATTER)
    if table.has("errors"):
        errors = ProbeErrors(noise_sd=0.0, runout=0.0)
        options["errors"] = _changed(errors, table.table("errors"), _ERRORS)
    table.done()
    return table.made(CenteringMachine, problem, **options)


def _offset(table: Table) -> Any:
    """One offset, or the least and the greatest."""
    if not isinstance(table.take("start_offset"), list):
        return table.number("start_offset", "mm")
    return tuple(table.list_of("start_offset", "mm"))
