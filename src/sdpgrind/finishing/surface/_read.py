"""Surfaces from a user's file, by its ending."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sdpgrind.base import checks
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._region import Region
from sdpgrind.finishing.surface._scan import ENDINGS as SCANS
from sdpgrind.finishing.surface._scan import read_scan
from sdpgrind.finishing.surface._step.faces import patches

STEP = (".step", ".stp", ".p21")
LARGEST = 500_000_000  # bytes, chosen: a larger text needs some 20 GB as entities


class Patches(tuple[Patch, ...]):
    """Patches of a file, in its order.

    Parameters
    ----------
    iterable : iterable of Patch
        The patches, mm.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> fin.surface.Patches([fin.surface.Patch(fin.surface.flat_surface(10.0))])
    Patches(1 patch, 100 mm^2)
    """

    __slots__ = ()

    @property
    def area(self) -> float:
        """Area of all patches, mm^2."""
        return float(sum(each.area for each in self))

    def __repr__(self) -> str:
        return f"Patches({len(self)} patch{'es' if len(self) != 1 else ''}, {self.area:.6g} mm^2)"


def read_surfaces(
    path: str | os.PathLike[str],
    region: Region | Sequence[Region] | None = None,
    *,
    unit: str | None = None,
) -> Patches:
    """Read the faces of a STEP file as patches, or surfaces fitted to a scan, mm.

    B-spline surfaces keep their control nets; planes, cylinders, cones, spheres, tori, extruded and revolved
    surfaces become exact rational patches over the box of their loops. Profiles of these are lines, circles,
    ellipses and B-splines, trimmed or not. The loops are the edges, projected onto the surface: polygons
    within 0.5 um of them. An edge is its curve in space, or its PCURVE where there is none that is read. The
    file's units are converted, placements of assemblies applied; a part that is there twice gives its faces
    twice. Offset and bounded surfaces are refused. Colours, names of parts and tolerances are not read. Each
    region of a scan is fitted by `Surface.fit`, whose error is ``patch.fit``, and trimmed along the border
    of its triangles.

    Parameters
    ----------
    path : str or path
        File with the ending .step, .stp or .p21; of triangles, .stl, .ply or .obj (extra ``cad``); of points,
        .xyz, .csv or .npy.
    region : Region or sequence of Region, optional
        Parts of a scan, a patch each, mm. None: all of it. None for STEP files, whose faces are all read.
    unit : str, optional
        Unit of the numbers of a scan, which hold none: ``"m"``, ``"in"``. Default: mm, and a scan below 1 mm
        is refused. None for STEP files and for texts whose columns name their units.

    Returns
    -------
    Patches
        Tuple of `Patch`.

    Raises
    ------
    ValueError
        When the file has another format, is damaged (the message names the line), names no unit of length
        or two, or holds a face that is not read (number and type of the entity, and the faces that are read).
    FileNotFoundError
        When there is no such file.
    """
    file = checks.path("path", path)
    ending = file.suffix.lower()
    if ending in SCANS:
        return Patches(_scanned(file, region, unit))
    if ending not in STEP:
        raise checks.refuse("path", f"a file of {', '.join((*STEP, *SCANS))}", file.name)
    if region is not None:
        raise checks.refuse("region", "None for a STEP file; choose among its patches", region)
    if unit is not None:
        raise checks.refuse("unit", "None for a STEP file, which states its own", unit)
    return Patches(_step(file))


def _scanned(file: Path, region: Region | Sequence[Region] | None, unit: str | None) -> tuple[Patch, ...]:
    """Patches fitted to regions of a mesh or of points."""
    found = read_scan(file, region, unit=unit)
    trims = [[np.vstack([loop, loop[:1]]) for loop in each.loops] for each in found]
    return tuple(Patch(each.surface, tuple(trim)) for each, trim in zip(found, trims, strict=True))


def _step(file: Path) -> tuple[Patch, ...]:
    """Patches of a STEP file."""
    if file.stat().st_size > LARGEST:
        raise checks.refuse("path", f"a file of at most {LARGEST} bytes", file.stat().st_size)
    try:
        return patches(file.read_text(encoding="latin-1"))
    except ValueError as error:
        raise ValueError(f"path must be a STEP file that can be read; {file.name}: {error}") from error
    except RecursionError:
        rule = "a STEP file whose entities do not refer to themselves"
        raise checks.refuse("path", rule, file.name) from None
