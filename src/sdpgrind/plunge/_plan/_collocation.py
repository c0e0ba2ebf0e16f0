"""The fastest cycle as an optimal control problem, by Radau collocation in CasADi over a free time.

States: deflection beyond ploughing y, stock left r, wear flat area A; at each point of collocation w = v^p, in which
y = K1 w^(1/p) + K2(n, A) w is smooth. Controls, constant in each interval: the command, and the work's rotation where it may
be chosen. Intervals are of equal length: with phases of free lengths for full rate, balance and spark-out, which the exact
cycle suggests, a few intervals do more, but the program has many local minima. A point obeys the limit on burning where some
rate no less than its own makes no damage deeper than what will be ground off: that leaves out the artefact at very small
rates. With a safety margin a phase ends where the stock is the margin, so that neither side of that limit has a corner within
a phase. Where the rotation is free a last phase of one turn at least is ground at one rotation, as roundness is made in the
last turn.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.collocation import TURN, Guess, Program, Task
from sdpgrind.plunge._plan.cycle import SOLVED
from sdpgrind.plunge._plan.replay import Commands

INTERVALS = 240
IPOPT: dict[str, Any] = {
    "print_level": 0, "sb": "yes", "tol": 1e-8, "max_iter": 400, "max_wall_time": 10.0, "bound_relax_factor": 0.0,
}  # fmt: skip
"""Bounds are kept to the last bit: where multipliers are large, so is what relaxing one would gain."""
RESIDUAL = 1e-6
"""Violation of the optimality conditions, unknowns scaled to order 1, up to which a program counts as solved."""


@dataclass(frozen=True)
class Found:
    """A solution: commands, residual of the optimality conditions, iterations, what the solver says."""

    commands: Commands
    residual: float
    iterations: int
    message: str


def task(problem: CycleProblem, margin: float, rotation: tuple[float, float], intervals: int) -> Task:
    """The intervals shared out between the phases."""
    until = 2 * intervals // 3 if margin > 0 else intervals
    shared = (until, intervals - until)[: 1 + (margin > 0)]
    return Task(problem, margin, rotation, shared + ((TURN,) if rotation[1] > rotation[0] else ()))


def guess(job: Task) -> Guess:
    """A course of a rate that rises to a tenth below full rate and falls to next to nothing: no solution of anything."""
    problem, most = job.problem, job.problem.command_rate_max
    total = 2.0 * problem.stock / most
    share = np.linspace(0.0, 1.0, 201)
    rate = most * (0.9 * np.minimum(5 * share, 1.0) * (1 - share) + 0.02)
    left = problem.stock * (1 - share) ** 1.5
    met = [float(np.interp(-job.margin, -left, share))] if job.margin > 0 else []
    ends = np.array([0.0, *met, 1.0])
    if job.free:
        ends = np.append(0.98 * ends, 1.0)
    return Guess(total * share, left, problem.model.deflection(rate) - problem.model.core.K0, rate, total * ends)


def plainly(problem: CycleProblem, margin: float, rotation: tuple[float, float], intervals: int) -> Found:
    """Solve from the plain guess."""
    job = task(problem, margin, rotation, intervals)
    return solve(job, guess(job))


def solve(job: Task, start: Guess) -> Found:
    """Solve from a start, with the faster strategy of IPOPT, else with the other; where both fail, the last it reached."""
    found = _solve(job, start, "adaptive")
    return found if found.message == SOLVED else _solve(job, start, "monotone")


def _solve(job: Task, start: Guess, strategy: str) -> Found:
    import casadi

    nlp = Program(job, start)
    program = {"x": nlp.unknowns, "f": nlp.cost, "g": casadi.vertcat(*nlp.conditions)}
    solver = casadi.nlpsol("cycle", "ipopt", program, {"print_time": False, "ipopt": IPOPT | {"mu_strategy": strategy}})
    low, high = np.array(nlp.low), np.array(nlp.high)
    found = solver(x0=nlp.start, lbx=nlp.lower, ubx=nlp.upper, lbg=low, ubg=high)
    x, stats, residual = np.asarray(found["x"]).ravel(), solver.stats(), np.inf
    if np.all(np.isfinite(x)):
        residual = _residual(nlp, found, low, high)
    else:
        x = np.array(nlp.start)
    message = SOLVED if residual <= RESIDUAL else f"not solved: IPOPT says {stats['return_status']}"
    return Found(_commands(nlp, x), residual, int(stats["iter_count"]), message)


def _commands(nlp: Program, x: Floats) -> Commands:
    """Of a solution, each held for an interval."""
    parts = nlp.split(x)
    time = nlp.nodes(np.concatenate([[0.0], np.cumsum(parts["time"])]))
    command = np.clip(parts["command"], 0.0, nlp.job.problem.command_rate_max)
    return Commands(command, np.diff(time), parts.get("rotation", np.full(nlp.count, nlp.job.rotation[0])))


def _residual(nlp: Program, found: Any, low: Floats, high: Floats) -> float:
    """Largest violation of the conditions of Karush, Kuhn and Tucker, scaled as the unknowns are.

    Where multipliers are large on average (above 100) it is relative to them, as IPOPT has it.
    """
    import casadi

    g = casadi.vertcat(*nlp.conditions)
    price = casadi.SX.sym("price", g.shape[0])
    slope = casadi.Function("slope", [nlp.unknowns, price], [casadi.gradient(nlp.cost + casadi.dot(price, g), nlp.unknowns), g])
    flat, value = (np.asarray(part).ravel() for part in slope(found["x"], found["lam_g"]))
    x, of_x, of_g = (np.asarray(found[name]).ravel() for name in ("x", "lam_x", "lam_g"))
    size = max(1.0, float(np.mean(np.abs(np.concatenate([of_x, of_g])))) / 100)
    worst = float(np.max(np.abs(flat + of_x))) / size
    for at, bounds, prices in ((x, (np.array(nlp.lower), np.array(nlp.upper)), of_x), (value, (low, high), of_g)):
        room = np.maximum(prices, 0.0) * _finite(bounds[1] - at) + np.maximum(-prices, 0.0) * _finite(at - bounds[0])
        over = np.maximum(np.maximum(bounds[0] - at, at - bounds[1]), 0.0)
        worst = max(worst, float(np.max(np.abs(room))) / size, float(np.max(over)))
    return worst


def _finite(room: Floats) -> Floats:
    return np.where(np.isfinite(room), room, 1.0)
