"""Surfaces fitted to regions of a scan: from STL, PLY and OBJ, and from tables of points."""

import os
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface import _scan_mesh as mesh
from sdpgrind.finishing.surface._fit_task import checked_points
from sdpgrind.finishing.surface._region import Region
from sdpgrind.finishing.surface._scan_table import read_array, read_text
from sdpgrind.finishing.surface._surface import Surface
from sdpgrind.finishing.surface._triangles import Triangles, nearest, reached

TABLES = {".xyz": read_text, ".csv": read_text, ".npy": read_array}
ENDINGS = (*mesh.ENDINGS, *TABLES)
"""Ends of the names of files that `read_scan` reads."""
SMALLEST = 1.0  # mm, chosen: no part that a robot finishes is smaller; one in metres or inches may be
ASTRAY = 0.05  # of the scan's size, chosen: a seed that is typed by hand is nearer


def read_scan(
    path: str | os.PathLike[str],
    region: Region | Sequence[Region] | None = None,
    *,
    net: tuple[int, int] | None = None,
    degree: tuple[int, int] = (3, 3),
    tolerance: float = 0.01,
) -> tuple[Surface, ...]:
    """Return a surface fitted to each region of a scan, or to all of it; see `Surface.fit`.

    Files of these kinds hold no unit: their numbers are mm, but for columns of a text that name another. The
    tool is on the outside of triangles, and above points.
    """
    file = checks.path("path", path)
    ending, told = file.suffix.lower(), repr(file.name)
    if ending not in ENDINGS:
        raise checks.refuse("path", f"a scan, {', '.join(ENDINGS)}", file.name)
    scan = _read(file.read_bytes(), ending, told)
    regions = [region] if region is None or isinstance(region, Region) else list(region)
    return tuple(_fitted(scan, each, told, net, degree, tolerance) for each in regions)


def _read(raw: bytes, ending: str, told: str) -> Triangles | Floats:
    """Read triangles or points, mm."""
    scan = mesh.read_mesh(raw, ending, told) if ending in mesh.ENDINGS else TABLES[ending](raw, told)
    points = checked_points(told, scan.corners if isinstance(scan, Triangles) else scan)
    size = _size(points)
    if size < SMALLEST:
        raise ValueError(
            f"{told} must be in mm; it is {size:.3g} mm across. In metres or inches? Then"
            " Surface.fit(units.m(points)) or Surface.fit(units.inch(points))"
        )
    return scan if isinstance(scan, Triangles) else points


def _size(points: Floats) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def _fitted(
    scan: Triangles | Floats,
    region: Region | None,
    told: str,
    net: tuple[int, int] | None,
    degree: tuple[int, int],
    tolerance: float,
) -> Surface:
    points, side = _taken(scan, region, told)
    allowed = {} if region is None else {"empty_max": region.empty_max}
    return Surface.fit(points, net, degree, tolerance, side, **allowed)


def _taken(
    scan: Triangles | Floats, region: Region | None, told: str
) -> tuple[Floats, npt.NDArray[np.float64] | None]:
    """Points of a region, and the outside of its triangles."""
    if region is not None:
        checks.kind("region", region, Region)
        scan = (
            _part_of_triangles(scan, region, told)
            if isinstance(scan, Triangles)
            else _part_of_points(scan, region, told)
        )
    if isinstance(scan, Triangles):
        return scan.corners, scan.normals.sum(axis=0)
    return scan, None


def _part_of_points(points: Floats, region: Region, told: str) -> Floats:
    if region.seed is not None:
        raise ValueError(
            f"region must be a box, Region(box=...), where a scan is points without triangles; {told} is,"
            f" got a seed"
        )
    chosen = points[region.holds(points)]
    _refuse_nothing(len(chosen), points, region, told)
    return chosen


def _part_of_triangles(scan: Triangles, region: Region, told: str) -> Triangles:
    inside = region.holds(scan.corners)[scan.faces].all(axis=1)
    _refuse_nothing(int(inside.sum()), scan.corners, region, told)
    part = scan.part(inside)
    if region.seed is None:
        return part
    seed, distance = nearest(part, region.seed)
    if distance > ASTRAY * _size(scan.corners):
        raise checks.refuse(
            "seed", f"on the scan; the nearest triangle is {distance:.4g} mm away", region.seed.tolist(), "mm"
        )
    return part.part(reached(part, seed, region.crease))


def _refuse_nothing(count: int, points: Floats, region: Region, told: str) -> None:
    if not count and region.box is not None:
        ends = [np.round(end, 3).tolist() for end in (points.min(axis=0), points.max(axis=0))]
        raise checks.refuse(
            "box", f"around part of {told}, which is within {ends}", region.box.tolist(), "mm"
        )
