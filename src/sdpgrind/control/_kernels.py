"""Compiled step of a sampled feedback law with anti-windup, and the quantiser."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.compiling.compiled import compiled


class LawCore(NamedTuple):
    """u = C x + D e; x' = A x + B e + L (u applied - u): `L` feeds back what limits cut off the command."""

    A: Floats
    B: Floats
    C: Floats
    D: float
    L: Floats


@compiled(error_model="numpy")
def law_output(core, state, error):
    """Command of a law for an error, its state unchanged."""
    total = core.D * error
    for k in range(core.C.size):
        total += core.C[k] * state[k]
    return total


@compiled(error_model="numpy")
def law_update(core, state, error, missed, work):
    """Advance the state of a law in place; `missed` is the applied minus the requested command."""
    order = core.B.size
    for i in range(order):
        total = core.B[i] * error + core.L[i] * missed
        for k in range(order):
            total += core.A[i, k] * state[k]
        work[i] = total
    for i in range(order):
        state[i] = work[i]


@compiled
def quantised(value, quantum):
    """Round to the nearest multiple of `quantum`; 0: no rounding."""
    if quantum <= 0.0:
        return value
    return quantum * np.floor(value / quantum + 0.5)
