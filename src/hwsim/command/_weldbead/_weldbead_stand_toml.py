"""The stand of a weld-bead job in its TOML file: disc, bead, motor, scatter, and what it really is."""

from collections.abc import Callable
from typing import Any

from hwsim.command._toml import Table
from hwsim.command._weldbead import _weldbead_jobs as jobs
from hwsim.plants._force_table.plant import ForceTableStand
from hwsim.plants._weldbead.plant import WeldBeadStand
from sdpgrind import weldbead
from sdpgrind.base import checks
from sdpgrind.weldbead import force, passes
from sdpgrind.weldbead.kernels import CoefficientScatter, Motor

_DISC = {"relaxed_angle": "rad", "rotational_stiffness": "N mm/rad"}
_BEAD = {"wave": "mm", "wave_length": "mm"}
_TABLE = {"runout": "mm", "lead_in": "mm", "lead_out": "mm"}
_ONE_DRAW = {"height_noise": "mm", "power_noise": "W", "force_noise": "N"}
_MOTORS: dict[str, Callable[[], Motor | None]] = {"process": lambda: None, "air": Motor.air}
Scatters = Callable[[Table], weldbead.Scatter]


def job_of(problem: weldbead.SequenceProblem, file: Table, scatter: Scatters) -> tuple[jobs.OneDraw, jobs.ThreeTiers]:
    """Read both stands, that of one draw a pass and the force table, so that a fault is found whichever is run."""
    disc = _disc(problem, file.maybe("disc"))
    loop = file.maybe("loop")
    crossover = loop.given({"crossover": "rad/s"}).get("crossover", jobs.CROSSOVER)
    loop.done()
    loop.made(force.PI.design, crossover=crossover)
    table = file.maybe("stand")
    start = _start(problem, table)
    process, truth = _truth(problem, table.maybe("truth"), scatter)
    simple = table.maybe("simple")
    plain = simple.made(WeldBeadStand, problem, truth=truth, **start, **simple.given(_ONE_DRAW))
    simple.done()
    stand = _force_table(problem, disc, process, table, plain)
    table.done()
    return jobs.OneDraw(plain), jobs.ThreeTiers(stand, problem, crossover)


def _start(problem: weldbead.SequenceProblem, table: Table) -> dict[str, float]:
    """Height and time that the plan knows: what it does not, the machine would find only after the planning."""
    start = table.given({"height": "mm", "time": "s"})
    if "height" in start and not 0 < start["height"] <= problem.height_max:
        raise checks.refuse(table.path("height"), f"> 0 and <= height_max = {problem.height_max:g}", start["height"], "mm")
    if "time" in start and not 0 <= start["time"] <= problem.horizon:
        raise checks.refuse(table.path("time"), f">= 0 and <= horizon = {problem.horizon:g}", start["time"], "s")
    return start


def _disc(problem: weldbead.SequenceProblem, table: Table) -> passes.TiltedDisc:
    given = {"relaxed_angle": jobs.ANGLE, "rotational_stiffness": jobs.STIFFNESS} | table.given(_DISC)
    table.done()
    return table.made(passes.TiltedDisc, problem.model, **given)


def _truth(
    problem: weldbead.SequenceProblem, table: Table, scatter: Scatters
) -> tuple[weldbead.GrindingProcess, weldbead.SequenceProblem | None]:
    """What the process really is, and the same with the scatter of the stand of one draw."""
    process = table.made(problem.model.replace, **table.values(weldbead.GrindingProcess, every=False))
    drawn = scatter(table.table("scatter")) if table.has("scatter") else problem.scatter
    table.done()
    truth = table.made(problem.replace, scatter=drawn, model=process)
    return process, truth if table.entries else None


def _force_table(
    problem: weldbead.SequenceProblem, disc: passes.TiltedDisc, process: Any, table: Table, plain: WeldBeadStand
) -> ForceTableStand:
    contour = table.made(jobs.bead, problem, plain.start_height, **table.given(_BEAD))
    motor = _MOTORS[table.text("motor", _MOTORS)]() if table.has("motor") else None
    scatter = {name: _coefficients(table.table(name)) for name in ("pass_scatter", "bead_scatter") if table.has(name)}
    return table.made(
        ForceTableStand,
        table.made(jobs.one_pass, problem, disc, contour),
        truth=disc.replace(model=process) if process != disc.model else None,
        sequence=problem,
        time=plain.start_time,
        motor=motor,
        **scatter,
        **table.given(_TABLE),
    )


def _coefficients(table: Table) -> CoefficientScatter:
    given = table.given({"specific_energy": "", "idle_power": "", "friction_ratio": ""})
    table.done()
    return table.made(CoefficientScatter, **given)
