"""Contact of the tool along curves on a surface: feed direction, curvature and normal by the chain rule."""

from dataclasses import dataclass

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._contact_kernels import along, follow, put_frames, speeds
from sdpgrind.finishing.path._mappings import Mapping
from sdpgrind.finishing.path._samples import Ints
from sdpgrind.finishing.surface._derivatives import SurfaceDerivatives
from sdpgrind.finishing.surface._surface import Surface

OUTSIDE = 1e-9  # of the unit square, chosen: rounding beyond its edge
REST = 1e-12  # of the greatest speed, chosen: rest
FLAT = 1e-9  # of ``|Qu| |Qv|``, chosen: with less, ``|Qu x Qv|`` has no reliable direction


@dataclass(frozen=True)
class Contact:
    """Unit tangents, curvature vectors (1/mm) and normals (m, 3); speed ``|Q'|`` (m,), mm a unit of t."""

    tangent: Floats
    curvature_vector: Floats
    normal: Floats
    speed: Floats


def jets(coefficients: Floats, piece: Ints, t: Floats) -> Floats:
    """Places in the unit square with two derivatives by t, (m, 3, 2)."""
    found = np.empty((len(t), 3, 2))
    outside = along(coefficients, piece, t, OUTSIDE, found)
    if outside >= 0:
        a, b = found[outside, 0]
        raise ValueError(
            f"the path must stay in the unit square; its leg {piece[outside]} comes to ({a:.9g}, {b:.9g})"
        )
    return found


def met(
    surface: Surface, mapping: Mapping, coefficients: Floats, piece: Ints, t: Floats
) -> tuple[Floats, SurfaceDerivatives]:
    """Jets (m, 3, 2) of (u, v) on pieces at t, and the surface's derivatives there."""
    moved = mapping.carried(jets(coefficients, piece, t))
    return moved, surface.derivatives(moved[:, 0, 0], moved[:, 0, 1])


def points(surface: Surface, mapping: Mapping, coefficients: Floats, piece: Ints, t: Floats) -> Floats:
    """Points (c, m, 3) of pieces (c,) at t (c, m), mm."""
    moved = mapping.carried(jets(coefficients, np.repeat(piece, t.shape[1]), t.ravel()))
    return surface.point(moved[:, 0, 0], moved[:, 0, 1]).reshape(*t.shape, 3)


def speed(surface: Surface, mapping: Mapping, coefficients: Floats, piece: Ints, t: Floats) -> Floats:
    """Derivative of length by t, mm."""
    moved, there = met(surface, mapping, coefficients, piece, t)
    found = np.empty(len(t))
    speeds(moved, there.u, there.v, found)
    _refuse_no_area(moved, found)
    return found


def contact(surface: Surface, moved: Floats, there: SurfaceDerivatives, place: Ints) -> Contact:
    """Contact on curves with jets `moved` (m, 3, 2) of (u, v), at rows `place` of the derivatives."""
    m = len(place)
    tangent, bend, normal = np.empty((3, m, 3))
    pace, area = np.empty((2, m))
    follow(
        moved,
        place,
        there.u,
        there.v,
        there.uu,
        there.uv,
        there.vv,
        surface.outward,
        pace,
        tangent,
        bend,
        normal,
        area,
    )
    _refuse_rest(moved, pace)
    scale = np.sqrt((there.u**2).sum(axis=1).max() * (there.v**2).sum(axis=1).max())
    pole = np.flatnonzero(~(area > FLAT * scale))
    if len(pole):
        normal[pole] = surface.normal(moved[pole, 0, 0], moved[pole, 0, 1])
    return Contact(tangent, bend, normal, pace)


def _refuse_no_area(moved: Floats, pace: Floats) -> None:
    lost = np.flatnonzero(~np.isfinite(pace))
    if len(lost):
        u, v = moved[lost[0], 0]
        raise ValueError(
            f"nodes must keep away from where equal areas come to a point;"
            f" (u, v) = ({u:.6g}, {v:.6g}) has no area"
        )


def _refuse_rest(moved: Floats, pace: Floats) -> None:
    _refuse_no_area(moved, pace)
    still = np.flatnonzero(~(pace > REST * pace.max(initial=0.0)))
    if len(still):
        u, v = moved[still[0], 0]
        raise ValueError(
            f"the path must move on the surface everywhere; at (u, v) = ({u:.6g}, {v:.6g}) it stands still"
        )


def frames(point: Floats, place: Ints, tangent: Floats, normal: Floats) -> Floats:
    """Contact frames (m, 4, 4), at rows `place` (m,) of the points."""
    found = np.empty((len(place), 4, 4))
    put_frames(point, place, tangent, normal, found)
    return found
