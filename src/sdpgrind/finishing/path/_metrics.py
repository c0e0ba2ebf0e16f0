"""Evenness of a path over its surface: length, steps, cells, coverage, gaps."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.finishing.path._cells import CellRoute, cell_areas
from sdpgrind.finishing.path._samples import Ints
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.surface._forms import area_density
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._surface import Surface

# chosen: samples on the surface and on the path for each radius of the footprint
SURFACE_SHARE, PATH_SHARE = 10, 20
# chosen: least samples for each pitch; fewer might miss gaps and the nearest legs
SURFACE_PITCH, PATH_PITCH = 4, 20
SAMPLES_MAX = 30_000_000  # on the surface or the path, chosen: a minute or two
BLOCK = 2**17  # samples of the surface processed at once, chosen for memory
# chosen: samples around which the largest gap is sought; places a side of a lattice; ever finer lattices
WORST, LATTICE, CLOSING = 16, 9, 5
COARSE = 129  # chosen: places on each side for the widths of the surface


@dataclass(frozen=True, kw_only=True)
class PathMetrics(Frozen):
    """Quality of a path over a surface, with its sampling.

    Parameters
    ----------
    length : float
        Length on the surface, mm.
    step_min, step_mean, step_max : float
        Straight distances of consecutive nodes, mm.
    step_cv : float
        Coefficient of variation of the steps, unit 1.
    cell_area_cv : float or None
        Coefficient of variation of the areas of cells, unit 1. Nodes on a lattice of the unit square
        (Hilbert): the part of the square nearest to a node, as it lies on the surface. Zigzag: the strip of
        each pass, half way to its neighbours in the square; pieces shorter than half of the longest are no
        passes. None: other paths, and fewer than two passes along one side.
    coverage : float
        Share of the surface's area within the footprint's radius of the path (straight distance), unit 1.
    largest_gap : float
        Twice the greatest straight distance of a place on the surface from the path, mm: the diameter of the
        largest ball around such a place without any part of the path in it. The pitch for straight passes on
        a flat, up to sqrt(2) pitch at the corners of the surface and of a Hilbert curve.
    footprint_radius : float
        Radius of the footprint, mm, not of the tool; see `ball_footprint`.
    surface_step, path_step : float
        Greatest distance of the samples on the surface and on the path, mm; at most 1/4 and 1/20 of the
        pitch.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> path = fin.hilbert(fin.surface.flat_surface(8.0), order=3, mapping="parametric")
    >>> path.metrics(footprint_radius=0.5)
    PathMetrics(
        length         63 mm
        node steps     1 mm (1 to 1 mm, CV 0)
        cell areas     CV 0
        coverage       95.6 % within 0.5 mm of the path
        largest gap    1.41 mm
        sampled by     0.05 mm on the surface, 0.025 mm on the path)
    """

    length: float
    step_min: float
    step_mean: float
    step_max: float
    step_cv: float
    cell_area_cv: float | None
    coverage: float
    largest_gap: float
    footprint_radius: float
    surface_step: float
    path_step: float

    def __repr__(self) -> str:
        cells = (
            "not defined for this pattern" if self.cell_area_cv is None else f"CV {_small(self.cell_area_cv)}"
        )
        spread = f"{self.step_min:.4g} to {self.step_max:.4g} mm, CV {_small(self.step_cv)}"
        rows = {
            "length": f"{self.length:.6g} mm",
            "node steps": f"{self.step_mean:.4g} mm ({spread})",
            "cell areas": cells,
            "coverage": f"{100 * self.coverage:.3g} % within {self.footprint_radius:.4g} mm of the path",
            "largest gap": f"{self.largest_gap:.3g} mm",
            "sampled by": f"{self.surface_step:.4g} mm on the surface, {self.path_step:.4g} mm on the path",
        }
        return "PathMetrics(\n" + "\n".join(f"    {name:<15}{text}" for name, text in rows.items()) + ")"


class Line(NamedTuple):
    """Samples (m, 3) of the pieces of a path, and the first and last row of the piece of each, (m,)."""

    point: Floats
    first: Ints
    last: Ints


class CoveredArea(NamedTuple):
    """What a path covers: a surface, or a trimmed part of it."""

    surface: Surface
    patch: Patch | None

    def holds(self, u: Floats, v: Floats) -> Bools:
        """Return which places (n,) of u with (m,) of v are covered, (n m,)."""
        if self.patch is None or not self.patch.trim:
            return np.ones(u.size * v.size, dtype=bool)
        return self.patch.contains(u[:, None], v).ravel()


def metrics(
    path: CellRoute,
    footprint_radius: float,
    surface_step: float | None = None,
    path_step: float | None = None,
    *,
    pieces: Sequence[CellRoute] = (),
    patch: Patch | None = None,
) -> PathMetrics:
    """Measure a path, of several `pieces` on a patch, too; see `Path.metrics`."""
    own = pieces or (path,)
    radius = checks.positive("footprint_radius", footprint_radius, "mm")
    on_surface = (
        radius / SURFACE_SHARE
        if surface_step is None
        else checks.positive("surface_step", surface_step, "mm")
    )
    on_path = radius / PATH_SHARE if path_step is None else checks.positive("path_step", path_step, "mm")
    on_surface, on_path = min(on_surface, path.pitch / SURFACE_PITCH), min(on_path, path.pitch / PATH_PITCH)
    _refuse_work("surface_step", on_surface, sample_count(path.surface, on_surface), SURFACE_PITCH)
    length = float(sum(each.length for each in own))
    _refuse_work("path_step", on_path, length / on_path, PATH_PITCH)
    steps = np.concatenate([np.linalg.norm(np.diff(each.points, axis=0), axis=1) for each in own])
    areas = None if len(own) > 1 or (patch is not None and patch.trim) else cell_areas(own[0])
    covered = CoveredArea(path.surface, patch)
    coverage, furthest = _coverage(covered, _line(own, on_path), radius, on_surface)
    return PathMetrics(
        length=length,
        step_min=float(steps.min()),
        step_mean=float(steps.mean()),
        step_max=float(steps.max()),
        step_cv=_cv(steps),
        cell_area_cv=None if areas is None else _cv(areas),
        coverage=coverage,
        largest_gap=2 * furthest,
        footprint_radius=radius,
        surface_step=on_surface,
        path_step=on_path,
    )


def _refuse_work(name: str, step: float, count: float, per_pitch: int) -> None:
    if count > SAMPLES_MAX:
        raise ValueError(
            f"{name} must be larger: {step:.4g} mm asks for {count:.3g} samples, more than {SAMPLES_MAX:.3g};"
            f" give {name}=... (mm), which may be up to 1/{per_pitch} of the path's pitch"
        )


def _small(cv: float) -> str:
    """Text of a coefficient of variation; 0 for rounding."""
    return f"{cv:.2g}" if cv > 1e-9 else "0"


def _cv(values: Floats) -> float:
    return float(values.std() / values.mean())


def _line(pieces: Sequence[CellRoute], step: float) -> Line:
    """Samples along all pieces."""
    points = [each.sample(step).point for each in pieces]
    sizes = np.array([len(each) for each in points])
    ends = np.cumsum(sizes)
    return Line(np.concatenate(points), np.repeat(ends - sizes, sizes), np.repeat(ends - 1, sizes))


def _coverage(covered: CoveredArea, line: Line, radius: float, surface_step: float) -> tuple[float, float]:
    """Share of the area within the radius, and greatest distance from the path."""
    tree = cKDTree(line.point, balanced_tree=False, compact_nodes=False)
    inside = area = 0.0
    worst: list[tuple[float, Floats]] = []
    for block in surface_samples(covered.surface, surface_step):
        held = np.flatnonzero(covered.holds(*block.middles))
        if not held.size:
            continue
        point, own = block.point[held], block.area[held]
        distance = _from_polyline(line, point, tree.query(point)[1])
        inside += float(own[distance <= radius].sum())
        area += float(own.sum())
        worst += [(float(distance[k]), block.cell(held[k])) for k in np.argsort(distance)[-WORST:]]
    cells = [cell for _, cell in sorted(worst, key=lambda found: found[0])[-WORST:]]
    return inside / area, max(_furthest(covered, line, tree, cell) for cell in cells)


def _furthest(covered: CoveredArea, line: Line, tree: cKDTree, cell: Floats) -> float:
    """Greatest distance from the path in and around a cell [[u0, u1], [v0, v1]], on ever finer lattices."""
    domain = np.array(covered.surface.domain)
    half, middle = np.diff(cell, axis=1), cell.mean(axis=1, keepdims=True)
    most = 0.0
    for _ in range(CLOSING):
        ends = np.clip(middle + half * [-1.0, 1.0], domain[:, :1], domain[:, 1:])
        u, v = (np.linspace(low, high, LATTICE) for low, high in ends)
        point = covered.surface.grid(u, v).point.reshape(-1, 3)
        distance = _from_polyline(line, point, tree.query(point)[1])
        distance[~covered.holds(u, v)] = 0.0
        best = int(np.argmax(distance))
        most = max(most, float(distance[best]))
        middle, half = np.array([[u[best // LATTICE]], [v[best % LATTICE]]]), half / 4
    return most


def _from_polyline(line: Line, point: Floats, nearest: Ints) -> Floats:
    """Distances of points from the two legs at their nearest place on the pieces of a path."""
    before = np.maximum(nearest - 1, line.first[nearest])
    after = np.minimum(nearest + 1, line.last[nearest])
    start = line.point[nearest]
    offset = point - start
    squares = [_square_from_leg(offset, line.point[other] - start) for other in (before, after)]
    return np.asarray(np.sqrt(np.minimum(*squares)))


def _square_from_leg(offset: Floats, leg: Floats) -> Floats:
    """Squared distances from legs that start at the origin."""
    length = np.einsum("ij,ij->i", leg, leg)
    share = np.clip(np.einsum("ij,ij->i", offset, leg) / np.where(length > 0, length, 1.0), 0.0, 1.0)
    rest = offset - share[:, None] * leg
    return np.asarray(np.einsum("ij,ij->i", rest, rest))


class CellBlock(NamedTuple):
    """Samples amid cells with edges `u` (n + 1,), `v` (m + 1,): points (n m, 3) and areas (n m,)."""

    u: Floats
    v: Floats
    point: Floats
    area: Floats

    @property
    def middles(self) -> tuple[Floats, Floats]:
        """Parameters u (n,) and v (m,) of the samples."""
        return (self.u[1:] + self.u[:-1]) / 2, (self.v[1:] + self.v[:-1]) / 2

    def cell(self, k: int) -> Floats:
        """Ends of a sample's cell, [[u0, u1], [v0, v1]]."""
        i, j = divmod(int(k), self.v.size - 1)
        return np.array([self.u[i : i + 2], self.v[j : j + 2]])


def surface_samples(surface: Surface, step: float) -> Iterator[CellBlock]:
    """Yield samples in cells no wider than `step` on both sides, in blocks."""
    edges, v = _edges(surface, 0, step), _edges(surface, 1, step)
    rows = max(1, BLOCK // v.size)
    for first in range(0, edges.size - 1, rows):
        u = edges[first : first + rows + 1]
        there = surface.grid((u[1:] + u[:-1]) / 2, (v[1:] + v[:-1]) / 2)
        yield CellBlock(
            u, v, there.point.reshape(-1, 3), (area_density(there) * np.diff(u)[:, None] * np.diff(v)).ravel()
        )


def sample_count(surface: Surface, step: float) -> float:
    """Number of samples of `surface_samples`."""
    counts = [np.ceil(_reached(surface, side)[-1] / step) for side in (0, 1)]
    return float(counts[0] * counts[1])


def _edges(surface: Surface, side: int, step: float) -> Floats:
    """Edges in u (side 0) or v (side 1) of cells nowhere wider on the surface than `step`."""
    s = np.linspace(0.0, 1.0, COARSE)
    reached = _reached(surface, side)
    count = int(np.ceil(reached[-1] / step * (1 - 1e-12)))
    low, high = surface.domain[side]
    return np.asarray(low + (high - low) * np.interp(np.linspace(0.0, reached[-1], count + 1), reached, s))


@lru_cache(maxsize=8)
def _reached(surface: Surface, side: int) -> Floats:
    """Greatest length of lines on one side up to places evenly apart, mm."""
    s = np.linspace(0.0, 1.0, COARSE)
    tangent = Square(surface, "parametric", "u").tangents(s[:, None], s)[side]
    fastest = np.linalg.norm(tangent, axis=-1).max(axis=1 - side)
    return np.concatenate([[0.0], np.cumsum(np.maximum(fastest[1:], fastest[:-1]) * s[1])])
