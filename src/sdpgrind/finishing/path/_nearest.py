"""Distances of points from lines of straight legs."""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._nearest_kernels import distances, sort_into_cells
from sdpgrind.finishing.path._samples import Ints

CELLS_MAX = 2**21  # chosen: 16 MB
# measured: width of cells over the longest leg; with 1 or 4 distances take up to twice as long
WIDTH = 2.0
RINGS = 2  # chosen: cells around that of a point; what is farther is sought in wider ones
WIDER = 5  # chosen: width of cells over that of the lattice before
LATTICES = 3  # chosen: how many; what is still farther is found by a tree of the ends of legs
ENDS = 8  # chosen: ends whose legs are tried there at first; ever twice as many where these do not tell


class Lattice(NamedTuple):
    """Numbers of legs cell by cell, where each cell begins, width of cells (mm), and their counts (3,)."""

    leg: Ints
    begin: Ints
    width: float
    shape: Ints


class Nearest:
    """Lines (m, 3), mm, each of straight legs, with the distances of points from them."""

    def __init__(self, lines: Sequence[Floats]) -> None:
        self._start = np.concatenate([line[:-1] for line in lines])
        self._end = np.concatenate([line[1:] for line in lines])
        self._low = np.minimum(self._start, self._end).min(axis=0)
        widths = np.maximum(self._start, self._end).max(axis=0) - self._low
        longest = float(np.linalg.norm(self._end - self._start, axis=1).max())
        self._longest = longest
        self._width = max(WIDTH * longest, _least_width(widths), 1e-9)
        self._widths = widths
        self._lattices = [self._lattice(self._width)]

    def _lattice(self, width: float) -> Lattice:
        """Legs by the cells of a width, mm."""
        shape = np.maximum(np.ceil(self._widths / width), 1).astype(np.int64)
        leg, begin = sort_into_cells(self._start, self._end, self._low, width, shape)
        return Lattice(leg, begin, width, shape)

    def distance(self, point: Floats) -> Floats:
        """Distances of points (n, 3) from the nearest leg, mm."""
        found = self._within(np.ascontiguousarray(point), 0)
        for number in range(1, LATTICES):
            if (far := np.isnan(found)).any():
                found[far] = self._within(point[far], number)
        if (far := np.isnan(found)).any():
            found[far] = self._far(point[far])
        return found

    def _within(self, point: Floats, number: int) -> Floats:
        """Distances told by the cells of a lattice, mm; NaN: by none of those around."""
        if number == len(self._lattices):
            self._lattices.append(self._lattice(self._width * WIDER**number))
        leg, begin, width, shape = self._lattices[number]
        found = distances(point, self._start, self._end, leg, begin, self._low, width, shape, RINGS)
        return np.asarray(found)

    def _far(self, point: Floats) -> Floats:
        """Distances from the legs of the nearest ends, as many as are needed.

        The foot of a perpendicular is within half of the longest leg from an end of its leg: where all other
        ends are beyond the hypotenuse of that and the distance found, their legs are no nearer.
        """
        out, left, tried = np.full(len(point), np.inf), np.arange(len(point)), ENDS
        while left.size:
            tried = min(tried, 2 * len(self._start))
            out[left], last = self._nearest_of(point[left], tried)
            if tried == 2 * len(self._start):
                break
            left, tried = left[last <= np.hypot(out[left], 0.5 * self._longest)], 2 * tried
        return out

    def _nearest_of(self, point: Floats, count: int) -> tuple[Floats, Floats]:
        """Distances from the legs of the nearest ends, and from the last of these."""
        away, near = self._ends.query(point, k=count)
        leg = near % len(self._start)
        start, way = self._start[leg], self._end[leg] - self._start[leg]
        offset, square = point[:, None] - start, np.einsum("ijk,ijk->ij", way, way)
        share = np.einsum("ijk,ijk->ij", offset, way) / np.where(square > 0, square, 1.0)
        rest = offset - np.clip(share, 0.0, 1.0)[..., None] * way
        return np.asarray(np.linalg.norm(rest, axis=2).min(axis=1)), np.asarray(away[:, -1])

    @cached_property
    def _ends(self) -> cKDTree:
        return cKDTree(np.concatenate([self._start, self._end]), balanced_tree=False, compact_nodes=False)


def _least_width(widths: Floats) -> float:
    """Width of cells, mm, of which `CELLS_MAX` fill a box."""
    low, high = 0.0, float(widths.max())
    for _ in range(60):
        middle = 0.5 * (low + high)
        if np.prod(np.maximum(np.ceil(widths / max(middle, 1e-300)), 1.0)) > CELLS_MAX:
            low = middle
        else:
            high = middle
    return high
