"""Share of a surface near a path, and the place farthest from it, by cells that are halved where it matters.

Distances from the path change by no more than the way to another place: within a cell by its reach, that of
a corner from the middle. A cell that is near or far as a whole is not halved; nor is one in which no place
can be farther from the path than one that was found.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path._nearest import Nearest
from sdpgrind.finishing.path._samples import Ints
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.surface._outline import Outline
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._surface import Surface

BLOCK = 2**17  # cells processed at once, chosen for memory
FEWEST = 128  # chosen: cells on each side at first, so that middles give areas to some 1e-5
# chosen: cells around which the largest gap is sought; places a side of a lattice; ever finer lattices
WORST, LATTICE, CLOSING = 16, 9, 5
COARSE = 129  # chosen: places on each side for the widths of the surface
SLACK = 0.02  # chosen: the cosine between those places, more


class CoveredArea(NamedTuple):
    """What a path covers: a surface, or a trimmed part of it."""

    surface: Surface
    patch: Patch | None

    @property
    def trimmed(self) -> bool:
        """Whether not all of the surface is covered."""
        return self.patch is not None and bool(self.patch.trim)

    def holds(self, u: Floats, v: Floats) -> Bools:
        """Return which places are covered."""
        if self.patch is None or not self.patch.trim:
            return np.ones(np.broadcast_shapes(u.shape, v.shape), dtype=bool)
        return self.patch.contains(u, v)


class Edges(NamedTuple):
    """Edges of the smallest cells in u (n 2^levels + 1,) and v; the first ones are halved `levels` times.

    `reach` (levels + 1,): of cells of each size, the greatest distance of a corner from the middle, mm.
    `border` of the halvings are for cells that a trimming crosses: middles in a row may lie on one side.
    """

    u: Floats
    v: Floats
    reach: Floats
    border: int

    @property
    def levels(self) -> int:
        """How often the first cells are halved."""
        return self.reach.size - 1


def edges_of(surface: Surface, step: float, last: float, border: int = 0) -> Edges:
    """Edges of cells that are first no wider than `step` and at last than `last`, mm; see `Edges`."""
    levels = max(0, int(np.ceil(np.log2(step / last) - 1e-9))) + border
    u, v = (_edges(surface, side, step, levels) for side in (0, 1))
    reach = [_reach(surface, u[:: 2**k], v[:: 2**k]) for k in range(levels, -1, -1)]
    return Edges(u, v, np.array(reach), border)


def _reach(surface: Surface, u: Floats, v: Floats) -> float:
    """Greatest distance of a corner from the middle of cells between edges, mm."""
    widths, half = _widths(surface), []
    for side, edge in enumerate((u, v)):
        low, high = surface.domain[side]
        s, at = np.linspace(low, high, COARSE), np.concatenate([edge, (edge[1:] + edge[:-1]) / 2])
        half.append(float(np.diff(np.sort(np.interp(at, s, widths.reached[side]))).max()))
    return float(np.sqrt(half[0] ** 2 + half[1] ** 2 + 2 * half[0] * half[1] * widths.slant))


class _Cells(NamedTuple):
    """Cells of one size: numbers (n,) on both sides, whether their shares are open, and their bounds.

    No place in a cell is farther from the path than its bound, mm.
    """

    i: Ints
    j: Ints
    open: Bools
    bound: Floats

    def halved(self) -> "_Cells":
        """The four quarters of each cell."""
        across, along = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
        return _Cells(
            (2 * self.i[:, None] + across).ravel(),
            (2 * self.j[:, None] + along).ravel(),
            np.repeat(self.open, 4),
            np.repeat(self.bound, 4),
        )

    def at(self, chosen: Any) -> "_Cells":
        """The cells at numbers, in a slice or of a mask."""
        return _Cells(self.i[chosen], self.j[chosen], self.open[chosen], self.bound[chosen])

    def blocks(self) -> Iterator["_Cells"]:
        """Pieces of at most `BLOCK` cells."""
        for k in range(0, self.i.size, BLOCK):
            yield self.at(slice(k, k + BLOCK))


class Coverage:
    """Cells of a covered area, from the first ones to the smallest, beside a path."""

    def __init__(self, covered: CoveredArea, line: Nearest, radius: float, edges: Edges) -> None:
        self._covered, self._line, self._radius, self._edges = covered, line, radius, edges
        self._outline = Outline(covered.patch) if covered.patch is not None and covered.trimmed else None
        self._inside = self._area = self._farthest = 0.0

    def measured(self) -> tuple[float, float]:
        """Share of the area within the radius, and greatest distance from the path, mm."""
        i, j = np.indices([(each.size - 1) >> self._edges.levels for each in self._edges[:2]]).reshape(2, -1)
        cells = _Cells(i, j, np.ones(i.size, dtype=bool), np.full(i.size, np.inf))
        for level in range(self._edges.levels + 1):
            left = [self._through(block, level) for block in cells.blocks()]
            cells = cells._replace(
                open=np.concatenate([each.open for each in left]),
                bound=np.concatenate([each.bound for each in left]),
            )
            self._close_in(cells, level)
            cells = cells.at(cells.open | (cells.bound > self._farthest)).halved()
        return self._inside / self._area, self._farthest

    def _through(self, cells: _Cells, level: int) -> _Cells:
        """Count the shares that are decided, and bound what is left."""
        u, v = self._ends(cells, level)
        middle = u.mean(axis=0), v.mean(axis=0)
        point, held = self._covered.surface.point(*middle), self._covered.holds(*middle)
        distance, reach = self._line.distance(point), self._edges.reach[level]
        crossed = np.zeros(held.shape, dtype=bool)
        if self._outline is not None:
            crossed = ~self._outline.clear(point, float(reach))
        certain = (np.abs(distance - self._radius) > reach) & ~crossed
        small = level >= self._edges.levels - self._edges.border
        decided = cells.open & (certain | (small & ~crossed) | (level == self._edges.levels))
        self._count(decided & held, distance, u, v)
        self._farthest = max(self._farthest, float(distance.max(initial=0.0, where=held)))
        bound = np.where(held | crossed, distance + reach, 0.0)
        return cells._replace(open=cells.open & ~decided, bound=bound)

    def _ends(self, cells: _Cells, level: int) -> tuple[Floats, Floats]:
        """Ends of cells in u and v, each (2, n)."""
        stride = 2 ** (self._edges.levels - level)
        each = zip(self._edges[:2], cells[:2], strict=True)
        u, v = (edge[np.stack([k, k + 1]) * stride] for edge, k in each)
        return u, v

    def _count(self, counted: Bools, distance: Floats, u: Floats, v: Floats) -> None:
        """Add the areas of cells."""
        u, v = u[:, counted], v[:, counted]
        density = self._covered.surface.area_density(u.mean(axis=0), v.mean(axis=0))
        area = density * np.diff(u, axis=0)[0] * np.diff(v, axis=0)[0]
        self._area += float(area.sum())
        self._inside += float(area[distance[counted] <= self._radius].sum())

    def _close_in(self, cells: _Cells, level: int) -> None:
        """Look for farther places in and around the cells with the highest bounds, by ever finer lattices."""
        ends = np.stack(self._ends(cells.at(np.argsort(cells.bound)[-WORST:]), level))  # side, end, cell
        low, high = np.array(self._covered.surface.domain).T[..., None]
        middle, half, count = ends.mean(axis=1), np.diff(ends, axis=1)[:, 0], np.arange(ends.shape[2])
        for _ in range(CLOSING):
            begin, end = np.maximum(middle - half, low), np.minimum(middle + half, high)
            u, v = np.linspace(begin, end, LATTICE, axis=-1)
            distance = self._distances(u[:, :, None], v[:, None, :])
            best = distance.reshape(count.size, -1).argmax(axis=1)
            self._farthest = max(self._farthest, float(distance.max()))
            middle, half = np.stack([u[count, best // LATTICE], v[count, best % LATTICE]]), half / 4

    def _distances(self, u: Floats, v: Floats) -> Floats:
        """Distances of places from the path, mm; 0 where they are not covered."""
        point = self._covered.surface.point(*np.broadcast_arrays(u, v))
        distance = self._line.distance(point.reshape(-1, 3)).reshape(point.shape[:-1])
        return np.where(self._covered.holds(u, v), distance, 0.0)


def sample_count(surface: Surface, step: float) -> float:
    """Number of cells no wider than `step` (mm) on either side."""
    return float(np.prod([np.ceil(each[-1] / step) for each in _widths(surface).reached]))


def first_step(surface: Surface, radius: float, pitch: float, last: float) -> float:
    """Width of the first cells, mm: half of radius or pitch, less on a small surface, at least `last`."""
    widths = [float(each[-1]) for each in _widths(surface).reached]
    return max(last, min(0.5 * radius, 0.5 * pitch, min(widths) / FEWEST))


def _edges(surface: Surface, side: int, step: float, levels: int) -> Floats:
    """Edges in u (side 0) or v (side 1): of cells nowhere wider than `step`, each in 2^levels parts."""
    s, reached = np.linspace(0.0, 1.0, COARSE), _widths(surface).reached[side]
    count = int(np.ceil(reached[-1] / step * (1 - 1e-12))) * 2**levels
    low, high = surface.domain[side]
    return np.asarray(low + (high - low) * np.interp(np.linspace(0.0, reached[-1], count + 1), reached, s))


class _Widths(NamedTuple):
    """Greatest lengths of lines on both sides up to places evenly apart, mm; cosine between the sides."""

    reached: tuple[Floats, Floats]
    slant: float


@lru_cache(maxsize=8)
def _widths(surface: Surface) -> _Widths:
    s = np.linspace(0.0, 1.0, COARSE)
    by_u, by_v = Square(surface, "parametric", "u").tangents(s[:, None], s)
    speeds = [np.linalg.norm(each, axis=-1) for each in (by_u, by_v)]
    cosine = np.abs(np.einsum("ijk,ijk->ij", by_u, by_v)) / np.maximum(speeds[0] * speeds[1], 1e-300)
    fastest = [speed.max(axis=1 - side) for side, speed in enumerate(speeds)]
    u, v = (np.append(0.0, np.cumsum(np.maximum(each[1:], each[:-1]) * s[1])) for each in fastest)
    return _Widths((u, v), min(1.0, float(cosine.max()) + SLACK))
