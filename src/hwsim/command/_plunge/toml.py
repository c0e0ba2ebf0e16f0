"""A plunge-grinding job as a TOML file: the cycle, the controller, and the grinder on which it is tried.

Keys are the names of the Python interface; numbers are in the library's units (mm, s, N, J, W, rad) or texts with a unit.
Every fault is one line that names the key.
"""

from pathlib import Path
from typing import Any

from hwsim.command._physics import burning, flag, power
from hwsim.command._plunge._plunge_jobs import Job
from hwsim.command._toml import Table
from hwsim.command._toml import read as read_toml
from hwsim.plants._plunge.plant import GrinderNoise, PlungeGrinder
from sdpgrind import plunge

_CYCLE = {"stock": "mm", "command_rate_max": "mm/s", "roundness_max": "mm"}
_SAMPLED = {"time_constant": "s", "sample_time": "s"}
_MODEL = {
    "wheel_diameter": "mm",
    "work_diameter": "mm",
    "width": "mm",
    "wheel_speed": "mm/s",
    "work_rotation": "rad/s",
    "wear_flat_area": "",
    "stiffness": "N/mm",
    "normal_force_ratio": "",
    "diffusivity": "mm^2/s",
    "roundness_base": "mm",
    "roundness_gain": "",
}
_LINEAR = {"linear_time_constant": "s"}
_WEAR = {"exponent": "", "reference_rate": "mm/s"}
_SETTINGS = {
    "safety_margin": "mm",
    "roundness_margin": "mm",
    "observer_gain": "",
    "size_sd": "mm",
    "power_sd": "",
    "contact_zero_sd": "mm",
    "deflection_sd": "",
    "sharpness_sd": "",
}
_GRINDER = {
    "contact_zero_sd": "mm",
    "power_gain": "",
    "power_max": "W",
    "power_lag": "s",
    "size_offset": "mm",
    "command_quantum": "mm",
    "max_time": "s",
}


def read(path: Path) -> Job:
    """Read the job in the file at `path`; ValueError names the file and the key."""
    return read_toml(path, _job)


def _job(file: Table) -> Job:
    problem = file.made(plunge.CycleProblem, _model(file.table("model")), **file.numbers(_CYCLE), **file.given(_SAMPLED))
    table = file.maybe("controller")
    settings = _settings(table)
    table.made(plunge.CycleController, problem, **settings)  # what it refuses is told before the planning
    return Job(_grinder(problem, file.maybe("grinder")), settings)


def _model(table: Table) -> plunge.PlungeModel:
    options: dict[str, Any] = {"internal": flag(table, "internal")} if table.has("internal") else {}
    if table.has("wear"):
        options["wear"] = _wear(table.table("wear"))
    limit, law = burning(table.table("burning")), power(table.table("power"))
    numbers = table.numbers(_MODEL) | table.given(_LINEAR)
    table.done()
    return table.made(plunge.PlungeModel, power=law, burning=limit, **numbers, **options)


def _wear(table: Table) -> plunge.Wear:
    growth = table.number("growth", "1/mm")
    wear = table.made(plunge.Wear, growth, **table.given(_WEAR))
    table.done()
    return wear


def _settings(table: Table) -> dict[str, Any]:
    settings: dict[str, Any] = {**table.given(_SETTINGS)}
    if table.has("sparkout"):
        settings["sparkout"] = table.take("sparkout")
    settings |= {key: flag(table, key) for key in ("online", "no_burn") if table.has(key)}
    table.done()
    return settings


def _grinder(problem: plunge.CycleProblem, table: Table) -> PlungeGrinder:
    options: dict[str, Any] = {**table.given(_GRINDER)}
    if table.has("dynamics"):
        options["dynamics"] = table.take("dynamics")
    if table.has("size_delay"):
        options["size_delay"] = flag(table, "size_delay")
    if table.has("noise"):
        options["noise"] = _noise(table.table("noise"))
    if table.has("truth"):
        options["truth"] = _truth(problem.model, table.table("truth"))
    table.done()
    return table.made(PlungeGrinder, problem, **options)


def _noise(table: Table) -> GrinderNoise:
    noise = table.made(GrinderNoise, **table.given({"size_sd": "mm", "power_sd": ""}))
    table.done()
    return noise


def _truth(model: plunge.PlungeModel, table: Table) -> plunge.PlungeModel:
    """What wheel, work and machine really are, where it is not what is believed."""
    changes: dict[str, Any] = {**table.given(_MODEL | _LINEAR)}
    if table.has("wear"):
        changes["wear"] = _wear(table.table("wear"))
    table.done()
    return table.made(model.replace, **changes)
