"""Interpolation in the tables of pushes, and its inverse."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

FINE = 0.25  # chosen: distance from 1 within which friction scales are evenly spaced; beyond, geometrically


@compiled(error_model="numpy")
def _scale_at(grid, j):
    """Friction scale at a fractional node."""
    return 1.0 + FINE * np.sinh(grid[2] + grid[3] * j)


@compiled(error_model="numpy")
def scale_cell(grid, scale, scales):
    """Cell of a friction scale among `scales` nodes, and the position in it."""
    j = min(max((np.arcsinh((scale - 1.0) / FINE) - grid[2]) / grid[3], 0.0), scales - 1.0)
    b = min(int(j), scales - 2)
    return b, j - b


@compiled(error_model="numpy")
def travel_at(table, grid, stroke, scale):
    """Travel (mm) of a push, bilinear in log stroke and `scale_cell`.

    `grid`: log first stroke, log step, first cell, step.
    """
    b, y = scale_cell(grid, scale, table.shape[1])
    return travel_in_cell(table, grid, stroke, b, y)


@compiled(error_model="numpy")
def travel_in_cell(table, grid, stroke, b, y):
    """`travel_at` where the cell of the scale, and the position in it, are known."""
    if stroke <= 0.0:
        return 0.0
    strokes = table.shape[0]
    i = min(max((np.log(stroke) - grid[0]) / grid[1], 0.0), strokes - 1.0)
    a = min(int(i), strokes - 2)
    x = i - a
    low = (1.0 - x) * table[a, b] + x * table[a + 1, b]
    return (1.0 - y) * low + y * ((1.0 - x) * table[a, b + 1] + x * table[a + 1, b + 1])


@compiled(error_model="numpy")
def stroke_for(mean, grid, last, scale, travel):
    """Least stroke (mm) with mean travel `travel` (mm) at a scale; infinite: none up to node `last`."""
    b, y = scale_cell(grid, scale, mean.shape[1])
    if (1.0 - y) * mean[last, b] + y * mean[last, b + 1] < travel:
        return np.inf
    low, high = -1, last
    while high - low > 1:  # at most 64
        middle = (low + high) // 2
        if (1.0 - y) * mean[middle, b] + y * mean[middle, b + 1] < travel:
            low = middle
        else:
            high = middle
    if low < 0:  # guard: the first stroke moves no part
        return np.exp(grid[0])
    left = (1.0 - y) * mean[low, b] + y * mean[low, b + 1]
    right = (1.0 - y) * mean[high, b] + y * mean[high, b + 1]
    return np.exp(grid[0] + grid[1] * (low + (travel - left) / (right - left)))
