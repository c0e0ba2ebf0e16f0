"""A weld-bead job as a TOML file: the planning problem and its stand.

Keys are names of the Python interface, numbers in the library's units or texts with a unit. The stand is the
force table with all three tiers, or that of one draw a pass with the sequence alone.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import numpy as np

from hwsim.command._toml import Table
from hwsim.command._toml import read as read_toml
from hwsim.command.base import Job as AreaJob
from hwsim.command.base import StandJob
from hwsim.plants._force_table.plant import ForceTableStand
from hwsim.plants._weldbead.plant import WeldBeadStand
from sdpgrind import sdp, units, weldbead
from sdpgrind.base import checks
from sdpgrind.base.quantities import specs, units_of
from sdpgrind.base.unit_text import quantity
from sdpgrind.weldbead import force, passes
from sdpgrind.weldbead.kernels import Motor, check_units

Problem: TypeAlias = weldbead.SequenceProblem
Policy: TypeAlias = weldbead.SequencePolicy
ANGLE, STIFFNESS, CROSSOVER = units.deg(20.0), 6e5, units.hz(3.0)
"""Relaxed angle (rad) and rotational stiffness (N mm/rad) of the disc, crossover (rad/s) of the force loop:
Brown (1988).
"""
WAVE, WAVE_LENGTH = 0.1, 40.0
"""Amplitude and length of waves of the bead, mm; chosen: no bead is level."""
_START = "height", "time"
_NODE = 0.1  # distance between nodes of a bead, mm; chosen: 400 nodes a wave
_SIDE = "linear, quadratic or constant (one of them), and tolerance, as { linear = 2.0 }"
_MOTORS: dict[str, Callable[[], Motor | None]] = {"process": lambda: None, "air": Motor.air}


class Job(AreaJob, Protocol):
    """A stand and its controller."""

    @property
    def start(self) -> tuple[float, float]:
        """Mean height (mm) and time to the deadline (s) at the start."""

    @property
    def assumed(self) -> tuple[str, ...]:
        """Which of height and time at the start nobody told."""


@dataclass(frozen=True)
class OneDraw(StandJob[WeldBeadStand]):
    """The sequence alone: the depth of each pass is drawn."""

    assumed: tuple[str, ...] = ()

    @property
    def start(self) -> tuple[float, float]:
        return self.stand.start_height, self.stand.start_time

    def controller(self, policy: Policy) -> weldbead.SequenceController:
        return weldbead.SequenceController(policy)


@dataclass(frozen=True)
class ThreeTiers:
    """Sequence, passes and force loop."""

    stand: ForceTableStand
    problem: Problem
    crossover: float = CROSSOVER
    assumed: tuple[str, ...] = ()

    @property
    def start(self) -> tuple[float, float]:
        return self.stand.problem.bead.mean, self.stand.start_time

    def controller(self, policy: Policy) -> weldbead.Hierarchy:
        loop = force.PI.design(crossover=self.crossover, drive=force.table_drive())
        return weldbead.Hierarchy(policy, self.stand.problem.disc, loop, lead_out=self.stand.lead_out)


def job_of(problem: Problem, *, simple: bool) -> Job:
    """Put a problem on a default stand."""
    plain = WeldBeadStand(problem)
    if simple:
        return OneDraw(plain, assumed=_START)
    disc = passes.TiltedDisc(problem.model, relaxed_angle=ANGLE, rotational_stiffness=STIFFNESS)
    on_table = _one_pass(problem, disc, _bead(problem, plain.start_height))
    stand = ForceTableStand(on_table, sequence=problem, time=plain.start_time)
    return ThreeTiers(stand, problem, assumed=_START)


def read(path: Path, *, simple: bool = False) -> Job:
    """Read the job in the file at `path`; ValueError names the file and the key."""
    one_draw, three_tiers = read_toml(path, lambda table: _stands(_problem(table), table))
    return one_draw if simple else three_tiers


def _bead(
    problem: Problem, height: float, wave: float | None = None, wave_length: float = WAVE_LENGTH
) -> passes.Contour:
    """A wavy bead of a mean height (mm), above the parent metal everywhere."""
    wave = checks.nonnegative("wave", min(WAVE, height / 2) if wave is None else wave, "mm")
    if wave_length < 10 * _NODE:
        raise checks.refuse("wave_length", f">= {10 * _NODE:g}", wave_length, "mm")
    x = np.linspace(0.0, problem.bead_length, math.ceil(problem.bead_length / _NODE) + 1)
    shape = np.sin(2 * np.pi * x / wave_length)
    z = height + wave * (shape - np.trapezoid(shape, x) / problem.bead_length)
    if z.min() <= 0:
        raise checks.refuse(
            "wave", f"small enough to leave metal everywhere on a bead of {height:g} mm", wave, "mm"
        )
    return passes.Contour(x, z)


def _one_pass(problem: Problem, disc: passes.TiltedDisc, contour: passes.Contour) -> passes.PassProblem:
    """Disc and bead of a stand; the sequence sets the depth of each pass."""
    feed = problem.feed_rate(problem.durations[-1])
    return passes.PassProblem(disc, contour, mean_cut=0.0, feed_rate=feed, normal_force_max=problem.force_max)


def _problem(job: Table) -> Problem:
    job.need(
        "process", "durations", "scatter", "height_charge", of=weldbead.SequenceProblem, skip=("burn_limit",)
    )
    return weldbead.SequenceProblem(
        _process(job.table("process", weldbead.GrindingProcess)),
        **job.values(weldbead.SequenceProblem, skip=("burn_limit",)),
        durations=job.list_of("durations", units_of(weldbead.SequenceProblem)["durations"]),
        scatter=_scatter(job.table("scatter", "attribution, relative_sd")),
        bead_scatter=_coefficients(job.table("bead_scatter")) if job.has("bead_scatter") else None,
        burn_limit=_burn_limit(job.table("burn_limit")) if job.has("burn_limit") else None,
        height_charge=_height_charge(job.table("height_charge", "under, over, each a table")),
        lateness_charge=_one_sided(job.table("lateness_charge", _SIDE), "s")
        if job.has("lateness_charge")
        else None,
        finish_charge=job.table("finish_charge").one(weldbead.FinishCharge)
        if job.has("finish_charge")
        else None,
    )


def _process(table: Table) -> weldbead.GrindingProcess:
    process = table.one(weldbead.GrindingProcess)
    table.made(check_units, process)
    return process


def _scatter(table: Table) -> weldbead.Scatter:
    table.need("attribution", "relative_sd")
    names, relative = table.take("attribution"), table.take("relative_sd")
    several = isinstance(names, list)
    sds = relative if isinstance(relative, list) else [relative]
    numbers = tuple(quantity(table.path("relative_sd"), value, "") for value in sds)
    options = table.values(weldbead.Scatter)
    if table.has("sample"):
        options["sample"] = tuple(table.list_of("sample", ""))
    table.done()
    return table.made(
        weldbead.Scatter,
        tuple(names) if several else names,
        numbers if several or len(numbers) != 1 else numbers[0],
        **options,
    )


def _coefficients(table: Table) -> weldbead.CoefficientScatter:
    options = table.values(weldbead.CoefficientScatter, every=False)
    if table.has("correlation"):
        options["correlation"] = _matrix(table.path("correlation"), table.take("correlation"))
    table.done()
    return table.made(weldbead.CoefficientScatter, **options)


def _matrix(name: str, given: Any) -> list[list[float]]:
    """Rows of a matrix of numbers."""
    if not isinstance(given, list) or not all(isinstance(row, list) for row in given):
        raise ValueError(f"{name} must be rows of a matrix, as [[1, 0], [0, 1]]; got {given!r}")
    return [
        [quantity(f"{name}[{i}][{j}]", value, "") for j, value in enumerate(row)]
        for i, row in enumerate(given)
    ]


def _height_charge(table: Table) -> sdp.Charge:
    sides = {
        side: _one_sided(table.table(side, _SIDE), "mm") for side in ("under", "over") if table.has(side)
    }
    table.done()
    return table.made(sdp.Charge, **sides)


def _one_sided(table: Table, unit: str) -> sdp.OneSided:
    """A charge: ``linear = 2.0``, ``quadratic = ...`` or ``constant = ...``, and a tolerance."""
    kinds: dict[str, tuple[Callable[..., sdp.OneSided], str]] = {
        "linear": (sdp.Linear, f"$/{unit}"),
        "quadratic": (sdp.Quadratic, f"$/{unit}^2"),
        "constant": (sdp.Constant, "$"),
    }
    named = [kind for kind in kinds if table.has(kind)]
    tolerance = table.given({"tolerance": unit})
    table.done()
    if len(named) != 1:
        raise ValueError(
            f"{table.name} must have one of {', '.join(kinds)}; got {', '.join(named) or 'none'}"
        )
    make, rate_unit = kinds[named[0]]
    rate = table.number(named[0], rate_unit)
    if rate < 0.0:
        raise checks.refuse(table.path(named[0]), ">= 0", rate, rate_unit)
    return table.made(make, rate, **tolerance)


def _burn_limit(table: Table) -> weldbead.sequence.BurnLimit:
    """Read the burn limit that `kind` names. Malkin's coefficients, both left out, are the printed ones."""
    limits = specs(weldbead.SequenceProblem)["burn_limit"].made_of
    cls = limits[table.text("kind", limits)]
    limit: weldbead.sequence.BurnLimit
    if cls is weldbead.MalkinBurnLimit and not (table.has("u0") or table.has("B")):
        limit = table.made(cls.published, **table.values(cls, skip=("u0", "B")))
        table.done()
    else:
        limit = table.one(cls)
    return limit


def _stands(problem: Problem, file: Table) -> tuple[OneDraw, ThreeTiers]:
    """Read both stands, so that faults in either are found."""
    disc = _disc(problem, file.maybe("disc"))
    loop = file.maybe("loop")
    crossover = loop.given({"crossover": "rad/s"}).get("crossover", CROSSOVER)
    loop.done()
    loop.made(force.PI.design, crossover=crossover)
    table = file.maybe("stand")
    start = _start(problem, table)
    process, truth = _truth(problem, table.maybe("truth"))
    simple = table.maybe("simple")
    plain = simple.made(
        WeldBeadStand,
        problem,
        truth=truth,
        **start,
        **_given(simple, WeldBeadStand, "height_noise", "power_noise", "force_noise"),
    )
    simple.done()
    stand = _force_table(problem, disc, process, table, plain)
    table.done()
    assumed = tuple(name for name in _START if name not in table.entries)
    return OneDraw(plain, assumed=assumed), ThreeTiers(stand, problem, crossover, assumed)


def _start(problem: Problem, table: Table) -> dict[str, float]:
    """Initial height (mm) and time (s), refused where the plan does not cover them."""
    start = _given(table, WeldBeadStand, "height", "time")
    if "height" in start and not 0 < start["height"] <= problem.height_max:
        raise checks.refuse(
            table.path("height"), f"> 0 and <= height_max = {problem.height_max:g}", start["height"], "mm"
        )
    if "time" in start and not 0 <= start["time"] <= problem.horizon:
        raise checks.refuse(
            table.path("time"), f">= 0 and <= horizon = {problem.horizon:g}", start["time"], "s"
        )
    return start


def _disc(problem: Problem, table: Table) -> passes.TiltedDisc:
    given = {"relaxed_angle": ANGLE, "rotational_stiffness": STIFFNESS} | _given(
        table, passes.TiltedDisc, "relaxed_angle", "rotational_stiffness"
    )
    table.done()
    return table.made(_tilted, problem.model, **given)


def _tilted(process: weldbead.GrindingProcess, **given: Any) -> passes.TiltedDisc:
    """A disc; a refusal of a value of the process names its table."""
    try:
        return passes.TiltedDisc(process, **given)
    except ValueError as error:
        own = str(error).partition(" ")[0] in specs(weldbead.GrindingProcess)
        raise ValueError(f"process.{error}" if own else str(error)) from None


def _truth(problem: Problem, table: Table) -> tuple[weldbead.GrindingProcess, Problem | None]:
    """The true process, and the problem with true process and scatter for the stand of one draw."""
    process = table.made(problem.model.replace, **table.values(weldbead.GrindingProcess, every=False))
    drawn = _scatter(table.table("scatter")) if table.has("scatter") else problem.scatter
    table.done()
    truth = table.made(problem.replace, scatter=drawn, model=process)
    return process, truth if table.entries else None


def _force_table(
    problem: Problem, disc: passes.TiltedDisc, process: Any, table: Table, plain: WeldBeadStand
) -> ForceTableStand:
    contour = table.made(
        _bead, problem, plain.start_height, **table.given({"wave": "mm", "wave_length": "mm"})
    )
    motor = _MOTORS[table.text("motor", _MOTORS)]() if table.has("motor") else None
    scatter = {
        name: _coefficients(table.table(name)) for name in ("pass_scatter", "bead_scatter") if table.has(name)
    }
    return table.made(
        ForceTableStand,
        table.made(_one_pass, problem, disc, contour),
        truth=disc.replace(model=process) if process != disc.model else None,
        sequence=problem,
        time=plain.start_time,
        motor=motor,
        **scatter,
        **_given(table, ForceTableStand, "runout", "lead_in", "lead_out"),
    )


def _given(table: Table, cls: type, *names: str) -> dict[str, float]:
    """Values in the table for numeric fields of a described class."""
    return table.given({name: units_of(cls)[name] for name in names})
