"""Fundamental forms, normals and curvature from derivatives, where Qu x Qv does not vanish."""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._derivatives import SurfaceDerivatives


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar products along the last axis."""
    return np.asarray(np.einsum("...c,...c->...", a, b))


def first_form(d: SurfaceDerivatives) -> tuple[Floats, Floats, Floats]:
    """E, F, G."""
    return dot(d.u, d.u), dot(d.u, d.v), dot(d.v, d.v)


def area_density(d: SurfaceDerivatives) -> Floats:
    """Length of Qu x Qv: sqrt(EG - F^2) without its cancellation."""
    return area_between(d.u, d.v)


def area_between(a: Floats, b: Floats) -> Floats:
    """Length of a x b: the area between two tangents."""
    cross = np.cross(a, b)
    return np.asarray(np.sqrt(dot(cross, cross)))


def unit_cross(d: SurfaceDerivatives) -> Floats:
    """Unit vector along Qu x Qv."""
    cross = np.cross(d.u, d.v)
    return np.asarray(cross / np.sqrt(dot(cross, cross))[..., None])


def second_form(d: SurfaceDerivatives, normal: Floats) -> tuple[Floats, Floats, Floats]:
    """e, f, g."""
    return dot(d.uu, normal), dot(d.uv, normal), dot(d.vv, normal)


def along(form: tuple[Floats, Floats, Floats], du: Floats, dv: Floats) -> Floats:
    """A fundamental form of a direction."""
    return np.asarray(form[0] * du**2 + 2.0 * form[1] * du * dv + form[2] * dv**2)


def bending(d: SurfaceDerivatives) -> Floats:
    """Second form (a, b, c) in orthonormal tangents, the first along Qu, for the normal Qu x Qv.

    H = (a + c)/2 and K = a c - b^2; H^2 - K = ((a - c)/2)^2 + b^2 has no cancellation.
    """
    E, F, _ = first_form(d)
    e, f, g = second_form(d, unit_cross(d))
    density, slant = area_density(d), F / E
    a = e / E
    b = (f - slant * e) / density
    c = (g - slant * (2.0 * f - slant * e)) * E / density**2
    return np.stack([a, b, c], axis=-1)


def gaussian(d: SurfaceDerivatives) -> Floats:
    """K."""
    a, b, c = np.moveaxis(bending(d), -1, 0)
    return np.asarray(a * c - b**2)


def mean(d: SurfaceDerivatives) -> Floats:
    """H for the normal Qu x Qv."""
    a, _, c = np.moveaxis(bending(d), -1, 0)
    return np.asarray(0.5 * (a + c))


def principal(d: SurfaceDerivatives) -> Floats:
    """H -+ sqrt(H^2 - K), the lesser first, for the normal Qu x Qv."""
    a, b, c = np.moveaxis(bending(d), -1, 0)
    middle, half = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    return np.stack([middle - half, middle + half], axis=-1)
