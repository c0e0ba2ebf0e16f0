"""Area on the surface of each cell or strip around the nodes or passes of a path."""

from typing import Protocol

import numpy as np
from scipy.interpolate import CubicSpline

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._samples import PathSamples
from sdpgrind.finishing.path._spacing import graded, with_middles
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.surface._area import gauss
from sdpgrind.finishing.surface._forms import area_between
from sdpgrind.finishing.surface._surface import Surface

GAUSS = 4  # chosen: Gauss points on a side of a cell, on `SIDE` of the surface at most
SIDE = 1024  # chosen: keeps the work on a surface bounded
COLUMNS, INTERVALS = 64, 512  # chosen: places along passes at which strips are cut, and intervals across them
SAME = 1e-9  # of the square, chosen: rounding of a coordinate
# chosen: travel across over travel along a side, in the square, from which on a part of a path is no pass
SLANT = 0.5
# chosen: a leg along the passes longer than so many times the length that this share of them keeps is a move
# between passes, as from the last geodesic one to one along a shock
LONG, USUAL = 2.0, 0.9


class CellRoute(Protocol):
    """Attributes of a `Path` that its measures need."""

    @property
    def surface(self) -> Surface: ...
    @property
    def nodes(self) -> Floats: ...
    @property
    def points(self) -> Floats: ...
    @property
    def mapping(self) -> str: ...
    @property
    def pattern(self) -> str: ...
    @property
    def length(self) -> float: ...
    @property
    def pitch(self) -> float: ...
    def sample(self, step: float | None = None, per_leg: int = 8) -> PathSamples: ...


def cell_areas(path: CellRoute) -> Floats | None:
    """Areas (mm^2) of the strips of a zigzag or of the cells of a lattice; None for other paths."""
    if path.pattern.startswith("zigzag"):
        return _strips(path)
    sides = [_sides(path.nodes[:, k]) for k in (0, 1)]
    places = np.stack([np.searchsorted(side + SAME, path.nodes[:, k]) for k, side in enumerate(sides)])
    count = sides[0].size * sides[1].size
    if len(path.nodes) != count or np.unique(places, axis=1).shape[1] != count:
        return None
    return _cells(Square(path.surface, path.mapping, "u"), *sides)


def _sides(places: Floats) -> Floats:
    """Distinct values, without those that rounding made."""
    sorted_places = np.unique(places)
    return np.asarray(sorted_places[np.concatenate([[True], np.diff(sorted_places) > SAME])])


def _cells(square: Square, a: Floats, b: Floats) -> Floats:
    """Area of each cell of a lattice, column by column, by Gauss points."""
    per_cell = int(np.clip(SIDE // max(a.size, b.size), 1, GAUSS))
    (pa, wa), (pb, wb) = (gauss(_edges(side), per_cell) for side in (a, b))
    areas = np.empty((a.size, b.size))
    for k in range(a.size):
        here = slice(k * per_cell, (k + 1) * per_cell)
        by_a, by_b = square.tangents(pa[here, None], pb)
        density = area_between(by_a, by_b) * wa[here, None] * wb
        areas[k] = density.sum(axis=0).reshape(-1, per_cell).sum(axis=1)
    return areas.ravel()


def _edges(places: Floats) -> Floats:
    """Edges in [0, 1] of the cells around places."""
    return np.concatenate([[0.0], (places[1:] + places[:-1]) / 2, [1.0]])


def _strips(path: CellRoute) -> Floats | None:
    """Area of each pass's strip; None without two passes along one side."""
    move = np.abs(np.diff(path.nodes, axis=0)).sum(axis=0)
    along = "u" if move[0] >= move[1] else "v"
    square = Square(path.surface, path.mapping, along)
    s, weight = gauss(np.array([0.0, 1.0]), COLUMNS)
    chords = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    found = _passes(path.nodes if along == "u" else path.nodes[:, ::-1], chords, s)
    if found is None:
        return None
    passes = np.sort(found, axis=0)
    edges = np.concatenate([np.zeros((1, s.size)), (passes[1:] + passes[:-1]) / 2, np.ones((1, s.size))])
    c = with_middles(graded(square.breaks(1), INTERVALS))
    by_s, by_c = square.tangents(s[:, None], c)
    density = area_between(by_s, by_c)
    below = [CubicSpline(c, row).antiderivative()(edge) for row, edge in zip(density, edges.T, strict=True)]
    return np.asarray(np.diff(weight @ np.array(below)))


def _passes(nodes: Floats, chords: Floats, s: Floats) -> Floats | None:
    """Places across (passes, k) at `s` (k,) of the passes, parts of a path longer than half of the longest.

    Legs, of lengths `chords`, that are moves belong to none. None for fewer than two, or where one is steep.
    """
    way = np.sign(np.where(np.abs(np.diff(nodes[:, 0])) > SAME, np.diff(nodes[:, 0]), 0.0))
    moves = chords > LONG * np.quantile(chords[way != 0], USUAL)
    legs = np.flatnonzero((way != 0) & ~moves)
    cuts = (np.diff(way[legs]) != 0) | (np.diff(np.cumsum(moves)[legs]) != 0)
    parts = np.split(legs, np.flatnonzero(cuts) + 1)
    runs = [nodes[np.append(part, part[-1] + 1)] for part in parts]
    longest = max(np.ptp(run[:, 0]) for run in runs)
    found = [run[np.argsort(run[:, 0])] for run in runs if np.ptp(run[:, 0]) > longest / 2]
    if len(found) < 2 or any(abs(run[-1, 1] - run[0, 1]) > SLANT * np.ptp(run[:, 0]) for run in found):
        return None
    return np.array([np.interp(s, run[:, 0], run[:, 1]) for run in found])
