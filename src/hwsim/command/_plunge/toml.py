"""A plunge-grinding job as a TOML file: the cycle, the controller, and the grinder."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hwsim.command._toml import Table
from hwsim.command._toml import read as read_toml
from hwsim.command.base import StandJob
from hwsim.plants._plunge.inspection import Inspection
from hwsim.plants._plunge.plant import PlungeGrinder
from sdpgrind import plunge


@dataclass(frozen=True)
class Job(StandJob[PlungeGrinder]):
    """A grinder and settings of its controller."""

    def controller(self, plan: plunge.CyclePlan) -> plunge.CycleController:
        """Controller of the first part."""
        return plunge.CycleController(plan.problem, **self.settings)


def planned(problem: plunge.CycleProblem, progress: Any = None) -> plunge.CyclePlan:
    """The fastest cycle, by the most exact method for the problem's wear."""
    wear = problem.model.wear
    if wear is None or wear.growth == 0:
        return plunge.plan(problem, progress=progress)
    method = "dp" if wear.exponent == 0 else "collocation"
    return plunge.plan(problem, method=method, progress=progress)


def read(path: Path) -> Job:
    """Read the job in the file at `path`; ValueError names the file and the key."""
    return read_toml(path, _job)


def _job(file: Table) -> Job:
    problem = file.made(plunge.CycleProblem, **file.values(plunge.CycleProblem))
    table = file.maybe("controller")
    settings = table.values(plunge.CycleController, skip=("problem",))
    table.done()
    if file.has("time_constant") and settings.get("sparkout") != "printed":
        problem.replace(time_constant=None).replace(time_constant=problem.time_constant)  # warns of another
    table.made(plunge.CycleController, problem, **settings)  # refuses settings before planning
    return Job(_grinder(problem, file.maybe("grinder"), _inspection(file)), settings)


def _inspection(file: Table) -> Inspection | None:
    """What inspects the finished parts."""
    return file.table("inspection").one(Inspection) if file.has("inspection") else None


def _grinder(problem: plunge.CycleProblem, table: Table, inspection: Inspection | None) -> PlungeGrinder:
    options = table.values(PlungeGrinder, skip=("problem", "truth", "inspection"))
    if table.has("truth"):
        options["truth"] = table.table("truth").changed(problem.model, skip=("power", "burning", "internal"))
    table.done()
    return table.made(PlungeGrinder, problem, inspection=inspection, **options)
