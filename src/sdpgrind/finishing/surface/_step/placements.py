"""Points, directions and placements of a STEP file."""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow

_PARALLEL = 1e-9  # chosen: sine of an angle between axis and reference that is none
NUMBERS = {2: "two", 3: "three"}


def point(file: StepFile, number: int, scale: float, size: int = 3) -> Floats:
    """Return a CARTESIAN_POINT (3,), mm; one of `size` 2 with z = 0."""
    row = file.row(number, "CARTESIAN_POINT")
    found = row.numbers(1)
    if found.size != size:
        raise row.refused(f"must have {NUMBERS[size]} coordinates; got {found.size}")
    return np.append(found * scale, np.zeros(3 - size))


def direction(file: StepFile, number: int, size: int = 3) -> Floats:
    """Return a DIRECTION (3,) of length 1; one of `size` 2 with z = 0."""
    row = file.row(number, "DIRECTION")
    found = row.numbers(1)
    length = float(np.linalg.norm(found))
    if found.size != size or not 0.0 < length < np.inf:
        raise row.refused(f"must have {NUMBERS[size]} ratios that are not all 0")
    return np.append(found / length, np.zeros(3 - size))


def placement(file: StepFile, number: int, scale: float) -> Floats:
    """Return an AXIS2_PLACEMENT_3D as a rigid motion (4, 4), mm."""
    row = file.row(number, "AXIS2_PLACEMENT_3D")
    along, beside = (_optional(file, row, place) for place in (2, 3))
    z = np.array([0.0, 0.0, 1.0]) if along is None else along
    x = np.array([1.0, 0.0, 0.0]) if beside is None else beside
    if beside is None and np.linalg.norm(np.cross(x, z)) < _PARALLEL:
        x = np.array([0.0, 1.0, 0.0])
    return frame(row, point(file, row.reference(1), scale), z, x)


def placement_2d(file: StepFile, number: int) -> Floats:
    """Return an AXIS2_PLACEMENT_2D as a rigid motion (4, 4) of a plane of parameters."""
    row = file.row(number, "AXIS2_PLACEMENT_2D")
    beside = row.optional_reference(2) if len(row.values) > 2 else None
    x = np.array([1.0, 0.0, 0.0]) if beside is None else direction(file, beside, size=2)
    return frame(row, point(file, row.reference(1), 1.0, size=2), np.array([0.0, 0.0, 1.0]), x)


def frame(row: StepRow, origin: Floats, z: Floats, x: Floats) -> Floats:
    """Return a rigid motion (4, 4) from its z axis and a direction of its x axis."""
    x = x - (x @ z) * z
    length = float(np.linalg.norm(x))
    if length < _PARALLEL:
        raise row.refused("must have an axis and a reference direction that are not parallel")
    out = np.eye(4)
    out[:3, 0], out[:3, 2], out[:3, 3] = x / length, z, origin
    out[:3, 1] = np.cross(out[:3, 2], out[:3, 0])
    return out


def _optional(file: StepFile, row: StepRow, place: int) -> Floats | None:
    number = row.optional_reference(place) if place < len(row.values) else None
    return None if number is None else direction(file, number)


def moved(motion: Floats, points: Floats) -> Floats:
    """Return points (..., 3) moved by a rigid motion (4, 4)."""
    return np.asarray(points @ motion[:3, :3].T + motion[:3, 3])


def seen_from(motion: Floats, points: Floats) -> Floats:
    """Return points (..., 3) in the frame of a rigid motion (4, 4)."""
    return np.asarray((points - motion[:3, 3]) @ motion[:3, :3])
