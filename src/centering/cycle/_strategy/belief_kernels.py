"""Bayes' rule for the friction scale of a part, on the scales of the tables and a grid over the push."""

import numpy as np

from centering.cycle._strategy.outcome_kernels import _scale_at, travel_at
from sdpgrind.base.compiling.compiled import compiled

_PUSHES = 17  # chosen: nodes of the friction scale of the push
_REACH = 4.0  # chosen: half width of their grid, in standard deviations
_FAR = 50.0  # chosen: squared standard deviations beyond which a travel contradicts every friction


@compiled
def _likelihood(table, grid, stroke, part, push_sd, noise, travelled):
    """Density of a travel (mm), up to a factor, of a part with a friction scale; the push scatters about it.

    Between two grid points of the push the travel is spread over their distance, which may exceed the noise.
    """
    travel, each = np.empty(_PUSHES), 2.0 * _REACH / (_PUSHES - 1)
    for j in range(_PUSHES):
        travel[j] = travel_at(table, grid, stroke, part * (1.0 + push_sd * (each * j - _REACH)))
    total = 0.0
    for j in range(_PUSHES):
        e = each * j - _REACH
        change = 0.5 * (travel[min(j + 1, _PUSHES - 1)] - travel[max(j - 1, 0)])
        width = noise * noise + 0.25 * change * change
        apart = (travelled - travel[j]) ** 2 / width
        total += np.exp(-0.5 * (e * e + min(apart, _FAR))) / np.sqrt(width)
    return total


@compiled
def learned(table, grid, stroke, weights, push_sd, noise, travelled):
    """Weights of a part's friction scales, nodes of the table, after a push; `noise`, `travelled` in mm."""
    after, total = np.empty(weights.size), 0.0
    for i in range(weights.size):
        scale = _scale_at(grid, i)
        after[i] = weights[i] * _likelihood(table, grid, stroke, scale, push_sd, noise, travelled)
        total += after[i]
    for i in range(weights.size):
        after[i] /= total
    return after
