"""Bayes' rule for the friction scale of a part, on the scales of the tables and a grid over the push."""

import numpy as np

from centering.cycle._strategy.outcome_kernels import _scale_at, scale_cell
from sdpgrind.base.compiling.compiled import compiled

_PUSHES = 17  # chosen: nodes of the friction scale of the push
_REACH = 4.0  # chosen: half width of their grid, in standard deviations
_FAR = 50.0  # chosen: squared standard deviations beyond which a value contradicts every friction


@compiled
def _between(row, grid, scale):
    """Value at a friction scale, linear between the nodes of the tables."""
    b, y = scale_cell(grid, scale, row.size)
    return row[b] + y * (row[b + 1] - row[b])


@compiled
def _likelihood(expected, grid, part, push_sd, noise, seen):
    """Density of what is seen, up to a factor, of a part with a friction scale; the push scatters about it.

    Between two grid points of the push a value is spread over their distance, which may exceed the noise.
    """
    kinds, each = seen.size, 2.0 * _REACH / (_PUSHES - 1)
    values = np.empty((kinds, _PUSHES))
    for j in range(_PUSHES):
        scale = part * (1.0 + push_sd * (each * j - _REACH))
        for k in range(kinds):
            values[k, j] = _between(expected[k], grid, scale)
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
def learned(expected, grid, weights, push_sd, noise, seen):
    """Weights of a part's friction scales, nodes of the tables, after a push.

    `expected`: values at the nodes (kinds of value, nodes), travel for one; `noise` and `seen`: sd of the
    observed values, and these.
    """
    after, total = np.empty(weights.size), 0.0
    for i in range(weights.size):
        scale = _scale_at(grid, i)
        after[i] = weights[i] * _likelihood(expected, grid, scale, push_sd, noise, seen)
        total += after[i]
    for i in range(weights.size):
        after[i] /= total
    return after
