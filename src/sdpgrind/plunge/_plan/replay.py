"""Replay of a plan's commands through the dynamics, with a check of the limits."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model.dynamics import allowed_rate, burn_depth, core_at
from sdpgrind.plunge._model.kernels import PlungeCore
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.doubted import DoubtedLimits
from sdpgrind.plunge._plan.replay_kernels import COLUMNS, play, play_by_stock

STEPS = 8  # chosen: Runge-Kutta steps per command
STEP = 1e-3  # chosen: step over the time of the stock at the greatest rate; 2e-3 changes no digit shown
MOST_ROWS = 200_000  # chosen: steps of a replay by stock; a stage that does not end within them is cut
SPARE = 40  # chosen: repetitions of the last command while stock is left


@dataclass(frozen=True)
class Commands:
    """Commanded rates (mm/s) from first touch, their durations (s), rotation during each (rad/s)."""

    rate: Floats
    duration: Floats
    rotation: Floats


@dataclass(frozen=True)
class CycleReplay:
    """Course of replayed commands over time (s) since the start of the feed, in mm, mm/s, rad/s."""

    time: Floats
    remaining: Floats
    y: Floats
    rate: Floats
    area: Floats
    command: Floats
    rotation: Floats
    excess: float  # greatest excess of damage over its limit, mm

    @property
    def left(self) -> float:
        """Remaining stock, mm."""
        return max(0.0, float(self.remaining[-1]))


def replay(
    problem: CycleProblem, commands: Commands, margin: float, doubted: DoubtedLimits | None = None
) -> CycleReplay:
    """Replay the commands and measure the excess over the limit on burning."""
    kept = commands.duration > 0
    rate, duration, rotation = (
        np.ascontiguousarray(x[kept]) for x in (commands.rate, commands.duration, commands.rotation)
    )
    rows = (rate.size + SPARE) * (STEPS + 1)
    out, index = np.empty((rows, COLUMNS)), np.zeros(rows, dtype=np.int64)
    laws, wear = _laws(problem, rotation, rate)
    count = play(problem.stock, rate, duration, laws, wear, STEPS, SPARE, out, index)
    return _replayed(problem, out[:count], (rate, rotation, index[:count]), margin, doubted)


def replay_by_stock(
    problem: CycleProblem,
    rate: Floats,
    ends: Floats,
    rotation: Floats,
    margin: float,
    doubted: DoubtedLimits | None = None,
) -> CycleReplay:
    """Replay rates (mm/s), each until the stock is down to its end (mm): a control switches by the gauge."""
    out, index = np.empty((MOST_ROWS, COLUMNS)), np.zeros(MOST_ROWS, dtype=np.int64)
    step = STEP * problem.stock / problem.command_rate_max
    laws, wear = _laws(problem, rotation, rate)
    count = play_by_stock(problem.stock, rate, ends, laws, wear, step, out, index)
    return _replayed(problem, out[:count], (rate, rotation, index[:count]), margin, doubted)


def _laws(problem: CycleProblem, rotation: Floats, rate: Floats) -> tuple[Floats, Floats]:
    """Coefficients of the deflection during each command, and of the wear."""
    core, wear = core_at(problem.model, rotation), problem.model.wear
    laws = np.ascontiguousarray(np.broadcast_arrays(core.K1, core.K2, core.p, rate)[:3]).T.copy()
    growth = (0.0, 0.0, 1.0) if wear is None else (wear.growth, wear.exponent, wear.reference_rate)
    return laws, np.array([problem.model.wear_flat_area, *growth, problem.model.wheel_wear])


def _replayed(
    problem: CycleProblem,
    rows: Floats,
    commands: tuple[Floats, Floats, Any],
    margin: float,
    doubted: DoubtedLimits | None,
) -> CycleReplay:
    """Course of the rows of a kernel, with the rates (mm/s), rotations (rad/s) and index of the commands."""
    time, left, y, v, area = np.ascontiguousarray(rows.T)
    rate, rotation, held = commands
    touch = problem.model.core.K0 / problem.command_rate_max
    if doubted is None:
        excess = _excess(problem, v, left - margin, core_at(problem.model, rotation[held], area))
    else:
        excess = _doubted_excess(doubted, v, left - margin)
    return CycleReplay(touch + time, np.maximum(left, 0.0), y, v, area, rate[held], rotation[held], excess)


def _excess(problem: CycleProblem, rate: Floats, depth: Floats, core: PlungeCore) -> float:
    """Greatest excess of damage over `depth`, mm; rates below the greatest without damage have none."""
    cold = allowed_rate(core, np.zeros(rate.size), 10 * problem.command_rate_max)
    burning = rate > cold
    over = burn_depth(np.where(burning, rate, cold), core) - np.maximum(depth, 0.0)
    return float(np.max(np.where(burning, over, 0.0), initial=0.0))


def _doubted_excess(limits: DoubtedLimits, rate: Floats, depth: Floats) -> float:
    """Greatest excess, mm, of what damage may reach by the doubts; rates that are always safe have none."""
    burning = rate > limits.burn_rate
    over = limits.depth(np.log(np.where(burning, rate, limits.burn_rate))) - np.maximum(depth, 0.0)
    return float(np.max(np.where(burning, over, 0.0), initial=0.0))
