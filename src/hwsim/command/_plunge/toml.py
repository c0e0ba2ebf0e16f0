"""A plunge-grinding job as a TOML file: the cycle, the controller, and the grinder on which it is tried.

Keys are the names of the Python interface; numbers are in the library's units (mm, s, N, J, W, rad) or texts with a unit.
Every fault is one line that names the key.
"""

from pathlib import Path

from hwsim.command._plunge._plunge_jobs import Job
from hwsim.command._toml import Table
from hwsim.command._toml import read as read_toml
from hwsim.plants._plunge.plant import PlungeGrinder
from sdpgrind import plunge


def read(path: Path) -> Job:
    """Read the job in the file at `path`; ValueError names the file and the key."""
    return read_toml(path, _job)


def _job(file: Table) -> Job:
    problem = file.made(plunge.CycleProblem, **file.values(plunge.CycleProblem))
    table = file.maybe("controller")
    settings = table.values(plunge.CycleController, skip=("problem",))
    table.done()
    table.made(plunge.CycleController, problem, **settings)  # what it refuses is told before the planning
    return Job(_grinder(problem, file.maybe("grinder")), settings)


def _grinder(problem: plunge.CycleProblem, table: Table) -> PlungeGrinder:
    options = table.values(PlungeGrinder, skip=("problem", "truth"))
    if table.has("truth"):
        options["truth"] = _truth(problem.model, table.table("truth"))
    table.done()
    return table.made(PlungeGrinder, problem, **options)


def _truth(model: plunge.PlungeModel, table: Table) -> plunge.PlungeModel:
    """What wheel, work and machine really are, where it is not what is believed."""
    changes = table.values(plunge.PlungeModel, every=False, skip=("power", "burning", "internal"))
    table.done()
    return table.made(model.replace, **changes)
