"""Bayes' rule for the friction scale of a part, on a grid over part and push."""

import numpy as np

from centering.cycle._strategy.outcome_kernels import _scale_at, travel_at
from sdpgrind.base.compiling.compiled import compiled

_PARTS, _PUSHES = 41, 17  # chosen: nodes of the friction scale of the part and of the push
_REACH = 4.0  # chosen: half width of both grids, in standard deviations
_FAR = 50.0  # chosen: squared standard deviations beyond which a travel contradicts every friction
_STRANGERS = 1e-3  # chosen: share of parts with any friction, uniform in its logarithm over the table


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
def posterior(table, grid, stroke, prior, push_sd, noise, travelled):
    """Mean and sd of a part's friction scale after a push; `prior`: both before; `noise`, `travelled` in mm.

    Where another friction explains the travel better, weighted by the rarity of such parts, the prior was
    wrong: mean and sd are those of such a part. Also returned: whether that is so.
    """
    friction, sd = prior
    scales, weights = np.empty(_PARTS), np.empty(_PARTS)
    for i in range(_PARTS):
        z = -_REACH + 2.0 * _REACH * i / (_PARTS - 1)
        scales[i], weights[i] = friction + sd * z, np.exp(-0.5 * z * z)
    belief = _moments(table, grid, stroke, scales, weights / weights.sum(), push_sd, noise, travelled)
    nodes = table.shape[1]
    scales, weights = np.empty(nodes), np.empty(nodes)
    for i in range(nodes):
        scales[i] = _scale_at(grid, i)
        weights[i] = (_scale_at(grid, i + 0.5) - _scale_at(grid, i - 0.5)) / scales[i]
    stranger = _moments(table, grid, stroke, scales, weights / weights.sum(), push_sd, noise, travelled)
    wrong = _STRANGERS * stranger[0] > (1.0 - _STRANGERS) * belief[0]
    found = stranger if wrong else belief
    return found[1], found[2], wrong


@compiled
def _moments(table, grid, stroke, scales, weights, push_sd, noise, travelled):
    """Likelihood of a travel under weighted friction scales, and posterior mean and sd of the scale."""
    total, first, second, about = 0.0, 0.0, 0.0, scales[scales.size // 2]
    for i in range(scales.size):
        weight, off = (
            weights[i] * _likelihood(table, grid, stroke, scales[i], push_sd, noise, travelled),
            scales[i] - about,
        )
        total += weight
        first += weight * off
        second += weight * off * off
    mean = first / total
    return total, about + mean, np.sqrt(max(second / total - mean * mean, 0.0))
