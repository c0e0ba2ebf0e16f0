"""Fastest cycle as an optimal control problem of free duration: Radau collocation in CasADi.

States: deflection beyond ploughing y, remaining stock r, wear flat area A; at each collocation point also w =
v^p, in which y = K1 w^(1/p) + K2(n, A) w is smooth. Controls, constant per interval: the command and, where
it is free, the rotation. All intervals of a phase have equal length: phases of free length for full rate,
balance and spark-out would need fewer intervals, but have many local minima. A point keeps the limit on
burning if some rate not below its own makes no damage deeper than the stock still to come, which excludes the
artefact at very small rates. With a safety margin a phase ends where the stock equals it, so that the limit
is smooth within each phase. With a free rotation the last phase lasts at least one turn at one rotation, as
the last turn makes the part round.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebval

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model import kernels as _kernels
from sdpgrind.plunge._model.dynamics import burn_depth, core_at
from sdpgrind.plunge._model.kernels import PlungeCore
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.cycle import SOLVED
from sdpgrind.plunge._plan.doubted import DoubtedLimits
from sdpgrind.plunge._plan.replay import Commands

RADAU = np.array([[5 / 12, -1 / 12], [3 / 4, 1 / 4]])  # source: Radau IIA of two stages
TURN = 4  # chosen: intervals of the last turn with a free rotation
SHORTEST = 1e-3  # chosen: least duration of a phase over stock / command_rate_max; 0 would be singular
LOWEST = 1e-8  # chosen: least v^p over that at full rate; 0 has no derivative
INTERVALS = 240  # chosen: default number of intervals
# chosen: bounds are kept to the last bit, as relaxing them gains much where multipliers are large
IPOPT: dict[str, Any] = {
    "print_level": 0, "sb": "yes", "tol": 1e-8, "max_iter": 400, "max_wall_time": 10.0,
    "bound_relax_factor": 0.0,
}  # fmt: skip
RESIDUAL = 1e-6  # chosen: greatest scaled violation of the optimality conditions of a solved program


@dataclass(frozen=True)
class CollocationTask:
    """Problem, margin (mm), range of the rotation (rad/s), number of intervals of each phase, doubted limits.

    Phases: until the stock equals the margin; with a margin, from then on; with a free rotation, the last
    turn.
    """

    problem: CycleProblem
    margin: float
    rotation: tuple[float, float]
    intervals: tuple[int, ...]
    doubted: DoubtedLimits | None = None

    @property
    def phase(self) -> Any:
        """Phase of each interval."""
        return np.repeat(np.arange(len(self.intervals)), self.intervals)

    @property
    def free(self) -> bool:
        """Whether the rotation is free."""
        return self.rotation[1] > self.rotation[0]


class Guess(NamedTuple):
    """Initial course over time (s) since touch: stock, y (mm), rate (mm/s); ends of phases (s)."""

    time: Floats
    left: Floats
    y: Floats
    rate: Floats
    ends: Floats


class CollocationProgram:
    """Unknowns of order 1 with bounds and start; cost; conditions with bounds."""

    def __init__(self, job: CollocationTask, begin: Guess) -> None:
        self.job, self.model = job, job.problem.model
        self.phase, self.count = job.phase, sum(job.intervals)
        self.parts: dict[str, Any] = {}
        self.scale: dict[str, float] = {}
        self.lower: list[float] = []
        self.upper: list[float] = []
        self.start: list[float] = []
        self.conditions: list[Any] = []
        self.low: list[float] = []
        self.high: list[float] = []
        self._unknowns(begin)
        self._dynamics()
        self._ends()

    def _unknown(self, name: str, start: Any, low: float, high: float, scale: float) -> None:
        import casadi

        self.parts[name], self.scale[name] = casadi.SX.sym(name, len(start)), scale
        self.lower += [low / scale] * len(start)
        self.upper += [high / scale] * len(start)
        self.start += (np.clip(start, low, high) / scale).tolist()

    def _unknowns(self, begin: Guess) -> None:
        import casadi

        problem, model, core = self.job.problem, self.model, self.model.core
        most = problem.command_rate_max
        shortest = SHORTEST * problem.stock / most
        lasting = np.maximum(np.diff(begin.ends), shortest)
        nodes = self.nodes(begin.ends)
        steps = np.diff(nodes)
        inside = (nodes[:-1] + steps / 3, nodes[1:])

        def at(column: Floats, time: Floats) -> Floats:
            return np.asarray(np.interp(time, begin.time, column))

        self._unknown("time", lasting, shortest, np.inf, float(begin.ends[-1]) / lasting.size)
        if self.job.free:
            self.lower[-1] = 0.0  # the last phase is bounded by its turns
        self._unknown("y", at(begin.y, nodes), 0.0, np.inf, float(_kernels.beyond(most, core)))
        self._unknown("left", at(begin.left, nodes), -np.inf, np.inf, problem.stock)
        if model.wear is not None:
            self._unknown(
                "area", np.full(nodes.size, model.wear_flat_area), 0.0, np.inf, model.wear_flat_area
            )
        for name, time in {
            "1": inside[0],
            "2": inside[1],
            "0": nodes[1:-1] if self.job.free else nodes[:0],
        }.items():
            self._unknown(
                "w" + name, at(begin.rate, time) ** core.p, LOWEST * most**core.p, np.inf, most**core.p
            )
            self._unknown("room" + name, np.full(time.size, 0.1 * most), 0.0, np.inf, most)
        self._unknown("command", at(begin.rate, nodes[:-1] + steps / 2), 0.0, most, most)
        if self.job.free:
            middle = 0.5 * sum(self.job.rotation)
            self._unknown("rotation", np.full(self.count, middle), *self.job.rotation, middle)
        self.unknowns = casadi.vertcat(*self.parts.values())
        self.cost = casadi.sum1(self.parts["time"])

    def nodes(self, ends: Floats) -> Floats:
        """Times of the ends of the intervals."""
        pieces = [
            np.linspace(a, b, n + 1)[1:]
            for a, b, n in zip(ends[:-1], ends[1:], self.job.intervals, strict=True)
        ]
        return np.concatenate([[0.0], *pieces])

    def _get(self, name: str) -> Any:
        return self.parts[name] * self.scale[name]

    def _require(self, what: Any, low: float, high: float) -> None:
        """Add a condition for each entry of a column."""
        self.conditions.append(what)
        self.low += [low] * what.shape[0]
        self.high += [high] * what.shape[0]

    def _dynamics(self) -> None:
        import casadi

        model = self.model
        share = [1.0 / self.job.intervals[k] for k in self.phase]
        step = casadi.vec(self._get("time")[self.phase.tolist()]) * casadi.DM(share)
        rate = [self._rate(name) for name in "12"]
        growth = 1.0 + model.wheel_wear
        slopes = {"y": [self._get("command") - growth * v for v in rate], "left": [-v for v in rate]}
        if model.wear is not None:
            slopes["area"] = [model.wear.rate(v) for v in rate]
        stages = {name: self._stages(name, step, slope) for name, slope in slopes.items()}
        everywhere = slice(0, self.count)
        for k, name in enumerate("12"):
            self._point(name, {of: at[k] for of, at in stages.items()}, everywhere)
        if self.job.free:  # the rate jumps with the rotation, where an interval begins
            self._point("0", {of: self._get(of)[1:-1] for of in stages}, slice(1, self.count))
        for name, ends in stages.items():
            self._require((self._get(name)[1:] - ends[1]) / self.scale[name], 0.0, 0.0)

    def _rate(self, point: str) -> Any:
        """Infeed rate at one collocation point of each interval, mm/s."""
        return self._get("w" + point) ** (1 / self.model.core.p)

    def _point(self, point: str, state: dict[str, Any], intervals: slice) -> None:
        """Conditions at one point of intervals: rate from deflection, and the limit on burning."""
        rotation = self._get("rotation")[intervals] if self.job.free else self.job.rotation[0]
        core, rate = core_at(self.model, rotation, state.get("area")), self._rate(point)
        self._require(
            (state["y"] - core.K1 * rate - core.K2 * self._get("w" + point)) / self.scale["y"], 0.0, 0.0
        )
        hotter = rate + self._get("room" + point)
        depth = self._depth(state["left"], intervals)
        self._require((depth - self._burned(hotter, core)) / 0.1, 0.0, np.inf)

    def _burned(self, rate: Any, core: PlungeCore) -> Any:
        """Depth of damage, mm; with doubts within the range of rates that the polynomial is meant for."""
        import casadi

        doubted = self.job.doubted
        if doubted is None:
            return burn_depth(rate, core, casadi.log)
        for bound, sign in ((doubted.burn_rate, 1.0), (doubted.rate_max, -1.0)):
            self._require(sign * (rate - bound) / doubted.rate_max, 0.0, np.inf)
        return chebval(
            doubted.depth.mapparms()[0] + doubted.depth.mapparms()[1] * casadi.log(rate), doubted.depth.coef
        )

    def _stages(self, name: str, step: Any, slope: list[Any]) -> list[Any]:
        begin = self._get(name)[:-1]
        return [begin + step * (float(a) * slope[0] + float(b) * slope[1]) for a, b in RADAU]

    def _depth(self, left: Any, intervals: slice) -> Any:
        """Greatest depth of damage: stock less the margin, 0 from the margin on."""
        import casadi

        before = (self.phase == 0) | (self.job.margin == 0)
        return casadi.DM(before[intervals].astype(float).tolist()) * (left - self.job.margin)

    def _ends(self) -> None:
        problem, left = self.job.problem, self.parts["left"]
        self._require(self.parts["y"][0], 0.0, 0.0)
        self._require(left[0], 1.0, 1.0)
        self._require(left[-1], 0.0, 0.0)
        if "area" in self.parts:
            self._require(self.parts["area"][0], 1.0, 1.0)
        if self.job.margin > 0:
            self._require(left[self.job.intervals[0]] - self.job.margin / problem.stock, 0.0, 0.0)
        rotation: Any = self.job.rotation[0]
        if self.job.free:
            rotation, one = self._get("rotation")[-1], self.parts["rotation"][-TURN:]
            self._require(one[1:] - one[:-1], 0.0, 0.0)
            self._require(self._get("time")[-1] * rotation / (2 * np.pi), 1.0, 2.0)
        rate = self._rate("2")[-1]
        rounder = (
            (problem.roundness_max - self.model.roundness_base)
            / self.model.roundness_gain
            * rotation
            / (2 * np.pi)
        )
        self._require((rounder - rate) / problem.final_rate, 0.0, np.inf)

    def split(self, x: Floats) -> dict[str, Floats]:
        """Unknowns by name in their units."""
        ends = np.cumsum([part.shape[0] for part in self.parts.values()])[:-1]
        return {
            name: part * self.scale[name] for name, part in zip(self.parts, np.split(x, ends), strict=True)
        }


@dataclass(frozen=True)
class CollocationFound:
    """Solution: commands, residual of the optimality conditions, iterations, message of the solver."""

    commands: Commands
    residual: float
    iterations: int
    message: str


def task(
    problem: CycleProblem,
    margin: float,
    rotation: tuple[float, float],
    intervals: int,
    doubted: DoubtedLimits | None = None,
) -> CollocationTask:
    """Task with the intervals shared between the phases."""
    until = 2 * intervals // 3 if margin > 0 else intervals
    shared = (until, intervals - until)[: 1 + (margin > 0)]
    last = (TURN,) if rotation[1] > rotation[0] else ()
    return CollocationTask(problem, margin, rotation, shared + last, doubted)


def guess(job: CollocationTask) -> Guess:
    """Start: a rate that rises to nearly full rate and falls to nearly 0, inconsistent with the dynamics."""
    problem, most = job.problem, job.problem.command_rate_max
    total = 2.0 * problem.stock / most
    share = np.linspace(0.0, 1.0, 201)
    rate = most * (0.9 * np.minimum(5 * share, 1.0) * (1 - share) + 0.02)
    left = problem.stock * (1 - share) ** 1.5
    met = [float(np.interp(-job.margin, -left, share))] if job.margin > 0 else []
    ends = np.array([0.0, *met, 1.0])
    if job.free:
        ends = np.append(0.98 * ends, 1.0)
    return Guess(
        total * share, left, problem.model.deflection(rate) - problem.model.core.K0, rate, total * ends
    )


def solve_from_guess(
    problem: CycleProblem,
    margin: float,
    rotation: tuple[float, float],
    intervals: int,
    doubted: DoubtedLimits | None = None,
) -> CollocationFound:
    """Solve from `guess`."""
    job = task(problem, margin, rotation, intervals, doubted)
    return solve(job, guess(job))


def solve(job: CollocationTask, start: Guess) -> CollocationFound:
    """Solve by IPOPT's faster barrier strategy, after a failure by the other."""
    found = _solve(job, start, "adaptive")
    return found if found.message == SOLVED else _solve(job, start, "monotone")


def _solve(job: CollocationTask, start: Guess, strategy: str) -> CollocationFound:
    import casadi

    nlp = CollocationProgram(job, start)
    program = {"x": nlp.unknowns, "f": nlp.cost, "g": casadi.vertcat(*nlp.conditions)}
    ipopt = IPOPT | {"mu_strategy": strategy}
    # no_nlp_grad: how the optimum depends on data is not asked, and takes long to prepare
    options: dict[str, Any] = {"print_time": False, "no_nlp_grad": True, "ipopt": ipopt}
    solver = casadi.nlpsol("cycle", "ipopt", program, options)
    low, high = np.array(nlp.low), np.array(nlp.high)
    found = solver(x0=nlp.start, lbx=nlp.lower, ubx=nlp.upper, lbg=low, ubg=high)
    x, stats, residual = np.asarray(found["x"]).ravel(), solver.stats(), np.inf
    if np.all(np.isfinite(x)):
        residual = _residual(nlp, solver, found, low, high)
    else:
        x = np.array(nlp.start)
    message = SOLVED if residual <= RESIDUAL else f"not solved: IPOPT says {stats['return_status']}"
    return CollocationFound(_commands(nlp, x), residual, int(stats["iter_count"]), message)


def _commands(nlp: CollocationProgram, x: Floats) -> Commands:
    """Commands of a solution."""
    parts = nlp.split(x)
    time = nlp.nodes(np.concatenate([[0.0], np.cumsum(parts["time"])]))
    command = np.clip(parts["command"], 0.0, nlp.job.problem.command_rate_max)
    return Commands(command, np.diff(time), parts.get("rotation", np.full(nlp.count, nlp.job.rotation[0])))


def _residual(nlp: CollocationProgram, solver: Any, found: Any, low: Floats, high: Floats) -> float:
    """Greatest violation of the conditions of Karush, Kuhn and Tucker, scaled as the unknowns.

    Relative to the mean multiplier where that exceeds 100, as in IPOPT.
    """
    slope = solver.get_function("nlp_grad_f")(found["x"], [])[1]
    value, slopes = solver.get_function("nlp_jac_g")(found["x"], [])
    flat, value = (np.asarray(part).ravel() for part in (slope + slopes.T @ found["lam_g"], value))
    x, of_x, of_g = (np.asarray(found[name]).ravel() for name in ("x", "lam_x", "lam_g"))
    size = max(1.0, float(np.mean(np.abs(np.concatenate([of_x, of_g])))) / 100)
    worst = float(np.max(np.abs(flat + of_x))) / size
    for at, bounds, prices in (
        (x, (np.array(nlp.lower), np.array(nlp.upper)), of_x),
        (value, (low, high), of_g),
    ):
        room = np.maximum(prices, 0.0) * _finite(bounds[1] - at) + np.maximum(-prices, 0.0) * _finite(
            at - bounds[0]
        )
        over = np.maximum(np.maximum(bounds[0] - at, at - bounds[1]), 0.0)
        worst = max(worst, float(np.max(np.abs(room))) / size, float(np.max(over)))
    return worst


def _finite(room: Floats) -> Floats:
    return np.where(np.isfinite(room), room, 1.0)
