"""Smallest circle about all points, by exchange: the circle of two or three points grows until none lies outside."""

from typing import Any

import numpy as np
from numba import njit

from centering._roundness.distance_kernels import crossing, distance, extremes

_OPTIONS: Any = {"cache": True, "nogil": True}
_STEPS = 1000
"""Exchanges, at most; about ten do for thousands of points, and no circle comes twice, as each is larger than the last."""


@njit(**_OPTIONS)
def smallest_circle(x, y, tolerance, basis):
    """Centre (mm), radius (mm) and how many contacts the smallest circle about all points has; they are put into `basis` (3,).

    Two contacts are ends of a diameter. A point counts as outside when it is by more than `tolerance` (mm).
    """
    basis[0] = extremes(x, y, x[0], y[0])[0]
    basis[1] = extremes(x, y, x[basis[0]], y[basis[0]])[0]
    size = 2
    cx, cy, radius = _two(x, y, basis[0], basis[1])
    for _ in range(_STEPS):
        far, most, _, _ = extremes(x, y, cx, cy)
        if most <= radius + tolerance:
            break
        new_x, new_y, new_radius, size = _grow(x, y, far, size, basis, tolerance)
        if new_radius <= radius:  # rounding: nothing is gained any more
            break
        cx, cy, radius = new_x, new_y, new_radius
    return cx, cy, radius, size


@njit(**_OPTIONS)
def _two(x, y, i, j):
    """Circle on two points as a diameter."""
    cx, cy = 0.5 * (x[i] + x[j]), 0.5 * (y[i] + y[j])
    return cx, cy, max(distance(x, y, cx, cy, i), distance(x, y, cx, cy, j))


@njit(**_OPTIONS)
def _grow(x, y, new, size, basis, tolerance):
    """Smallest circle about the basis and a point outside its circle; the basis is changed to the new contacts."""
    best, bx, by, first, second = np.inf, 0.0, 0.0, 0, -1
    for a in range(size):
        cx, cy, radius = _two(x, y, new, basis[a])
        if radius < best and _holds(x, y, cx, cy, radius + tolerance, basis, size):
            best, bx, by, first, second = radius, cx, cy, a, -1
    for a in range(size):
        for b in range(a + 1, size):
            cx, cy = crossing(x, y, new, basis[a], new, basis[b])
            radius = distance(x, y, cx, cy, new)
            if radius < best and _holds(x, y, cx, cy, radius + tolerance, basis, size):
                best, bx, by, first, second = radius, cx, cy, a, b
    i, j = basis[first], basis[second]
    basis[0], basis[1] = new, i
    if second < 0:
        return bx, by, best, 2
    basis[2] = j
    return bx, by, best, 3


@njit(**_OPTIONS)
def _holds(x, y, cx, cy, radius, basis, size):
    """Whether a circle holds the points of the basis."""
    most = 0.0
    for k in range(size):
        most = max(most, distance(x, y, cx, cy, basis[k]))
    return most <= radius
