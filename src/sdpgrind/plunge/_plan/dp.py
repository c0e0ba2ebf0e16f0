"""Fastest cycle by dynamic programming over the remaining stock: an independent check of the exact plan.

A stage is an interval of stock; the state is the deflection beyond ploughing relative to the greatest from
which the rest can be ground. That limit is a node, and both ends of a control are exact: no command, and full
rate or the limit. Within a stage the deflection is linear in time. Nodes are dense near touch and near size;
the time then converges with second order in the stages.

With wear in proportion to the stock (`Wear` of exponent 0) the wear flat area is a function of the stage.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind import sdp
from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model import kernels as _kernels
from sdpgrind.plunge._model.dynamics import allowed_rate, core_at
from sdpgrind.plunge._model.kernels import PlungeCore
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.doubted import DoubtedLimits

STAGES = 200  # chosen: default number of stages
NODES, LEVELS = 121, 5  # chosen: nodes of the state and levels of the command at each
NEWTON = 40  # chosen: limit of the iterations, never needed near the root


@dataclass(frozen=True)
class StageSolution:
    """Commands (mm/s) and their durations (s) from first touch; value at the start, s."""

    command: Floats
    duration: Floats
    value: float


def stock_nodes(problem: CycleProblem, margin: float, stages: int) -> Floats:
    """Remaining stock at the stages, mm: geometric near the end, dense at the start, one at the margin."""
    scale = min(problem.final_rate, problem.command_rate_max)
    end = float(_kernels.beyond(scale, problem.model.core))
    share = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, stages + 1))
    left = end * np.expm1(share * np.log1p(problem.stock / end))
    if margin > 0:
        near = min(max(int(np.argmin(np.abs(left - margin))), 1), stages - 1)
        below = left <= left[near]
        above = margin + (left - left[near]) * (left[-1] - margin) / (left[-1] - left[near])
        left = np.where(below, left * margin / left[near], above)
    left[-1] = problem.stock
    return np.asarray(left)


class StageModel:
    """Stages, coefficients of the wheel, greatest deflection (mm) from which the rest can be ground."""

    def __init__(
        self, problem: CycleProblem, margin: float, stages: int, doubted: DoubtedLimits | None = None
    ) -> None:
        self.rate_max, self.left = problem.command_rate_max, stock_nodes(problem, margin, stages)
        self.drop, self.growth = np.diff(self.left), 1.0 + problem.model.wheel_wear
        ends = self._wheel(problem, self.left)
        middle = self._wheel(problem, self.left[1:] - 0.5 * self.drop)
        self.cores = [PlungeCore(*(float(x) for x in fields)) for fields in zip(*middle, strict=True)]
        if doubted is None:
            limit = allowed_rate(ends, np.maximum(self.left - margin, 0.0), self.rate_max)
        else:
            limit = np.array([doubted.rate_at(float(r)) for r in self.left])
        limit[0] = min(limit[0], problem.final_rate)
        y = _kernels.beyond.py_func(limit, ends)
        lost = self.growth * self.left  # of work and wheel
        self.most = np.minimum.accumulate(y - lost) + lost  # the wheel does not move back

    @staticmethod
    def _wheel(problem: CycleProblem, left: Floats) -> Any:
        """Coefficients at stocks `left`: a `PlungeCore` of arrays."""
        wear, area = problem.model.wear, problem.model.wear_flat_area
        growth = 0.0 if wear is None else wear.growth
        core: Any = core_at(problem.model, area=area + growth * (problem.stock - left))
        return core._make(np.broadcast_to(np.asarray(field, dtype=float), left.shape) for field in core)

    def time(self, stage: int, y: Floats, after: Floats) -> Floats:
        """Time (s) of a stage between two deflections (mm)."""
        core = self.cores[stage - 1]
        speed = mean_rate(_rates(y, core), _rates(after, core), core)
        return np.asarray(self.drop[stage - 1] / np.maximum(speed, 1e-12))

    def reach(self, stage: int, y: Floats) -> tuple[Floats, Floats]:
        """Least and greatest deflection (mm) after a stage: no command, and full rate or the limit."""
        drop, core, most = self.drop[stage - 1], self.cores[stage - 1], self.most[stage - 1]
        least = np.clip(y - self.growth * drop, 0.0, most)
        return least, np.maximum(least, np.minimum(self._full(y, _rates(y, core), drop, core, most), most))

    def _full(self, y: Floats, v: Floats, drop: float, core: PlungeCore, most: float) -> Floats:
        """Deflection at full rate, at most `most`: Newton on (y' - y + lost) mean rate = u drop."""
        w = np.full(y.shape, _rates(np.array([most]), core)[0] ** core.p)
        begin, lost = _point(v, v**core.p, core), self.growth * drop
        for _ in range(NEWTON):
            rate, after, _ = end = _point(w ** (1 / core.p), w, core)
            mean, rise = _mean(begin, end), after - y
            given = rise + lost
            off = given * mean - self.rate_max * drop
            bend = np.divide(rate - mean, rise, out=np.zeros(y.shape), where=np.abs(rise) > 1e-9 * after)
            slope = (mean + given * bend) * (core.K1 * rate / (core.p * w) + core.K2)
            step = np.divide(off, slope, out=np.zeros(y.shape), where=off > 0)
            w = w - step
            if np.all(step <= 1e-13 * w):
                break
        return np.asarray(core.K1 * w ** (1 / core.p) + core.K2 * w)


def _rates(y: Floats, core: PlungeCore) -> Floats:
    return np.asarray(_kernels.rates(np.ravel(y), core)).reshape(np.shape(y))


def _point(rate: Floats, power: Floats, core: PlungeCore) -> tuple[Floats, Floats, Floats]:
    """Rate v (mm/s), deflection y (mm) and integral of v dy, by the rate and its power v^p."""
    integral = rate * (core.K1 * rate / 2 + core.p / (core.p + 1) * core.K2 * power)
    return rate, core.K1 * rate + core.K2 * power, integral


def mean_rate(v: Floats, after: Floats, core: PlungeCore) -> Floats:
    """Mean of the rate over the deflection, mm/s: (G(v') - G(v))/(y' - y) with G the integral of v dy."""
    return _mean(_point(v, v**core.p, core), _point(after, after**core.p, core))


def _mean(begin: tuple[Floats, Floats, Floats], end: tuple[Floats, Floats, Floats]) -> Floats:
    """Mean of the rate between two points, mm/s; of equal ones the middle of both rates."""
    (v, y, before), (after, reached, gone) = begin, end
    differ = np.abs(after - v) > 1e-6 * (after + v)
    return np.divide(gone - before, reached - y, out=np.asarray(0.5 * (v + after)), where=differ)


def as_sdp(model: StageModel) -> sdp.Problem:
    """Cycle as a problem of stages (stock), one axis (relative deflection) and one move.

    The control is the share of the range of deflections not used; ties take the least, 0.
    """

    def begin(s: Any) -> tuple[int, Floats]:
        stage = round(float(np.ravel(s.left)[0]))
        return stage, np.asarray(s.fill) * model.most[stage]

    def step(s: Any, c: Any, e: Any) -> tuple[Any]:
        stage, y = begin(s)
        least, greatest = model.reach(stage, y)
        return ((greatest - c.spared * (greatest - least)) / model.most[stage - 1],)

    def time(s: Any, c: Any, n: Any) -> Floats:
        stage, y = begin(s)
        return model.time(stage, y, n.fill * model.most[stage - 1])

    return sdp.Problem(
        (sdp.Axis("fill", 0.0, 1.0, NODES, below="hold", above="hold"),),
        (
            sdp.Move(
                "feed",
                {"spared": sdp.Levels(0.0, 1.0, LEVELS)},
                sdp.Sampled(step, charge=time, compiled=False),
                timed=True,
            ),
        ),
        (sdp.Stop("size", lambda s: 0.0 * s.fill, allowed=lambda s: s.left < 0.5),),
        sdp.Stages(model.drop.size, 1.0, "left", ""),
    )


def solve(
    problem: CycleProblem, margin: float, stages: int = STAGES, doubted: DoubtedLimits | None = None
) -> StageSolution:
    """Solve, and follow the policy from first touch to size."""
    model = StageModel(problem, margin, stages, doubted)
    policy = sdp.plan(as_sdp(model))
    commands, durations, y = np.empty(stages), np.empty(stages), np.zeros(1)
    for k in range(stages):
        left = stages - k
        share = policy.action(fill=float(y[0] / model.most[left]), left=float(left)).controls["spared"]
        least, greatest = model.reach(left, y)
        after = greatest - share * (greatest - least)
        durations[k] = model.time(left, y, after)[0]
        commands[k] = (after[0] - y[0] + model.growth * model.drop[left - 1]) / durations[k]
        y = after
    commands = np.clip(commands, 0.0, problem.command_rate_max)  # rounding
    return StageSolution(commands, durations, float(policy.value(fill=0.0, left=float(stages))))
