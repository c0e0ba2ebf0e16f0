"""Reserve of a part against burning, from its readings: they are replayed through the controller's filter."""

from typing import Any

import numpy as np

from sdpgrind.plunge._control import state as at
from sdpgrind.plunge._control.control_kernels import start_control
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._identify.cycles import Cycle, cycles
from sdpgrind.plunge._learn.reserve_kernels import replayed_reserve
from sdpgrind.plunge._model.problem import CycleProblem


def reserve_of(part: Cycle, problem: CycleProblem, confidence: float = 0.999) -> float:
    """Rise of ln of the temperature that would damage the finished surface; inf: no contact."""
    law = CycleController(problem, confidence=confidence).law
    state = np.zeros(at.STATES)
    start_control(state, law)
    power = np.where(part.power_saturated > 0.0, np.nan, part.grinding_power)
    commands = np.nan_to_num(np.ascontiguousarray(part.command_rate, dtype=float))
    return float(replayed_reserve(state, law, part.size, power, commands, problem.model.burn_onset[0]))


def reserves(data: Any, problem: CycleProblem, part: int) -> float:
    """Reserve of one part of a log."""
    return reserve_of(cycles(data, power=True, part=part)[0], problem)
