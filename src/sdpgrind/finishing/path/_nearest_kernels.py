"""Distances of points from straight legs that are kept by the cells of a lattice in space."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled


@compiled
def sort_into_cells(start, end, low, width, shape):
    """Numbers of legs cell by cell, and where each cell begins: legs stand in all cells that their box meets.

    start, end (n, 3): of the legs, mm. low (3,), width, shape (3,): least corner of the lattice, width of its
    cells (mm), their counts.
    """
    begin = np.zeros(shape[0] * shape[1] * shape[2] + 1, np.int64)
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    for k in range(len(start)):
        _boxed(start[k], end[k], low, width, shape, first, last)
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                row = (i * shape[1] + j) * shape[2]
                for m in range(first[2], last[2] + 1):
                    begin[row + m + 1] += 1
    for cell in range(1, len(begin)):
        begin[cell] += begin[cell - 1]
    leg, filled = np.empty(begin[len(begin) - 1], np.int64), begin.copy()
    for k in range(len(start)):
        _boxed(start[k], end[k], low, width, shape, first, last)
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                row = (i * shape[1] + j) * shape[2]
                for m in range(first[2], last[2] + 1):
                    leg[filled[row + m]] = k
                    filled[row + m] += 1
    return leg, begin


@compiled
def _boxed(start, end, low, width, shape, first, last):
    """First and last cells of the box around a leg, along each axis."""
    for c in range(3):
        least, most = min(start[c], end[c]), max(start[c], end[c])
        first[c] = min(max(int((least - low[c]) / width), 0), shape[c] - 1)
        last[c] = min(max(int((most - low[c]) / width), 0), shape[c] - 1)


@compiled
def distances(point, start, end, leg, begin, low, width, shape, rings):
    """Distances of points (n, 3) from their nearest legs, mm; NaN where `rings` of cells do not tell.

    Cells around that of the point are gone through ring by ring, until no leg beyond can be nearer.
    """
    out, home = np.empty(len(point)), np.empty(3, np.int64)
    for k in range(len(point)):
        free = width
        for c in range(3):
            place = (point[k, c] - low[c]) / width
            home[c] = int(np.floor(place))
            free = min(free, width * min(place - home[c], home[c] + 1.0 - place))
        best, told = np.inf, False
        for ring in range(rings + 1):
            best = min(best, _within_ring(point[k], start, end, leg, begin, shape, home, ring))
            reached = free + ring * width
            if best <= reached * reached:
                told = True
                break
        out[k] = np.sqrt(best) if told else np.nan
    return out


@compiled
def _within_ring(point, start, end, leg, begin, shape, home, ring):
    """Least squared distance from the legs in the cells `ring` cells away."""
    best = np.inf
    for i in range(max(home[0] - ring, 0), min(home[0] + ring, shape[0] - 1) + 1):
        for j in range(max(home[1] - ring, 0), min(home[1] + ring, shape[1] - 1) + 1):
            side = abs(i - home[0]) == ring or abs(j - home[1]) == ring
            stride = 1 if side or ring == 0 else 2 * ring
            row = (i * shape[1] + j) * shape[2]
            for m in range(home[2] - ring, home[2] + ring + 1, stride):
                if 0 <= m < shape[2]:
                    for at in range(begin[row + m], begin[row + m + 1]):
                        best = min(best, _square(point, start[leg[at]], end[leg[at]]))
    return best


@compiled
def _square(point, start, end):
    """Squared distance of a point from a leg."""
    x, y, z = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    a, b, c = point[0] - start[0], point[1] - start[1], point[2] - start[2]
    length = x * x + y * y + z * z
    share = min(max((a * x + b * y + c * z) / length, 0.0), 1.0) if length > 0.0 else 0.0
    a, b, c = a - share * x, b - share * y, c - share * z
    return a * a + b * b + c * c
