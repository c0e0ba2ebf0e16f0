"""Deflection and depth of damage against the infeed rate, as plain serial loops over numbers."""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

DECAY = 0.915
"""Of the peak temperature below a moving band, in units of sqrt(alpha l_c/v_w), where its Peclet number is 10 to 30."""
_OPTIONS: Any = {"cache": True, "nogil": True}


class Core(NamedTuple):
    """x = K0 + K1 v + K2 v^p; heat over what the surface stands (heat0 + heat1 v + heat2 v^p)/v^(1/4); z = reach v^(1/4) ln."""

    K0: float
    K1: float
    K2: float
    p: float
    heat0: float
    heat1: float
    heat2: float
    reach: float


@njit(inline="always", **_OPTIONS)
def beyond(v, core):
    """Deflection beyond what ploughing takes, y = x - K0, mm."""
    return core.K1 * v + core.K2 * v**core.p


@njit(inline="always", **_OPTIONS)
def burn_depth(v, core):
    """Depth of damage, mm; negative: what is left; v > 0."""
    root = v**0.25
    return core.reach * root * np.log((core.heat0 + core.heat1 * v + core.heat2 * v**core.p) / root)


@njit(**_OPTIONS)
def rate(y, core):
    """Infeed rate (mm/s) of a deflection y beyond ploughing: Newton in v^p, in which y is convex, from above."""
    if y <= 0.0:
        return 0.0
    q = 1.0 / core.p
    w = y / core.K2 if core.K2 > 0.0 else np.inf
    if core.K1 > 0.0:
        w = min(w, (y / core.K1) ** core.p)
    for _ in range(60):
        v = w**q
        step = (core.K1 * v + core.K2 * w - y) / (core.K1 * q * v / w + core.K2)
        w -= step
        if step <= 1e-15 * w:
            break
    return w**q


@njit(**_OPTIONS)
def rates(y, core):
    """The same of an array."""
    out = np.empty(y.size)
    for k in range(y.size):
        out[k] = rate(y[k], core)
    return out
