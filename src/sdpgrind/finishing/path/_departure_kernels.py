"""Distances between the curves of a corner, by straight lines between places on them."""

from math import sqrt

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_TINY = np.finfo(np.float64).tiny


@compiled
def furthest(point, line, out):
    """Greatest distance of points (c, m, 3) from polylines (c, k, 3), mm, into `out` (c,)."""
    for c in range(len(point)):
        most = 0.0
        for m in range(point.shape[1]):
            least = np.inf
            for k in range(line.shape[1] - 1):
                least = min(least, _square(point[c, m], line[c, k], line[c, k + 1]))
            most = max(most, least)
        out[c] = sqrt(most)


@compiled
def _square(point, start, end):
    """Squared distance of a point from a straight line between two others."""
    x, y, z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    a, b, c = point[0] - start[0], point[1] - start[1], point[2] - start[2]
    share = min(max((a * x + b * y + c * z) / max(x * x + y * y + z * z, _TINY), 0.0), 1.0)
    a, b, c = a - share * x, b - share * y, c - share * z
    return a * a + b * b + c * c
