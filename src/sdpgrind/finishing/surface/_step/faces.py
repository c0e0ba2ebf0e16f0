"""Faces of a STEP file as patches."""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._polygons import signed_area
from sdpgrind.finishing.surface._step import elementary as simple
from sdpgrind.finishing.surface._step.assembly import FACES, Assembly, PlacedFace
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.loops import polygons
from sdpgrind.finishing.surface._step.measures import StepUnits
from sdpgrind.finishing.surface._step.pcurves import Carrier, FaceSurface
from sdpgrind.finishing.surface._step.placements import moved
from sdpgrind.finishing.surface._step.rational import CLOSE
from sdpgrind.finishing.surface._step.sculpted import Sculpted
from sdpgrind.finishing.surface._step.splines import IMPLICIT, net
from sdpgrind.finishing.surface._step.swept import TYPES, ExtrudedSurface, RevolvedSurface, swept
from sdpgrind.finishing.surface._surface import Surface

WHOLE = 1e-9  # of the domain's area, chosen: a polygon that lacks no more bounds nothing
BEYOND = 1e-6  # of the domain's widths, chosen: a polygon that leaves it farther is of another surface
APART = 1e-9  # of the domain's widths, chosen: nearer places of a polygon are one
_SPLINES = ("B_SPLINE_SURFACE_WITH_KNOTS", *(f"{kind}_SURFACE" for kind in IMPLICIT))


def patches(text: str) -> tuple[Patch, ...]:
    """Return the patches of a STEP file's text, mm.

    Raises ValueError that names the line, or the entity that is not read and the faces that are.
    """
    file = StepFile(text)
    faces = Assembly(file).faces()
    if not faces:
        raise ValueError("the file must hold faces or surfaces; it has none")
    found: list[Patch] = []
    failed: ValueError | None = None
    read: list[int] = []
    for face in faces:
        try:
            found.append(_patch(file, face))
            read.append(face.number)
        except ValueError as error:
            failed = failed or error
    if failed is not None:
        raise ValueError(f"{failed}; {_beside(read, len(faces))}") from failed
    return tuple(found)


def _beside(read: list[int], count: int) -> str:
    """Words on the faces that are read beside one that is not."""
    if not read:
        return "no face of the file is read"
    names = ", ".join(f"#{number}" for number in dict.fromkeys(read[:20]))
    return f"{len(read)} of {count} faces are read: {names}{', ...' if len(read) > 20 else ''}"


def _patch(file: StepFile, face: PlacedFace) -> Patch:
    """Return the patch of a face, or of a surface without loops."""
    row = file.find(face.number, *FACES)
    if row is None:
        carrier = _carrier(file, face.number, face.units)
        return Patch(_placed(carrier, _whole(file, face.number, carrier), face.motion, 1))
    carrier = _carrier(file, row.reference(2), face.units)
    loops = polygons(file, row, FaceSurface(carrier, row.reference(2), face.units))
    box = _box(file, row, carrier, loops)
    surface = _placed(carrier, box, face.motion, 1 if row.flag(3) else -1)
    name = row.text(0) or f"#{row.number}"
    try:
        return Patch(surface, _trim(row, carrier, box, loops), name=name)
    except ValueError as error:
        raise row.refused(f"has loops that bound no face: {error}") from error


def _carrier(file: StepFile, number: int, units: StepUnits) -> Carrier:
    """Return the surface of a face."""
    if file.find(number, *_SPLINES):
        try:
            return Sculpted(net(file, number, units.length))
        except ValueError as error:
            if "line" in str(error):
                raise
            raise ValueError(f"line {file.entity(number).line}: {file.name(number)}: {error}") from error
    row = file.find(number, *simple.TYPES, *TYPES)
    if row is None:
        raise ValueError(f"{file.name(number)} is not read; export it as B-spline")
    if row.type in TYPES:
        return swept(file, row, units)
    return simple.elementary(file, row, units)


def _whole(file: StepFile, number: int, carrier: Carrier) -> Floats:
    """Domain of a surface without loops."""
    if isinstance(carrier, Sculpted):
        return carrier.domain
    if isinstance(carrier, RevolvedSurface) and np.all(np.isfinite(carrier.domain)):
        return carrier.domain
    poles = sorted(pole.place for pole in carrier.poles)
    (u, v), turn = carrier.periods, simple.TURN
    if isinstance(carrier, ExtrudedSurface) or u is None or (v is None and len(poles) < 2):
        raise ValueError(f"{file.name(number)} must have loops that bound it")
    return np.array([[0.0, 0.0 if v else poles[0]], [turn, turn if v else poles[-1]]])


def _box(file: StepFile, row: StepRow, carrier: Carrier, loops: list[Floats]) -> Floats:
    """Box [[u0, v0], [u1, v1]] of the loops; all of a B-spline surface."""
    if isinstance(carrier, Sculpted) or not loops:
        return _whole(file, row.reference(2), carrier)
    every = np.concatenate(loops)
    box = np.stack([every.min(axis=0), every.max(axis=0)])
    if not np.all(box[1] > box[0]):
        raise row.refused("must have loops with an area")
    around = any(
        p is not None and w > (1 + CLOSE) * p for p, w in zip(carrier.periods, box[1] - box[0], strict=True)
    )
    if around and isinstance(carrier, ExtrudedSurface | RevolvedSurface):
        raise row.refused("must not go around its surface more than once; split the face there")
    return box


def _placed(carrier: Carrier, box: Floats, motion: Floats, outward: int) -> Surface:
    told = carrier.net(box)
    points = told.points if np.array_equal(motion, np.eye(4)) else moved(motion, told.points)
    return Surface(points, told.degree, told.knots, told.weights, outward)


def _trim(row: StepRow, carrier: Carrier, box: Floats, loops: list[Floats]) -> tuple[Floats, ...]:
    """Polygons in the parameters of the patch, outer counter-clockwise, holes clockwise; () for all of it."""
    placed = [_inside(row, carrier, box, loop) for loop in loops]
    areas = [signed_area(each) for each in placed]
    outer = int(np.argmax(np.abs(areas))) if areas else 0
    trim = tuple(
        each if (area > 0) == (k == outer) else each[::-1]
        for k, (each, area) in enumerate(zip(placed, areas, strict=True))
    )
    whole = float(np.prod(box[1] - box[0]))
    lone = len(trim) == 1 and abs(areas[0]) >= (1 - WHOLE) * whole
    return () if lone else trim


def _inside(row: StepRow, carrier: Carrier, box: Floats, loop: Floats) -> Floats:
    """Polygon in the patch, its places apart."""
    widths = box[1] - box[0]
    uv = loop
    for axis, period in enumerate(carrier.periods if isinstance(carrier, Sculpted) else ()):
        if period is not None:
            middle = (uv[:, axis].max() + uv[:, axis].min()) / 2
            uv = uv - np.eye(2)[axis] * period * np.round((middle - box[:, axis].mean()) / period)
    if np.any(uv < box[0] - BEYOND * widths) or np.any(uv > box[1] + BEYOND * widths):
        raise row.refused("must not cross the seam of its surface; split the face there")
    uv = carrier.parameters(np.clip(uv, box[0], box[1]), box)
    uv = np.clip(uv, box[0], box[1])
    apart = np.append(True, np.abs(np.diff(uv, axis=0) / widths).max(axis=1) > APART)
    apart[-1] = True
    kept = uv[apart]
    kept[-1] = kept[0]
    return np.delete(kept, -2, axis=0) if _same(kept, widths) else kept


def _same(kept: Floats, widths: Floats) -> bool:
    """Whether the place before the last is the first one."""
    return len(kept) > 3 and bool(np.abs((kept[-2] - kept[0]) / widths).max() <= APART)
