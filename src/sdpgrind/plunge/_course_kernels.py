"""What the model does under a recorded command, as a plain serial loop over numbers."""

from typing import Any

import numpy as np
from numba import njit

from sdpgrind.plunge._kernels import rate

_OPTIONS: Any = {"cache": True, "nogil": True}


@njit(**_OPTIONS)
def deflections(first, command_rate, step, substeps, core):
    """Deflection beyond ploughing (mm) at each reading, from the first one on; commands (mm/s) hold for a step (s)."""
    out = np.empty(step.size + 1)
    out[0] = y = first
    for k in range(step.size):
        u, left = command_rate[k], step[k]
        if y < 0.0:  # not touching, or ploughing: there in a straight line
            reached = y + u * left
            y, left = min(reached, 0.0), max(reached, 0.0) / u if reached > 0.0 else 0.0
        h = left / substeps
        for _ in range(substeps if left > 0.0 else 0):
            a = u - rate(y, core)
            b = u - rate(y + 0.5 * h * a, core)
            c = u - rate(y + 0.5 * h * b, core)
            y += h / 6.0 * (a + 2.0 * b + 2.0 * c + u - rate(y + h * c, core))
        out[k + 1] = y
    return out
