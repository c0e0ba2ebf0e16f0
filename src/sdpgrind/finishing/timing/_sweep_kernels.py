"""Fastest course over a grid: squared feed x, linear between points, with slope 2 u, twice the acceleration.

A row r of the constraints, ``|p u + c x|`` <= 1, holds at both ends of every interval (Pham & Pham 2018).
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

TINY = 1e-13  # chosen: rounding of a row without u


@compiled
def _narrow(p, c, x, span):
    """Narrow span = (least u, its slope over x, greatest u, its slope, greatest x) by the rows of one end."""
    for r in range(p.size):
        if abs(p[r]) <= TINY:  # no bound of u
            if abs(c[r]) * span[4] > 1.0:
                span[4] = 1.0 / abs(c[r])
            continue
        slope, half = -c[r] / p[r], 1.0 / abs(p[r])
        if slope * x - half > span[0]:
            span[0], span[1] = slope * x - half, slope
        if slope * x + half < span[2]:
            span[2], span[3] = slope * x + half, slope


@compiled
def _span(p, c, p_next, c_next, step, x, cap, cap_next, span):
    """Accelerations allowed on an interval from x, so that it ends within [0, cap_next]."""
    span[0], span[1] = -x / (2 * step), -0.5 / step
    span[2], span[3] = (cap_next - x) / (2 * step), -0.5 / step
    span[4] = cap
    _narrow(p, c, x, span)
    _narrow(p_next, c_next, x, span)


@compiled
def _highest(p, c, p_next, c_next, step, cap, cap_next, span):
    """Greatest x with an allowed acceleration: Newton's method on a convex, piecewise linear function."""
    x = cap
    for _ in range(200):
        _span(p, c, p_next, c_next, step, x, cap, cap_next, span)
        if x > span[4]:
            x = span[4]
        elif span[0] <= span[2] + TINY * abs(span[2]):
            break
        else:
            x = max(x - (span[0] - span[2]) / (span[1] - span[3]), 0.0)
    return x


@compiled
def fastest(steps, p, c, cap, x):
    """Fill x (m,) with the fastest course from rest to rest: rows p, c (m, r), greatest x cap (m,)."""
    span, last = np.empty(5), cap.size - 1
    shifted = np.empty_like(p)  # rows of the next point in x of this one: x' = x + 2 h u
    for i in range(last):
        shifted[i + 1] = p[i + 1] + 2.0 * steps[i] * c[i + 1]
    x[last] = 0.0
    for i in range(last - 1, -1, -1):  # the greatest x from which rest can be reached
        x[i] = _highest(p[i], c[i], shifted[i + 1], c[i + 1], steps[i], cap[i], x[i + 1], span)
    x[0] = 0.0
    for i in range(last):  # the fastest course below it
        _span(p[i], c[i], shifted[i + 1], c[i + 1], steps[i], x[i], cap[i], x[i + 1], span)
        x[i + 1] = min(max(x[i] + 2.0 * steps[i] * span[2], 0.0), x[i + 1])
