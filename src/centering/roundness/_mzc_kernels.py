"""Minimum zone of two concentric circles, by exchange of two outer and two inner contacts."""

import numpy as np

from centering.roundness._direction_kernels import _four_about
from centering.roundness._distance_kernels import _crossing, _distance, _parting, extremes
from sdpgrind.base.compiling.compiled import compiled

_STEPS = 300  # chosen: exchanges at most


@compiled
def zone(x, y, cx, cy, tolerance, basis):
    """Exchange from a centre; return the best centre, its width (mm), and whether its contacts are optimal.

    Every centre is exact for its four contacts, where two bisectors cross. Writes two outer and two inner
    contacts to `basis` (4,). `tolerance`: rounding of a distance, mm, as `_exchange.rounding` has it.
    """
    _four_about(x, y, cx, cy, basis)
    _, most, _, least = extremes(x, y, cx, cy)
    best, bx, by = most - least, cx, cy
    cx, cy = _crossing(x, y, basis[0], basis[1], basis[2], basis[3])
    for _ in range(_STEPS):
        if np.isinf(cx):
            break
        outer = max(_distance(x, y, cx, cy, basis[0]), _distance(x, y, cx, cy, basis[1]))
        inner = min(_distance(x, y, cx, cy, basis[2]), _distance(x, y, cx, cy, basis[3]))
        far, most, near, least = extremes(x, y, cx, cy)
        if most - least < best:
            best, bx, by = most - least, cx, cy
        if most - outer <= tolerance and inner - least <= tolerance:
            return cx, cy, most - least, _parting(x, y, cx, cy, basis[0], basis[1], basis[2], basis[3]) >= 0.0
        new, side = (far, 0) if most - outer >= inner - least else (near, 2)
        cx, cy = _enter(x, y, cx, cy, new, basis, side)
    return bx, by, best, False


@compiled
def _enter(x, y, old_x, old_y, new, basis, side):
    """Exchange a contact on one side for a new point so that contacts alternate; return the new centre."""
    sign = 1.0 if side == 0 else -1.0
    i, j = basis[2 - side], basis[3 - side]
    best, least, bx, by, out = -np.inf, -np.inf, np.inf, np.inf, 0
    for k in range(2):
        keep, drop = basis[side + 1 - k], basis[side + k]
        cx, cy = _crossing(x, y, new, keep, i, j)
        if np.isinf(cx):
            continue
        parted = min(_parting(x, y, old_x, old_y, new, keep, i, j), 0.0)
        room = sign * (_distance(x, y, cx, cy, new) - _distance(x, y, cx, cy, drop))
        if parted > least or (parted == least and room > best):
            best, least, bx, by, out = room, parted, cx, cy, k
    basis[side + out] = new
    return bx, by
