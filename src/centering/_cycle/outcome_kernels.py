"""Tables of what pushes do, read between their nodes, and inverted."""

from typing import Any

import numpy as np
from numba import njit

_OPTIONS: Any = {"cache": True, "nogil": True}


@njit(**_OPTIONS)
def travel_at(table, grid, stroke, scale):
    """Travel (mm) of a push, bilinear in log stroke and scale; `grid` = (log first stroke, log step, first scale, step)."""
    if stroke <= 0.0:
        return 0.0
    strokes, scales = table.shape
    i = min(max((np.log(stroke) - grid[0]) / grid[1], 0.0), strokes - 1.0)
    j = min(max((scale - grid[2]) / grid[3], 0.0), scales - 1.0)
    a, b = min(int(i), strokes - 2), min(int(j), scales - 2)
    x, y = i - a, j - b
    low = (1.0 - x) * table[a, b] + x * table[a + 1, b]
    return (1.0 - y) * low + y * ((1.0 - x) * table[a, b + 1] + x * table[a + 1, b + 1])


@njit(**_OPTIONS)
def stroke_for(mean, grid, last, scale, travel):
    """Least stroke (mm) whose mean travel reaches `travel` (mm) at a scale; infinite where no stroke up to node `last` does."""
    scales = mean.shape[1]
    j = min(max((scale - grid[2]) / grid[3], 0.0), scales - 1.0)
    b = min(int(j), scales - 2)
    y = j - b
    if (1.0 - y) * mean[last, b] + y * mean[last, b + 1] < travel:
        return np.inf
    low, high = -1, last
    while high - low > 1:
        middle = (low + high) // 2
        if (1.0 - y) * mean[middle, b] + y * mean[middle, b + 1] < travel:
            low = middle
        else:
            high = middle
    if low < 0:
        return np.exp(grid[0])
    left = (1.0 - y) * mean[low, b] + y * mean[low, b + 1]
    right = (1.0 - y) * mean[high, b] + y * mean[high, b + 1]
    return np.exp(grid[0] + grid[1] * (low + (travel - left) / (right - left)))
