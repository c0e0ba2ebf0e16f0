"""Readings of a part replayed through the controller's filter, compiled."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control import state as at
from sdpgrind.plunge._control.control_kernels import _follow_step
from sdpgrind.plunge._model.kernels import _worn, reserve


@compiled
def replayed_reserve(state, parameters, size, power, commands, coldest):
    """Least reserve of a part (ln of temperature) whose commands (mm/s) were given, not decided."""
    law, least = parameters.view(at.LAW)[0], np.inf
    for k in range(size.size):
        _follow_step(state, parameters, size[k], power[k], commands[k])
        if state[at.TOUCHED] != at.NO:
            core = _worn(law, state[at.SHARPNESS])
            least = min(least, reserve(state[at.RATE], state[at.REMAINING], coldest, core))
    return least
