"""Largest circle with no point inside, by exchange: a circle held by three points shrinks to be empty."""

import numpy as np

from centering.roundness._distance_kernels import _crossing, _distance, _standing, _towards, extremes
from sdpgrind.base.compiling.compiled import compiled

_STEPS = 300  # chosen: exchanges at most
_HALF_ROOT_3 = 0.5 * np.sqrt(3.0)


@compiled
def empty_circle(x, y, cx, cy, tolerance, basis):
    """Exchange from a centre; return centre, radius (mm), whether three contacts hold it; writes `basis`."""
    if not _three_about(x, y, cx, cy, basis):
        return cx, cy, 0.0, False
    ox, oy = cx, cy
    cx, cy = _crossing(x, y, basis[0], basis[1], basis[0], basis[2])
    for _ in range(_STEPS):
        if np.isinf(cx):
            break
        radius = min(
            _distance(x, y, cx, cy, basis[0]),
            _distance(x, y, cx, cy, basis[1]),
            _distance(x, y, cx, cy, basis[2]),
        )
        _, _, near, least = extremes(x, y, cx, cy)
        if least >= radius - tolerance:
            if _standing(x, y, cx, cy, basis[0], basis[1], basis[2]) >= 0.0:
                return cx, cy, least, True
            break
        cx, cy = _shrink(x, y, cx, cy, near, basis)
    return ox, oy, 0.0, False


@compiled
def _three_about(x, y, cx, cy, basis):
    """Write three points whose triangle contains a centre; return whether they exist."""
    basis[0] = extremes(x, y, cx, cy)[2]
    dx, dy = x[basis[0]] - cx, y[basis[0]] - cy
    return _against(
        x, y, cx, cy, -0.5 * dx - _HALF_ROOT_3 * dy, _HALF_ROOT_3 * dx - 0.5 * dy, basis
    ) or _against(x, y, cx, cy, -dx, -dy, basis)


@compiled
def _against(x, y, cx, cy, ex, ey, basis):
    """Write the second point, most along a direction, and a third against both; return whether they hold."""
    basis[1] = _most_along(x, y, cx, cy, ex, ey)
    ax, ay = _towards(x, y, cx, cy, basis[0])
    bx, by = _towards(x, y, cx, cy, basis[1])
    sx, sy = ax + bx, ay + by
    if np.hypot(sx, sy) < 1e-9:  # opposite points: any third holds
        sx, sy = ay, -ax
    basis[2] = _most_along(x, y, cx, cy, -sx, -sy)
    return _standing(x, y, cx, cy, basis[0], basis[1], basis[2]) >= 0.0


@compiled
def _most_along(x, y, cx, cy, ex, ey):
    """Point that lies farthest along a direction from a centre."""
    best, most = 0, -np.inf
    for k in range(x.size):
        dx, dy = _towards(x, y, cx, cy, k)
        along = dx * ex + dy * ey
        if along > most:
            best, most = k, along
    return best


@compiled
def _shrink(x, y, old_x, old_y, new, basis):
    """Exchange a contact for a point inside the circle, with three about the old centre; return the new."""
    best, least, bx, by, out = -np.inf, -np.inf, np.inf, np.inf, 0
    for k in range(3):
        i, j, drop = basis[(k + 1) % 3], basis[(k + 2) % 3], basis[k]
        cx, cy = _crossing(x, y, new, i, new, j)
        if np.isinf(cx):
            continue
        stood = min(_standing(x, y, old_x, old_y, new, i, j), 0.0)
        outside = _distance(x, y, cx, cy, drop) - _distance(x, y, cx, cy, new)
        if stood > least or (stood == least and outside > best):
            best, least, bx, by, out = outside, stood, cx, cy, k
    basis[out] = new
    return bx, by
