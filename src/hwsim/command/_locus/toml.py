"""A job of adaptive grinding as a TOML file: the process, its ranges, the controller, and the grinder."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hwsim.command._toml import Table
from hwsim.command._toml import read as read_toml
from hwsim.command.base import StandJob
from hwsim.devices import Gauge
from hwsim.plants._locus.plant import AdaptiveGrinder
from sdpgrind import locus

PRINTED: Mapping[str, Any] = {
    "gain": 3.3e-6,
    "kp": 5.3e-6,
    "hold": 3.0,
    "at": "command",
    "start": 1e-3,
    "floor": 8e-4,
    # mm/(s W), s, mm/s; source: gains of Koren (1989), eq. (36); chosen: the others give his 28 s and 4 s
}

DESIGNED: Mapping[str, Any] = {"margin": 2.0}  # W; chosen: lags and dulling of the nominal machine take 0.9 W


@dataclass(frozen=True)
class Job(StandJob[AdaptiveGrinder]):
    """A grinder and settings of its controller."""

    def controller(self, plan: locus.Locus) -> locus.LocusController:
        """Controller of the first part; with designed gain by default."""
        return locus.LocusController(plan, **{"along": "infeed_rate", **self.settings})


_GAINS = {"margin": "W", "kd": "mm/(s W)", "kp": "mm/(s W)", "floor": "mm/s"}
_WORDS_OR = {"gain": "mm/(s W)", "start": "mm/s", "hold": "s"}  # a quantity or a word of the controller
_GAUGE = {"noise_sd": "W", "relative_sd": "", "quantum": "W"}


def read(path: Path) -> Job:
    """Read the job in the file at `path`; ValueError names the file and the key."""
    return read_toml(path, _job)


def _job(file: Table) -> Job:
    file.need("process", "controls", "hidden")
    process, controls, hidden = (
        _process(file.table("process", locus.processes.Grinding)),
        file.table("controls"),
        file.table("hidden"),
    )
    ranges = {
        "controls": _ranges(process, controls, ("infeed_rate", "work_rotation")),
        "hidden": _ranges(process, hidden, ("wear_flat_area",)),
    }
    problem = file.made(locus.Problem, model=process, **ranges)
    return Job(_grinder(problem, file.maybe("grinder")), _settings(file.maybe("controller")))


def _ranges(
    process: locus.processes.Grinding, table: Table, names: tuple[str, ...]
) -> dict[str, tuple[float, float]]:
    found = {name: _pair(table, name, process.units[name].removeprefix("1")) for name in names}
    table.done()
    return found


def _pair(table: Table, key: str, unit: str) -> tuple[float, float]:
    values = table.list_of(key, unit)
    if len(values) != 2:
        raise ValueError(
            f"{table.path(key)} must be a least and a greatest value ({unit or '1'}); got {values!r}"
        )
    return values[0], values[1]


def _process(table: Table) -> locus.processes.Grinding:
    process = table.made(
        locus.processes.Grinding, **table.values(locus.processes.Grinding, skip=("roughness",))
    )
    table.done()
    return process


def _settings(table: Table) -> dict[str, Any]:
    settings: dict[str, Any] = {**table.values(locus.LocusController), **table.given(_GAINS)}
    if table.has("along"):
        settings["along"] = table.take("along")
    for key, unit in _WORDS_OR.items():
        if table.has(key):
            word = table.take(key)
            settings[key] = word if isinstance(word, str) and word.isalpha() else table.number(key, unit)
    if table.has("wear_flat_area"):
        settings["x"] = _pair(table, "wear_flat_area", "")
    table.done()
    return settings


def _grinder(problem: locus.Problem, table: Table) -> AdaptiveGrinder:
    dressing = ("dullness", "dressing_state", "dressing_lead", "roughness_gauge")
    options = table.values(AdaptiveGrinder, skip=("truth", "power_gauge", "tick", *dressing))
    if table.has("power_gauge"):
        options["power_gauge"] = _gauge(table.table("power_gauge"))
    if table.has("truth"):
        options["truth"] = table.table("truth").changed(problem.model, skip=("roughness",))
    table.done()
    return table.made(AdaptiveGrinder, problem, **options)


def _gauge(table: Table) -> Gauge:
    gauge = table.made(Gauge, **table.given(_GAUGE))
    table.done()
    return gauge
