"""Triangles or points from STL, PLY and OBJ, read by trimesh; what it would not notice is checked before."""

import io

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.extras import need
from sdpgrind.finishing.surface._triangles import Triangles, merged

_HEAD, _FACET = 84, 50  # source: binary STL, bytes before the triangles and of each
ENDINGS = (".stl", ".ply", ".obj")


def read_mesh(raw: bytes, ending: str, told: str) -> Triangles | Floats:
    """Read triangles, or points (m, 3) of a PLY or OBJ without any, mm."""
    if ending == ".stl":
        _refuse_damaged_stl(raw, told)
    trimesh = need("trimesh", "cad")
    try:
        # a scan is geometry only: materials and textures are other files
        found = trimesh.load(io.BytesIO(raw), file_type=ending[1:], process=False, skip_materials=True)
        if isinstance(found, trimesh.Scene):  # several objects, or none
            found = found.to_mesh()
    except Exception as error:  # of many kinds, as the reader meets the fault
        raise ValueError(f"{told} must be {_article(ending)}, whole; got {error}") from error
    corners = _points(found.vertices, told)
    faces = np.asarray(getattr(found, "faces", ()), dtype=np.int64).reshape(-1, 3)
    if not len(faces) and (ending == ".stl" or not len(corners)):
        raise ValueError(
            f"{told} must hold triangles or points; got none: is it {_article(ending)}, and whole?"
        )
    return merged(corners, faces) if len(faces) else corners


def _points(values: object, told: str) -> Floats:
    points = np.asarray(values, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"{told} must hold points x y z (mm), and be whole; got {points.shape} numbers")
    return points


def _article(ending: str) -> str:
    return f"an {ending[1:].upper()}" if ending != ".ply" else "a PLY"


def _refuse_damaged_stl(raw: bytes, told: str) -> None:
    """Refuse a file whose length or whose last line is not that of an STL."""
    count = int.from_bytes(raw[80:_HEAD], "little")
    if len(raw) == _HEAD + _FACET * count and count:
        return
    text = raw.lstrip()
    if text.startswith(b"solid") and b"facet" in text:
        if text.count(b"endfacet") * 2 != text.count(b"facet") or b"endsolid" not in text[-500:]:
            line = raw.count(b"\n") + 1
            raise ValueError(f"{told} must be an STL, whole; it ends in line {line} before 'endsolid'")
        return
    raise ValueError(
        f"{told} must be an STL, whole: {_HEAD} + {_FACET} x {count} = {_HEAD + _FACET * count} bytes for the"
        f" {count} triangles that it would hold; got {len(raw)}"
    )
