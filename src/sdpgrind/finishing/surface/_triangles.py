"""Triangles of a scan: common corners, normals, and what a seed reaches across edges that are no creases."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from sdpgrind.base.checks import Bools, Floats

Ints = npt.NDArray[np.int64]

FLAT = 1e-6  # of the extent, chosen: above what single precision of a file leaves
CLOSED = 1e-3  # of the area, chosen: sum of normals of a closed solid, whose rounding has no direction


class Triangles(NamedTuple):
    """Corners (m, 3), mm, each once, and the three of each triangle (f, 3), none without area."""

    corners: Floats
    faces: Ints

    @property
    def outside(self) -> Floats | None:
        """Direction (3,) to the outside on the whole; None of a closed solid."""
        normals = self.normals
        total = normals.sum(axis=0)
        area = float(np.linalg.norm(normals, axis=1).sum())
        return total if np.linalg.norm(total) > CLOSED * area else None

    @property
    def flat(self) -> bool:
        """Whether all corners lie in a plane."""
        centred = self.corners - self.corners.mean(axis=0)
        extents = np.linalg.svd(centred, compute_uv=False)
        return bool(extents[-1] <= FLAT * extents[0])

    @property
    def normals(self) -> Floats:
        """Normals (f, 3), mm^2, of twice the triangles' area in length."""
        a, b, c = np.moveaxis(self.corners[self.faces], 1, 0)
        return np.cross(b - a, c - a)

    def part(self, chosen: Bools) -> "Triangles":
        """Return the triangles chosen, with their corners only."""
        used, faces = np.unique(self.faces[chosen], return_inverse=True)
        return Triangles(self.corners[used], faces.reshape(-1, 3))


def merged(corners: Floats, faces: Ints) -> Triangles:
    """Merge corners that are equal to the last bit, as files without common corners repeat them."""
    # adding 0.0 makes one zero of two
    once, place = np.unique(corners + 0.0, axis=0, return_inverse=True)
    found = Triangles(once, place.reshape(-1)[faces])
    return found.part(np.asarray(found.normals.any(axis=1)))


def reached(triangles: Triangles, seed: int, crease: float) -> Bools:
    """Which triangles (f,) are reached from `seed` over edges at which normals turn by less than `crease`."""
    one, other, alike = _neighbours(triangles)
    unit = triangles.normals
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    turn = np.where(alike, -1.0, 1.0) * np.einsum("kc,kc->k", unit[one], unit[other])
    smooth = turn > np.cos(crease)
    count = len(triangles.faces)
    links = coo_matrix((np.ones(smooth.sum()), (one[smooth], other[smooth])), shape=(count, count))
    _, labels = connected_components(links, directed=False)
    return np.asarray(labels == labels[seed])


def _neighbours(triangles: Triangles) -> tuple[Ints, Ints, Bools]:
    """Pairs of triangles with a common edge, and whether both run along it alike: one is inside out then."""
    edges = _edges(triangles)
    forward, key = edges[:, 0] < edges[:, 1], _keys(edges, triangles)
    order = np.argsort(key, kind="stable")
    before, behind = order[:-1], order[1:]
    common = key[before] == key[behind]
    before, behind = before[common], behind[common]
    return before // 3, behind // 3, forward[before] == forward[behind]


def _edges(triangles: Triangles) -> Ints:
    """Edges (3 f, 2) of all triangles, each along its triangle."""
    return triangles.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)


def _keys(edges: Ints, triangles: Triangles) -> Ints:
    """Numbers (3 f,) that are equal for edges between the same corners."""
    return np.asarray(edges.min(axis=1) * len(triangles.corners) + edges.max(axis=1))


def finer(triangles: Triangles) -> Triangles:
    """Return each triangle cut into four at the middles of its sides; the corners before come first."""
    edges = _edges(triangles)
    _, first, number = np.unique(_keys(edges, triangles), return_index=True, return_inverse=True)
    middles = triangles.corners[edges[first]].mean(axis=1)
    ab, bc, ca = (len(triangles.corners) + number.reshape(-1, 3)).T
    a, b, c = triangles.faces.T
    four = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    faces = np.concatenate([np.stack(each, axis=1) for each in four])
    return Triangles(np.concatenate([triangles.corners, middles]), faces)


def nearest(triangles: Triangles, point: Floats) -> tuple[int, float]:
    """Triangle nearest to a point (3,), and the distance, mm."""
    corners = triangles.corners[triangles.faces] - point
    sides = np.roll(corners, -1, axis=1) - corners
    share = -np.einsum("fkc,fkc->fk", corners, sides) / np.maximum(
        np.einsum("fkc,fkc->fk", sides, sides), np.finfo(float).tiny
    )
    at_sides = corners + np.clip(share, 0.0, 1.0)[..., None] * sides
    distance = np.linalg.norm(at_sides, axis=-1).min(axis=1)
    normals = triangles.normals
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    inward = np.cross(sides, -corners)
    over = (np.einsum("fkc,fc->fk", inward, normals) >= 0.0).all(axis=1)
    distance[over] = np.abs(np.einsum("fc,fc->f", corners[:, 0], normals))[over]
    best = int(distance.argmin())
    return best, float(distance[best])


def boundary(triangles: Triangles) -> list[Ints]:
    """Loops of corners around the triangles, to their left; none where one at the edge is inside out."""
    edges = _edges(triangles)
    _, first, times = np.unique(_keys(edges, triangles), return_index=True, return_counts=True)
    onward: dict[int, list[int]] = {}
    for start, end in edges[first[times == 1]].tolist():
        onward.setdefault(start, []).append(end)
    loops = []
    while onward:
        loop = _loop(onward)
        if loop is None:
            return []
        loops.append(np.array(loop))
    return loops


def _loop(onward: dict[int, list[int]]) -> list[int] | None:
    """Take a loop out of edges by their start; None where it does not close."""
    loop = [next(iter(onward))]
    while True:
        ends = onward.get(loop[-1])
        if not ends:
            return None
        end = ends.pop()
        if not ends:
            del onward[loop[-1]]
        if end == loop[0]:
            return loop
        loop.append(end)
