"""A part replayed through the controller's filter, from its readings: state at the end, reserve."""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._control import state as at
from sdpgrind.plunge._control.control_kernels import start_control
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._control.filter_state import FILTER, STATES
from sdpgrind.plunge._identify.cycles import Cycle, cycles
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge.learning._replay_kernels import replayed_reserve

_LEAST = 0.5  # derived: the filter does not depend on the confidence; no safe rate is asked for


class ReplayedPart(NamedTuple):
    """Part as its filter saw it: estimates with covariance at the end (mixed units), reserve, contact."""

    mean: Floats
    covariance: Floats
    reserve: float
    touched: bool


def replayed(data: Any, problem: CycleProblem, part: int | None = None) -> ReplayedPart:
    """Replay a part of a log, or its first; its reserve is the rise of ln of temperature that damages it."""
    return _replay(cycles(data, power=True, part=part)[0], problem)


def _replay(part: Cycle, problem: CycleProblem) -> ReplayedPart:
    law = CycleController(problem, confidence=_LEAST).law
    state = np.zeros(at.STATES)
    start_control(state, law)
    power = np.where(part.power_saturated > 0.0, np.nan, part.grinding_power)
    commands = np.nan_to_num(np.ascontiguousarray(part.command_rate, dtype=float))
    reserve = replayed_reserve(state, law, part.size, power, commands, problem.model.burn_onset[0])
    found = state[at.FILTERED :].view(FILTER)[0]
    covariance = np.array(found["cov"]).reshape(STATES, STATES)
    return ReplayedPart(
        np.array(found["mean"]), covariance, float(reserve), bool(state[at.TOUCHED] == at.YES)
    )
