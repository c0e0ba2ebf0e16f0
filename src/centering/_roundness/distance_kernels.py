"""What the exchanges share: the farthest and nearest point of a centre, bisectors, circles through points."""

from typing import Any

import numpy as np
from numba import njit

_OPTIONS: Any = {"cache": True, "nogil": True}


@njit(**_OPTIONS)
def extremes(x, y, cx, cy):
    """Farthest and nearest point of a centre: index and distance (mm) of the one, then of the other."""
    far, near, most, least = 0, 0, -1.0, np.inf
    for k in range(x.size):
        square = (x[k] - cx) * (x[k] - cx) + (y[k] - cy) * (y[k] - cy)
        if square > most:
            far, most = k, square
        if square < least:
            near, least = k, square
    return far, np.sqrt(most), near, np.sqrt(least)


@njit(**_OPTIONS)
def crossing(x, y, i, j, k, m):
    """Centre (mm) as far from point i as from j, and from k as from m; infinite where the bisectors are parallel."""
    ax, ay, bx, by = x[j] - x[i], y[j] - y[i], x[m] - x[k], y[m] - y[k]
    det = ax * by - ay * bx
    if abs(det) <= 1e-14 * (np.hypot(ax, ay) * np.hypot(bx, by)):
        return np.inf, np.inf
    midx, midy = 0.5 * (x[i] + x[j]), 0.5 * (y[i] + y[j])  # about a middle: digits are kept
    b = bx * (0.5 * (x[k] + x[m]) - midx) + by * (0.5 * (y[k] + y[m]) - midy)
    return midx - ay * b / det, midy + ax * b / det


@njit(**_OPTIONS)
def holds_origin(x, y, cx, cy, i, j, k):
    """Whether a centre lies in the triangle of three points, its border included up to rounding."""
    ax, ay, bx, by = x[i] - cx, y[i] - cy, x[j] - cx, y[j] - cy
    ex, ey = x[k] - cx, y[k] - cy
    one, two, three = ax * by - ay * bx, bx * ey - by * ex, ex * ay - ey * ax
    slack = 1e-13 * (abs(one) + abs(two) + abs(three))
    return (one >= -slack and two >= -slack and three >= -slack) or (one <= slack and two <= slack and three <= slack)
