"""A finishing job as a TOML file: surface and path, robot and tool, controller, and the cell."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwsim._study.study import UNITS
from hwsim.command._finishing.robot_toml import robot_of
from hwsim.command._finishing.surface_toml import path_of, surface_of
from hwsim.command._toml import Table
from hwsim.command._toml import read as read_toml
from hwsim.command._work import announce
from hwsim.command.base import StandJob
from hwsim.plants._finishing.plant import FinishingCell
from sdpgrind import finishing
from sdpgrind.base import checks
from sdpgrind.base.quantities import units_of
from sdpgrind.finishing.kernels import CellScatter, CellTruth, HeightField, check_axes, check_options
from sdpgrind.finishing.path import LiftedPath

NORMAL_FORCE = 1.111  # default force, N; source: the middle level of Wang and Jan (2001)
KIND = "lqg"  # default controller
_LIGHT = 1e-9  # N, chosen: a force that every motor presses

_WAVE = {"amplitude": "mm", "wavelength": "mm"}
_HIDDEN = ("inertia", "contact_angular_stiffness", "torque_constant")
"""Fields in which the true axis may differ from the believed one."""
_METHODS = ("trapezoid", "toppra", "min_time")


@dataclass(frozen=True)
class FaceOn:
    """What a tool that no torque axis presses leaves of a cell: the motion, for a program."""

    problem: finishing.FinishingProblem


@dataclass(frozen=True)
class Job(StandJob[FinishingCell | FaceOn]):
    """A cell, method of its motion, settings of its controller, and options of a study and a program."""

    method: str = "trapezoid"
    study: Mapping[str, Any] = field(default_factory=dict)
    program: Mapping[str, Any] = field(default_factory=dict)

    def controller(self, plan: finishing.Motion) -> finishing.TorqueController:
        """Controller of every part."""
        assert isinstance(self.stand, FinishingCell)  # the command refuses others
        return finishing.TorqueController(
            self.stand.torque_axis,
            plan,
            **{"normal_force": self.stand.target_force, "kind": KIND} | dict(self.settings),
        )


def scattered(problem: finishing.FinishingProblem, *, nominal: bool) -> Job:
    """A problem in a default cell; nominal: without scatter."""
    scatter = None if nominal else CellScatter()
    return Job(FinishingCell(problem, scatter=scatter, target_force=NORMAL_FORCE))


def read(path: Path, target: str | None = None) -> Job:
    """Read the job at `path`, for a program of a target; ValueError names the file and the key."""
    return read_toml(path, partial(_job, folder=path.parent, target=target))


def _job(file: Table, folder: Path, target: str | None) -> Job:
    program = _program(file.maybe("program"), target or "csv")  # of those the one that allows most
    file.need("surface", "path")
    surface = surface_of(file.table("surface"), folder)
    path = path_of(surface, file.table("path"))
    tool = file.maybe("tool")
    robot = robot_of(file.table("robot"), folder) if file.has("robot") else None
    if target is not None:  # before the motion is planned
        file.maybe("program").made(check_axes, robot, target, program.get("name", "finishing"))
    problem = _problem(path, tool, robot)
    method = file.text("method", _METHODS) if file.has("method") else "trapezoid"
    if not problem.pressed:
        _refuse_unpressed(file)
        return Job(FaceOn(problem), method=method, program=program)
    controller = file.maybe("controller")
    settings = _settings(controller)
    force = settings.pop("normal_force")
    axis = _axis(problem, file.maybe("axis"))
    controller.made(_check_force, problem, axis, force)
    controller.made(_check_settings, axis, settings)
    cell = _cell(problem, {"axis": axis, "target_force": force}, file.maybe("cell"))
    return Job(cell, settings, method, _study(file.maybe("study")), program)


def _refuse_unpressed(file: Table) -> None:
    """Refuse tables that a tool without a torque axis has no use for."""
    for key in ("axis", "controller", "cell", "study"):
        if file.has(key):
            raise ValueError(
                f"{key} must be left out: no torque of the axis presses a tool that is face-on"
                ' (contact_angle = "90 deg") or free to spin, and the job is for a program or a motion'
            )


def _check_force(problem: finishing.FinishingProblem, axis: finishing.TorqueAxis, force: float) -> None:
    """Refuse a force that the motor cannot press, before planning."""
    places = problem.path.sample(per_leg=1)
    most = axis.torque_max / float(np.max(problem.torque_per_force(problem.feed_angles(places))))
    unit = units_of(finishing.TorqueController)["normal_force"]
    if force > most:
        raise checks.refuse(
            "normal_force",
            f"<= {most:.4g}, what current_limit = {axis.current_limit:g} A presses",
            force,
            unit,
        )


def _check_settings(axis: finishing.TorqueAxis, settings: Mapping[str, Any]) -> None:
    """Refuse a controller before planning; of its force `_check_force` knows more."""
    made = finishing.TorqueController(axis, **{"kind": KIND} | dict(settings), normal_force=_LIGHT)
    if made.observer == "ideal":
        raise checks.refuse(
            "observer", "'pid' or 'state': no sensor of a cell has the true contact torque", made.observer
        )


def _problem(
    path: finishing.Path | LiftedPath, table: Table, robot: finishing.Robot | None
) -> finishing.FinishingProblem:
    options = table.values(finishing.FinishingProblem, skip=("path", "model", "robot"))
    units = units_of(finishing.FinishingProblem)
    radius = table.given({"wrist_radius": units_of(finishing.Arm)["wrist_radius"]})
    if robot is not None:
        if radius:
            raise ValueError("tool.wrist_radius must be left out with a table [robot]; got both")
        options["robot"] = robot
    elif radius:
        options["robot"] = table.made(finishing.Arm.generic().replace, **radius)
    if table.has("pushed"):
        options["pushed"] = table.flag("pushed")
    searched = table.has("placement") and isinstance(table.take("placement"), str)
    if table.has("placement") and not searched:
        options["placement"] = tuple(table.list_of("placement", units["placement"]))
    if table.has("spin"):
        whole = isinstance(table.entries["spin"], int)
        options["spin"] = table.take("spin") if whole else tuple(table.list_of("spin", units["spin"]))
    box = table.take("placement_box") if table.has("placement_box") else None
    if searched:
        table.text("placement", ("search",))
    elif box is not None:
        raise ValueError(f'tool.placement_box must be left out unless placement = "search"; got {box!r}')
    table.done()
    problem = table.made(finishing.FinishingProblem, path, **options)
    return _placed(table, problem, box) if searched else problem


def _placed(table: Table, problem: finishing.FinishingProblem, box: Any) -> finishing.FinishingProblem:
    """Search a placement of the work."""
    announce("searching a placement of the work")
    found = table.made(finishing.place, problem, box=box)
    if not found.found:
        raise ValueError(f"{table.path('placement')} was searched: {found!r}")
    done: finishing.FinishingProblem = found.problem
    return done


def _program(table: Table, target: str) -> dict[str, Any]:
    """Options of a program, all optional, as a target takes them."""
    options: dict[str, Any] = {**table.given({"deviation": units_of(finishing.Path)["deviation"]})}
    options |= {key: table.take(key) for key in ("name", "date") if table.has(key)}
    if table.has("timing"):
        options["timing"] = table.flag("timing")
    table.done()
    table.made(check_options, target, **options)
    return options


def _axis(problem: finishing.FinishingProblem, table: Table) -> finishing.TorqueAxis:
    options = table.values(finishing.TorqueAxis, skip=("lever_arm",))
    table.done()
    return table.made(finishing.TorqueAxis, lever_arm=problem.lever_arm, **options)


def _settings(table: Table) -> dict[str, Any]:
    settings = {"normal_force": NORMAL_FORCE} | table.values(
        finishing.TorqueController, every=False, skip=("axis",)
    )
    table.made(
        checks.positive,
        "normal_force",
        settings["normal_force"],
        units_of(finishing.TorqueController)["normal_force"],
    )
    if table.has("prefilter"):
        settings["prefilter"] = table.flag("prefilter")
    table.done()
    return settings


def _study(table: Table) -> dict[str, Any]:
    """Options of a study, all optional."""
    levels: dict[str, Any] = {
        key: tuple(table.list_of(key, unit)) for key, unit in UNITS.items() if table.has(key)
    }
    levels |= table.given({"pitch": "mm"})
    levels |= {key: table.take(key) for key in ("pattern", "replicates") if table.has(key)}
    table.done()
    return levels


def _cell(problem: finishing.FinishingProblem, options: dict[str, Any], table: Table) -> FinishingCell:
    options = options | table.values(FinishingCell, skip=("problem", "truth", "axis", "target_force"))
    if table.has("truth"):
        options["truth"] = _truth(CellTruth.nominal(problem, options["axis"]), table.table("truth"))
    table.done()
    return table.made(FinishingCell, problem, **options)


def _truth(nominal: CellTruth, table: Table) -> CellTruth:
    """Truth of the cell where it differs from the belief."""
    changes = table.values(CellTruth, every=False, skip=("axis", "height", "table"))
    if table.has("axis"):
        changes["axis"] = _true_axis(nominal.axis, table.table("axis"))
    if table.has("table"):  # false: a table without error
        changes["table"] = (
            None if table.take("table") is False else table.table("table").one(finishing.timing.TableLoop)
        )
    if table.has("wave"):
        changes["height"] = _wave(table.table("wave"))
    table.done()
    return table.made(nominal.replace, **changes)


def _true_axis(believed: finishing.TorqueAxis, table: Table) -> finishing.TorqueAxis:
    changes = table.given({name: units_of(finishing.TorqueAxis)[name] for name in _HIDDEN})
    table.done()
    return table.made(believed.replace, **changes)


def _wave(table: Table) -> HeightField:
    """One wave on the surface."""
    table.need(*_WAVE)
    options: dict[str, Any] = {**table.numbers(_WAVE), **table.given({"phase": "rad"})}
    if table.has("direction"):
        options["direction"] = table.list_of("direction", "")
    wave = table.made(HeightField.wave, **options)
    table.done()
    return wave
