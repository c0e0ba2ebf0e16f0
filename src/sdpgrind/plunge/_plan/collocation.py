"""The optimal control problem of a cycle as a nonlinear program, by Radau collocation, in symbols of CasADi."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model import kernels as _kernels
from sdpgrind.plunge._model.dynamics import burn_depth, core_at
from sdpgrind.plunge._model.problem import CycleProblem

RADAU = np.array([[5 / 12, -1 / 12], [3 / 4, 1 / 4]])
TURN = 4
"""Intervals of the last turn where the rotation is free."""
SHORTEST = 1e-3
"""Time of a phase, relative to that in which the command gives the stock."""
LOWEST = 1e-8
"""Of v^p, relative to that at full rate."""


@dataclass(frozen=True)
class Task:
    """What is to be solved: problem, margin (mm), range of the rotation (rad/s), and the intervals of each phase.

    Phases: until the stock is the margin; with a margin, from then on; with a free rotation, the last turn.
    """

    problem: CycleProblem
    margin: float
    rotation: tuple[float, float]
    intervals: tuple[int, ...]

    @property
    def phase(self) -> Any:
        """Phase of each interval."""
        return np.repeat(np.arange(len(self.intervals)), self.intervals)

    @property
    def free(self) -> bool:
        """Whether the rotation may be chosen."""
        return self.rotation[1] > self.rotation[0]


class Guess(NamedTuple):
    """A course to begin from, over time (s) from the first touch: stock left, y (mm), infeed rate (mm/s); ends of phases."""

    time: Floats
    left: Floats
    y: Floats
    rate: Floats
    ends: Floats


class Program:
    """The unknowns, all of order 1, with bounds and start; what is to be least; and conditions with bounds."""

    def __init__(self, job: Task, begin: Guess) -> None:
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
            self.lower[-1] = 0.0  # turns, not time, are asked of the last
        self._unknown("y", at(begin.y, nodes), 0.0, np.inf, float(_kernels.beyond(most, core)))
        self._unknown("left", at(begin.left, nodes), -np.inf, np.inf, problem.stock)
        if model.wear is not None:
            self._unknown("area", np.full(nodes.size, model.wear_flat_area), 0.0, np.inf, model.wear_flat_area)
        for name, time in {"1": inside[0], "2": inside[1], "0": nodes[1:-1] if self.job.free else nodes[:0]}.items():
            self._unknown("w" + name, at(begin.rate, time) ** core.p, LOWEST * most**core.p, np.inf, most**core.p)
            self._unknown("room" + name, np.full(time.size, 0.1 * most), 0.0, np.inf, most)
        self._unknown("command", at(begin.rate, nodes[:-1] + steps / 2), 0.0, most, most)
        if self.job.free:
            middle = 0.5 * sum(self.job.rotation)
            self._unknown("rotation", np.full(self.count, middle), *self.job.rotation, middle)
        self.unknowns = casadi.vertcat(*self.parts.values())
        self.cost = casadi.sum1(self.parts["time"])

    def nodes(self, ends: Floats) -> Floats:
        """Times of the ends of the intervals."""
        pieces = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(ends[:-1], ends[1:], self.job.intervals, strict=True)]
        return np.concatenate([[0.0], *pieces])

    def _get(self, name: str) -> Any:
        return self.parts[name] * self.scale[name]

    def _require(self, what: Any, low: float, high: float) -> None:
        """A condition for each entry of a column."""
        self.conditions.append(what)
        self.low += [low] * what.shape[0]
        self.high += [high] * what.shape[0]

    def _dynamics(self) -> None:
        import casadi

        model = self.model
        share = [1.0 / self.job.intervals[k] for k in self.phase]
        step = casadi.vec(self._get("time")[self.phase.tolist()]) * casadi.DM(share)
        rate = [self._rate(name) for name in "12"]
        slopes = {"y": [self._get("command") - v for v in rate], "left": [-v for v in rate]}
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
        """Infeed rate at one point of each interval, mm/s."""
        return self._get("w" + point) ** (1 / self.model.core.p)

    def _point(self, point: str, state: dict[str, Any], intervals: slice) -> None:
        """At one point of intervals: the deflection belongs to the rate, and what burns will be ground off."""
        import casadi

        rotation = self._get("rotation")[intervals] if self.job.free else self.job.rotation[0]
        core, rate = core_at(self.model, rotation, state.get("area")), self._rate(point)
        self._require((state["y"] - core.K1 * rate - core.K2 * self._get("w" + point)) / self.scale["y"], 0.0, 0.0)
        hotter = rate + self._get("room" + point)
        depth = self._depth(state["left"], intervals)
        self._require((depth - burn_depth(hotter, core, casadi.log)) / 0.1, 0.0, np.inf)

    def _stages(self, name: str, step: Any, slope: list[Any]) -> list[Any]:
        begin = self._get(name)[:-1]
        return [begin + step * (float(a) * slope[0] + float(b) * slope[1]) for a, b in RADAU]

    def _depth(self, left: Any, intervals: slice) -> Any:
        """How deep the damage may go: what is left less the margin, and nothing from there on."""
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
        rounder = (problem.roundness_max - self.model.roundness_base) / self.model.roundness_gain * rotation / (2 * np.pi)
        self._require((rounder - rate) / problem.final_rate, 0.0, np.inf)

    def split(self, x: Floats) -> dict[str, Floats]:
        """The unknowns by name, in their own units."""
        ends = np.cumsum([part.shape[0] for part in self.parts.values()])[:-1]
        return {name: part * self.scale[name] for name, part in zip(self.parts, np.split(x, ends), strict=True)}
