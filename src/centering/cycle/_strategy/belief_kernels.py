"""Bayes' rule for the friction scale of a part, on the scales of the tables and a grid over the push."""

import numpy as np

from centering.cycle._strategy.outcome_kernels import _scale_at, scale_cell
from sdpgrind.base.compiling.compiled import compiled

_PUSHES = 17  # chosen: nodes of the friction scale of the push
_REACH = 4.0  # chosen: half width of their grid, in standard deviations
_FAR = 50.0  # chosen: squared standard deviations beyond which a value contradicts every friction


@compiled
def push_cells(grid, scales, push_sd):
    """Cells and positions of friction scales of pushes, which scatter about each part's: (scales, pushes)."""
    cells, places = np.empty((scales, _PUSHES), np.int64), np.empty((scales, _PUSHES))
    each = 2.0 * _REACH / (_PUSHES - 1)
    for i in range(scales):
        part = _scale_at(grid, i)
        for j in range(_PUSHES):
            cells[i, j], places[i, j] = scale_cell(grid, part * (1.0 + push_sd * (each * j - _REACH)), scales)
    return cells, places


@compiled
def _likelihood(expected, cells, places, noise, seen):
    """Density of what is seen, up to a factor, of a part with a friction scale; the push scatters about it.

    Between two grid points of the push a value is spread over their distance, which may exceed the noise.
    """
    kinds, each = seen.size, 2.0 * _REACH / (_PUSHES - 1)
    values = np.empty((kinds, _PUSHES))
    for j in range(_PUSHES):
        b, y = cells[j], places[j]
        for k in range(kinds):
            values[k, j] = expected[k, b] + y * (expected[k, b + 1] - expected[k, b])
    total = 0.0
    for j in range(_PUSHES):
        e, apart, widths = each * j - _REACH, 0.0, 1.0
        for k in range(kinds):
            change = 0.5 * (values[k, min(j + 1, _PUSHES - 1)] - values[k, max(j - 1, 0)])
            width = noise[k] * noise[k] + 0.25 * change * change
            apart += min((seen[k] - values[k, j]) ** 2 / width, _FAR)
            widths *= width
        total += np.exp(-0.5 * (e * e + apart)) / np.sqrt(widths)
    return total


@compiled
def learned(expected, pushes, weights, noise, seen):
    """Weights of a part's friction scales, nodes of the tables, after a push.

    `expected`: values at the nodes (kinds of value, nodes), travel for one; `pushes`: `push_cells`; `noise`
    and `seen`: sd of the observed values, and these.
    """
    cells, places = pushes
    after, total = np.empty(weights.size), 0.0
    for i in range(weights.size):
        after[i] = weights[i] * _likelihood(expected, cells[i], places[i], noise, seen)
        total += after[i]
    for i in range(weights.size):
        after[i] /= total
    return after
