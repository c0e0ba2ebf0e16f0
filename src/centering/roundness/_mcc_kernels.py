"""Smallest circle about all points, by exchange: a circle of two or three points grows to hold all."""

import numpy as np

from centering.roundness._distance_kernels import _crossing, _distance, extremes
from sdpgrind.base.compiling.compiled import compiled

_STEPS = 300  # chosen: exchanges at most; about ten suffice for thousands of points, and each circle grows


@compiled
def smallest_circle(x, y, tolerance, basis):
    """Centre, radius about all points and radius of the contacts (mm), number of contacts; writes `basis`.

    Two contacts are ends of a diameter.
    """
    basis[0] = extremes(x, y, x[0], y[0])[0]
    basis[1] = extremes(x, y, x[basis[0]], y[basis[0]])[0]
    size = np.int64(2)  # a literal would compile `_grow` twice
    cx, cy, radius = _two(x, y, basis[0], basis[1])
    far, most, _, _ = extremes(x, y, cx, cy)
    for _ in range(_STEPS):
        if most <= radius + tolerance:
            break
        cx, cy, radius, size = _grow(x, y, far, size, basis, tolerance)
        far, most, _, _ = extremes(x, y, cx, cy)
    return cx, cy, most, radius, size


@compiled
def _two(x, y, i, j):
    """Circle on two points as a diameter."""
    cx, cy = 0.5 * (x[i] + x[j]), 0.5 * (y[i] + y[j])
    return cx, cy, max(_distance(x, y, cx, cy, i), _distance(x, y, cx, cy, j))


@compiled
def _grow(x, y, new, size, basis, tolerance):
    """Smallest circle about the basis and a point outside its circle; writes the new contacts."""
    best, bx, by, first, second = np.inf, 0.0, 0.0, 0, -1
    for a in range(size):
        cx, cy, radius = _two(x, y, new, basis[a])
        if radius < best and _cover(x, y, cx, cy, basis, size) <= radius + tolerance:
            best, bx, by, first = radius, cx, cy, a
    if best == np.inf:  # three contacts only if no diameter fits: else rounding would decide the centre
        for a in range(size):
            for b in range(a + 1, size):
                cx, cy = _crossing(x, y, new, basis[a], new, basis[b])
                cover = max(_distance(x, y, cx, cy, new), _cover(x, y, cx, cy, basis, size))
                if cover < best:
                    best, bx, by, first, second = cover, cx, cy, a, b
    one, two = basis[first], basis[second]
    basis[0], basis[1] = new, one
    if second < 0:
        return bx, by, best, 2
    basis[2] = two
    return bx, by, _distance(x, y, bx, by, new), 3


@compiled
def _cover(x, y, cx, cy, basis, size):
    """Distance of the farthest point of the basis from a centre."""
    most = 0.0
    for k in range(size):
        most = max(most, _distance(x, y, cx, cy, basis[k]))
    return most
