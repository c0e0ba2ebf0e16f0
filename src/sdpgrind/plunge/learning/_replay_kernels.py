"""Readings of a part replayed through the controller's filter, compiled."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control import state as at
from sdpgrind.plunge._control.control_kernels import control_step
from sdpgrind.plunge._model.kernels import _worn, burn_depth


@compiled
def replayed_reserve(state, parameters, size, power, commands, coldest):
    """Least reserve of a part (ln of temperature) whose commands (mm/s) were given, not decided."""
    law, least = parameters.view(at.LAW)[0], np.inf
    for k in range(size.size):
        control_step(state, parameters, size[k], power[k])
        state[at.COMMAND] = commands[k]
        state[at.SECTION] = at.FULL_RATE
        rate = state[at.RATE]
        if rate > coldest and state[at.TOUCHED] != at.NO:
            core = _worn(law, state[at.SHARPNESS])
            left = max(state[at.REMAINING], 0.0) - burn_depth(rate, core)
            least = min(least, left / (core.reach * np.sqrt(np.sqrt(rate))))
    return least
