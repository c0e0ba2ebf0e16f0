"""Replay of a plan's commands through the dynamics, with a check of the limits."""

from dataclasses import dataclass

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._model.dynamics import allowed_rate, burn_depth, core_at
from sdpgrind.plunge._model.kernels import PlungeCore
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._plan.replay_kernels import COLUMNS, play

STEPS = 8  # chosen: Runge-Kutta steps per command
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


def replay(problem: CycleProblem, commands: Commands, margin: float) -> CycleReplay:
    """Replay the commands and measure the excess over the limit on burning."""
    model, wear = problem.model, problem.model.wear
    kept = commands.duration > 0
    rate, duration, rotation = (
        np.ascontiguousarray(x[kept]) for x in (commands.rate, commands.duration, commands.rotation)
    )
    core = core_at(model, rotation)
    laws = np.ascontiguousarray(np.broadcast_arrays(core.K1, core.K2, core.p, rate)[:3]).T.copy()
    wear_law = np.array(
        [
            model.wear_flat_area,
            *((0.0, 0.0, 1.0) if wear is None else (wear.growth, wear.exponent, wear.reference_rate)),
        ]
    )
    rows = (rate.size + SPARE) * (STEPS + 1)
    out, index = np.empty((rows, COLUMNS)), np.zeros(rows, dtype=np.int64)
    count = play(problem.stock, rate, duration, laws, wear_law, STEPS, SPARE, out, index)
    time, left, y, v, area = np.ascontiguousarray(out[:count].T)
    held = index[:count]
    touch = model.core.K0 / problem.command_rate_max
    excess = _excess(problem, v, left - margin, core_at(model, rotation[held], area))
    return CycleReplay(touch + time, np.maximum(left, 0.0), y, v, area, rate[held], rotation[held], excess)


def _excess(problem: CycleProblem, rate: Floats, depth: Floats, core: PlungeCore) -> float:
    """Greatest excess of damage over `depth`, mm; rates below the greatest without damage have none."""
    cold = allowed_rate(core, np.zeros(rate.size), 10 * problem.command_rate_max)
    burning = rate > cold
    over = burn_depth(np.where(burning, rate, cold), core) - np.maximum(depth, 0.0)
    return float(np.max(np.where(burning, over, 0.0), initial=0.0))
