"""Two concentric circles that hold all points closest between them, by exchange of two outer and two inner contacts."""

from typing import Any

import numpy as np
from numba import njit

from centering._roundness.distance_kernels import crossing, extremes

_OPTIONS: Any = {"cache": True, "nogil": True}
_STEPS = 500


@njit(**_OPTIONS)
def zone(x, y, tolerance, basis):
    """Centre, outer and inner radius (mm), and whether the exchange from `basis` (4,), two outer and two inner, has come to an end.

    Each centre is the exact one of its four contacts, at the crossing of two bisectors, so that nothing is linearised.
    """
    cx, cy = crossing(x, y, basis[0], basis[1], basis[2], basis[3])
    for _ in range(_STEPS):
        if np.isinf(cx):
            break
        outer, inner = np.hypot(x[basis[0]] - cx, y[basis[0]] - cy), np.hypot(x[basis[2]] - cx, y[basis[2]] - cy)
        far, most, near, least = extremes(x, y, cx, cy)
        if most - outer <= tolerance and inner - least <= tolerance:
            return cx, cy, outer, inner, True
        if most - outer >= inner - least:
            cx, cy = _enter(x, y, cx, cy, far, basis, 0)
        else:
            cx, cy = _enter(x, y, cx, cy, near, basis, 2)
    return cx, cy, 0.0, 0.0, False


@njit(**_OPTIONS)
def _enter(x, y, old_x, old_y, new, basis, side):
    """Take a point in for one of the two contacts on its circle, so that contacts alternate and the other lies within; the centre."""
    sign = 1.0 if side == 0 else -1.0
    i, j = basis[2 - side], basis[3 - side]
    best, bx, by, out = -np.inf, np.inf, np.inf, 0
    for k in range(2):
        keep, drop = basis[side + 1 - k], basis[side + k]
        cx, cy = crossing(x, y, new, keep, i, j)
        if np.isinf(cx) or not alternate(x, y, old_x, old_y, new, keep, i, j):
            continue
        room = sign * (np.hypot(x[new] - cx, y[new] - cy) - np.hypot(x[drop] - cx, y[drop] - cy))
        if room > best:
            best, bx, by, out = room, cx, cy, k
    basis[side + out] = new
    return bx, by


@njit(**_OPTIONS)
def alternate(x, y, cx, cy, p, q, i, j):
    """Whether points i and j part p from q in direction as a centre sees them, up to rounding."""
    ux, uy = _towards(x, y, cx, cy, i)
    vx, vy = _towards(x, y, cx, cy, j)
    px, py = _towards(x, y, cx, cy, p)
    qx, qy = _towards(x, y, cx, cy, q)
    one, two = (vx - ux) * (py - uy) - (vy - uy) * (px - ux), (vx - ux) * (qy - uy) - (vy - uy) * (qx - ux)
    return min(one, two) <= 1e-15 and max(one, two) >= -1e-15


@njit(**_OPTIONS)
def _towards(x, y, cx, cy, k):
    """Unit vector from a centre to a point."""
    dx, dy = x[k] - cx, y[k] - cy
    distance = np.hypot(dx, dy)
    return dx / distance, dy / distance
