"""Fastest course over a grid: squared feed x, linear between points, with slope 2 u, twice the acceleration.

A row r of the constraints, ``|p u + c x|`` <= 1, holds at both ends of every interval (Pham & Pham 2018).
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

TINY = 1e-13  # chosen: rounding of a row without u


@compiled(error_model="numpy")
def _bounded(p, c, slope, half, top):
    """Note a row as bounds of u, ``slope x -+ half``; return `top`, less where it is a row without u."""
    if abs(p) <= TINY:
        slope[0], half[0] = 0.0, np.inf
        return 1.0 / abs(c) if abs(c) * top > 1.0 else top
    slope[0], half[0] = -c / p, 1.0 / abs(p)
    return top


@compiled(error_model="numpy")
def _bounds(steps, p, c, cap, slope, half, top):
    """Fill slope, half (m - 1, 2 r) and the greatest x (m - 1,) with the rows of both ends of every interval.

    Those of the far end are taken in x of the near one: x' = x + 2 h u.
    """
    rows = p.shape[1]
    for i in range(steps.size):
        top[i] = cap[i]
        for r in range(rows):
            top[i] = _bounded(p[i, r], c[i, r], slope[i, r:], half[i, r:], top[i])
        for r in range(rows):
            far = p[i + 1, r] + 2.0 * steps[i] * c[i + 1, r]
            top[i] = _bounded(far, c[i + 1, r], slope[i, rows + r :], half[i, rows + r :], top[i])


@compiled(error_model="numpy")
def _span(slope, half, step, x, cap_next):
    """Least u on an interval from x, its slope over x, greatest u, its slope; x ends in [0, cap_next]."""
    low, fall, high, rise = -x / (2 * step), -0.5 / step, (cap_next - x) / (2 * step), -0.5 / step
    for r in range(slope.size):
        middle = slope[r] * x
        if middle - half[r] > low:
            low, fall = middle - half[r], slope[r]
        if middle + half[r] < high:
            high, rise = middle + half[r], slope[r]
    return low, fall, high, rise


@compiled(error_model="numpy")
def _highest(slope, half, step, cap, top, cap_next):
    """Greatest x with an allowed acceleration: Newton's method on a convex, piecewise linear function."""
    x = cap
    for _ in range(200):
        low, fall, high, rise = _span(slope, half, step, x, cap_next)
        if x > top:
            x = top
        elif low <= high + TINY * abs(high):
            break
        else:
            x = max(x - (low - high) / (fall - rise), 0.0)
    return x


@compiled(error_model="numpy")
def fastest(steps, p, c, cap, x):
    """Fill x (m,) with the fastest course from rest to rest: rows p, c (m, r), greatest x cap (m,)."""
    last, rows = steps.size, p.shape[1]
    slope, half, top = np.empty((last, 2 * rows)), np.empty((last, 2 * rows)), np.empty(last)
    _bounds(steps, p, c, cap, slope, half, top)
    x[last] = 0.0
    for i in range(last - 1, -1, -1):  # the greatest x from which rest can be reached
        x[i] = _highest(slope[i], half[i], steps[i], cap[i], top[i], x[i + 1])
    x[0] = 0.0
    for i in range(last):  # the fastest course below it
        greatest = _span(slope[i], half[i], steps[i], x[i], x[i + 1])[2]
        x[i + 1] = min(max(x[i] + 2.0 * steps[i] * greatest, 0.0), x[i + 1])
