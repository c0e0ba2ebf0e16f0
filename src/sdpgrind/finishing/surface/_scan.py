"""Surfaces fitted to regions of a scan: from STL, PLY and OBJ, and from tables of points."""

import math
import os
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface import _fitting as fitting
from sdpgrind.finishing.surface import _scan_mesh as mesh
from sdpgrind.finishing.surface._fit_task import SPARE, checked_points
from sdpgrind.finishing.surface._region import Region
from sdpgrind.finishing.surface._scan_table import factor_to_mm, read_array, read_text
from sdpgrind.finishing.surface._surface import Surface, fitted_surface
from sdpgrind.finishing.surface._triangles import Triangles, boundary, finer, nearest, reached

TABLES = {".xyz": read_text, ".csv": read_text, ".npy": read_array}
ENDINGS = (*mesh.ENDINGS, *TABLES)
"""Ends of the names of files that `read_scan` reads."""
SMALLEST = 1.0  # mm, chosen: no part that a robot finishes is smaller; one in metres or inches may be
ASTRAY = 0.05  # of the scan's size, chosen: a seed that is typed by hand is nearer


class ScannedPatch(NamedTuple):
    """A fitted surface, and loops (k, 2) of (u, v) around its triangles, which lie to the left.

    Outer loops run counter-clockwise, holes clockwise. There are none around points without triangles, nor
    where a triangle at the edge is inside out.
    """

    surface: Surface
    loops: tuple[Floats, ...]


def read_scan(
    path: str | os.PathLike[str],
    region: Region | Sequence[Region] | None = None,
    *,
    net: tuple[int, int] | None = None,
    degree: tuple[int, int] = (3, 3),
    tolerance: float = 0.01,
    unit: str | None = None,
) -> tuple[ScannedPatch, ...]:
    """Return a surface fitted to each region of a scan, or to all of it; see `Surface.fit`.

    Files of these kinds hold no unit: their numbers are in `unit`, or mm, but for columns of a text that name
    another. The tool is outside of triangles, and above points.
    """
    file = checks.path("path", path)
    ending, told = file.suffix.lower(), repr(file.name)
    if ending not in ENDINGS:
        raise checks.refuse("path", f"a scan, {', '.join(ENDINGS)}", file.name)
    regions = [region] if region is None or isinstance(region, Region) else list(region)
    for each in regions:
        if each is not None:
            checks.kind("region", each, Region)
    scan = _read(file.read_bytes(), ending, told, unit)
    parts = [scan if each is None else _part(scan, each, told) for each in regions]
    allowed = [fitting.EMPTY if each is None else each.empty_max for each in regions]
    return tuple(
        _fitted(part, net, degree, tolerance, empty) for part, empty in zip(parts, allowed, strict=True)
    )


def _read(raw: bytes, ending: str, told: str, unit: str | None) -> Triangles | Floats:
    """Read triangles or points, mm."""
    factor = factor_to_mm(unit)
    if ending in mesh.ENDINGS:
        scan = mesh.read_mesh(raw, ending, told)
        scan = scan._replace(corners=scan.corners * factor) if isinstance(scan, Triangles) else scan * factor
    else:
        scan = TABLES[ending](raw, told, unit)
    points = checked_points(told, scan.corners if isinstance(scan, Triangles) else scan)
    size = _size(points)
    if size < SMALLEST and unit is None:
        raise ValueError(
            f"{told} must be in mm where no unit is given; it is {size:.3g} mm across. In metres or inches?"
            ' Then unit="m" or unit="in"; a part so small: unit="mm"'
        )
    return scan if isinstance(scan, Triangles) else points


def _size(points: Floats) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def _fitted(
    scan: Triangles | Floats,
    net: tuple[int, int] | None,
    degree: tuple[int, int],
    tolerance: float,
    empty_max: float,
) -> ScannedPatch:
    """Fit a surface with the tool outside of triangles, or above points."""
    if not isinstance(scan, Triangles):
        return ScannedPatch(Surface.fit(scan, net, degree, tolerance, empty_max=empty_max), ())
    loops = boundary(scan)
    surface = fitted_surface(
        Surface,
        _points_of(scan, net, degree),
        net,
        degree,
        tolerance,
        scan.outside,
        empty_max,
        scattered=not loops,
    )
    return ScannedPatch(surface, tuple(lasting(surface.fit.feet[loop]) for loop in loops))


def _points_of(scan: Triangles, net: tuple[int, int] | None, degree: tuple[int, int]) -> Floats:
    """Corners of triangles; of a flat face, which needs but four, also places between them."""
    least = math.prod(net or (p + 1 for p in degree))
    if len(scan.corners) < least and not scan.flat:
        raise ValueError(
            f"region must have at least {least} corners of triangles, or be flat; it has {len(scan.corners)},"
            " from which no curved surface is told: take more of the mesh, export it finer, or read the part"
            " from STEP"
        )
    while len(scan.corners) < SPARE * least and scan.flat:
        scan = finer(scan)
    return scan.corners


def _part(scan: Triangles | Floats, region: Region, told: str) -> Triangles | Floats:
    if isinstance(scan, Triangles):
        return _part_of_triangles(scan, region, told)
    if region.seed is not None:
        raise ValueError(
            f"region must be a box, Region(box=...): {told} holds points without triangles; got a seed"
        )
    chosen = scan[region.holds(scan)]
    _refuse_nothing(len(chosen), scan, region, told)
    return chosen


def _part_of_triangles(scan: Triangles, region: Region, told: str) -> Triangles:
    inside = np.asarray(region.holds(scan.corners)[scan.faces].all(axis=1), dtype=bool)
    _refuse_nothing(int(inside.sum()), scan.corners, region, told)
    part = scan.part(inside)
    if region.seed is None:
        return part
    seed, distance = nearest(part, region.seed)
    if distance > ASTRAY * _size(scan.corners):
        raise checks.refuse(
            "seed", f"on the scan (mm), its nearest triangle is {distance:.4g} mm away", region.seed.tolist()
        )
    return part.part(reached(part, seed, region.crease))


def _refuse_nothing(count: int, points: Floats, region: Region, told: str) -> None:
    if not count and region.box is not None:
        ends = [np.round(end, 3).tolist() for end in (points.min(axis=0), points.max(axis=0))]
        raise checks.refuse(
            "box", f"around part of {told}, which is within {ends}", region.box.tolist(), "mm"
        )
