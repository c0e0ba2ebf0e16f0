"""Bayes' rule for the friction scale of a part, on a grid of what the part and the push may have."""

from typing import Any

import numpy as np
from numba import njit

from centering._cycle.outcome_kernels import travel_at

_OPTIONS: Any = {"cache": True, "nogil": True}
_PARTS, _PUSHES = 41, 17
_REACH = 4.0  # standard deviations
_FAR = 50.0  # squared standard deviations beyond which a travel is a surprise, whatever the friction


@njit(**_OPTIONS)
def posterior(table, grid, stroke, prior, push_sd, noise, travelled):
    """Mean and standard deviation of a part's friction scale after a push; `prior` holds both before; `noise`, `travelled` in mm.

    Between two grid points of the push the travel is smeared over their distance: what is measured may be much finer.
    """
    friction, sd = prior
    travel, each = np.empty(_PUSHES), 2.0 * _REACH / (_PUSHES - 1)
    total, first, second = 0.0, 0.0, 0.0
    for i in range(_PARTS):
        z = -_REACH + 2.0 * _REACH * i / (_PARTS - 1)
        part = friction + sd * z
        for j in range(_PUSHES):
            travel[j] = travel_at(table, grid, stroke, part * (1.0 + push_sd * (each * j - _REACH)))
        likelihood = 0.0
        for j in range(_PUSHES):
            e = each * j - _REACH
            change = 0.5 * (travel[min(j + 1, _PUSHES - 1)] - travel[max(j - 1, 0)])
            width = noise * noise + 0.25 * change * change
            apart = (travelled - travel[j]) ** 2 / width
            likelihood += np.exp(-0.5 * (e * e + min(apart, _FAR))) / np.sqrt(width)
        weight = np.exp(-0.5 * z * z) * likelihood
        total += weight
        first += weight * z
        second += weight * z * z
    mean = first / total
    return friction + sd * mean, sd * np.sqrt(max(second / total - mean * mean, 0.0))
