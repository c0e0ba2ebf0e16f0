"""What the model does under a recorded command, as a plain serial loop over numbers."""

from typing import Any

import numpy as np
from numba import njit

from sdpgrind.plunge._kernels import deflected, rate

_OPTIONS: Any = {"cache": True, "nogil": True}


@njit(**_OPTIONS)
def deflections(first, command_rate, step, substeps, core):
    """Deflection beyond ploughing (mm) and rate (mm/s) at each reading; commands (mm/s) hold for a step (s)."""
    out = np.empty((step.size + 1, 2))
    y, v = first, rate(first, core)
    out[0, 0], out[0, 1] = y, v
    for k in range(step.size):
        y, v = deflected(y, v, command_rate[k], step[k], substeps, core)
        out[k + 1, 0], out[k + 1, 1] = y, v
    return out


@njit(**_OPTIONS)
def lags(first, pole, given):
    """What a lag holds (mm) at each reading, from the first on: x+ = pole x + given."""
    out = np.empty(pole.size + 1)
    out[0] = first
    for k in range(pole.size):
        out[k + 1] = pole[k] * out[k] + given[k]
    return out
