"""Surfaces and paths that the tests of paths share, and a slow, obvious twin of a path: scipy's splines and
quadrature.
"""

import numpy as np
from scipy.interpolate import BSpline

from sdpgrind.finishing.surface import (
    cylinder_surface,
    flat_surface,
    nominal_surface,
    sphere_surface,
    uneven_surfaces,
)

UNEVEN = uneven_surfaces()
SURFACES = {"nominal": nominal_surface(), "cylinder": cylinder_surface(20.0, 50.0, inside=True), **UNEVEN}
BALL = sphere_surface(20.0)
FLAT = flat_surface(10.0)


def point_of(surface, u, v):
    """One point of a surface, by scipy's splines one direction after the other."""
    weights = np.ones(surface.control_points.shape[:2]) if surface.weights is None else surface.weights
    net = np.concatenate([surface.control_points * weights[..., None], weights[..., None]], axis=-1)
    across = BSpline(surface.knots[0], net, surface.degree[0])(u)
    flat = BSpline(surface.knots[1], across, surface.degree[1])(v)
    return flat[:3] / flat[3]


def sides(samples):
    """Where two samples in a row are the two sides of a sharp corner."""
    return np.flatnonzero(np.diff(samples.run) > 0)
