"""Area of a surface within polygons: integral of sqrt(EG - F^2) over them, by their border.

With F(u, v) the integral of the density from the least u to u, the area within a polygon is the integral of
F dv around it (Green).
"""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.quadrature import leggauss
from sdpgrind.finishing.surface import _forms as forms
from sdpgrind.finishing.surface._polygons import sides
from sdpgrind.finishing.surface._surface import Surface

ALONG = 4  # chosen: Gauss points on a side between knot lines
PARTS, MOST = 8, 64  # chosen: parts of a knot span that a piece of a side is at most; pieces of a side
ACROSS = 16  # chosen: Gauss points over a knot span
BLOCK = 2**18  # chosen: places at once, for memory


def area_within(surface: Surface, polygons: Sequence[Floats]) -> float:
    """Return the area within polygons, mm^2: counter-clockwise ones count, clockwise ones are taken off."""
    pieces = _cut(sides(polygons), surface.breaks)
    pieces = _shortened(pieces[pieces[:, 1] != pieces[:, 3]], surface.breaks)
    x, weight = leggauss(ALONG)
    share = (1 + x) / 2
    u = pieces[:, :1] + share * (pieces[:, 2:3] - pieces[:, :1])
    v = pieces[:, 1:2] + share * (pieces[:, 3:] - pieces[:, 1:2])
    rise = weight / 2 * (pieces[:, 3:] - pieces[:, 1:2])
    return float(np.sum(_integral(surface, u.ravel(), v.ravel()) * rise.ravel()))


def _cut(ends: Floats, breaks: tuple[Floats, Floats]) -> Floats:
    """Sides (n, 4) cut at the knot lines between their ends."""
    for axis in (0, 1):
        for place in breaks[axis][1:-1]:
            a, b = ends[:, axis], ends[:, 2 + axis]
            crossed = (a - place) * (b - place) < 0
            if crossed.any():
                ends = np.concatenate([ends[~crossed], *_halves(ends[crossed], axis, place)])
    return ends


def _halves(ends: Floats, axis: int, place: float) -> tuple[Floats, Floats]:
    """Both parts of sides that cross a knot line."""
    t = (place - ends[:, axis]) / (ends[:, 2 + axis] - ends[:, axis])
    middle = ends[:, :2] + t[:, None] * (ends[:, 2:] - ends[:, :2])
    middle[:, axis] = place
    return np.hstack([ends[:, :2], middle]), np.hstack([middle, ends[:, 2:]])


def _shortened(ends: Floats, breaks: tuple[Floats, Floats]) -> Floats:
    """Sides (n, 4) in equal parts of at most 1 / `PARTS` of the least knot span."""
    least = np.array([np.diff(each).min() for each in breaks])
    way = ends[:, 2:] - ends[:, :2]
    parts = np.clip(np.ceil(np.abs(way / least).max(axis=1) * PARTS), 1, MOST).astype(int)
    side = np.repeat(np.arange(len(ends)), parts)
    number = np.arange(side.size) - np.repeat(np.cumsum(parts) - parts, parts)
    first, last = ((number + k)[:, None] / parts[side, None] for k in (0, 1))
    begin = ends[side, :2]
    return np.hstack([begin + first * way[side], begin + last * way[side]])


def _integral(surface: Surface, u: Floats, v: Floats) -> Floats:
    """Integral of the density at v from the least u to u, at each pair."""
    x, weight = leggauss(ACROSS)
    total = np.zeros(u.size)
    rows = max(1, BLOCK // ACROSS)
    for low, high in zip(surface.breaks[0][:-1], surface.breaks[0][1:], strict=True):
        reached = np.flatnonzero(u > low)
        for begin in range(0, reached.size, rows):
            k = reached[begin : begin + rows]
            half = (np.minimum(u[k], high) - low) / 2
            at_u = low + half[:, None] * (1 + x)
            d = surface.derivatives(at_u, np.broadcast_to(v[k, None], at_u.shape))
            total[k] += half * (forms.area_density(d) @ weight)
    return total
