"""Fundamental forms, normals and curvature from derivatives."""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._surface.derivatives import Derivatives


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar products along the last axis."""
    return np.asarray(np.einsum("...c,...c->...", a, b))


def first_form(d: Derivatives) -> tuple[Floats, Floats, Floats]:
    """E, F, G."""
    return dot(d.u, d.u), dot(d.u, d.v), dot(d.v, d.v)


def area_density(d: Derivatives) -> Floats:
    """Length of Qu x Qv, which is sqrt(EG - F^2) without its cancellation."""
    cross = np.cross(d.u, d.v)
    return np.sqrt(dot(cross, cross))
