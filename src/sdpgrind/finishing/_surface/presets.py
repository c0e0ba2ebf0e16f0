"""Surfaces ready to use."""

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing._surface import door
from sdpgrind.finishing._surface.surface import Surface


def nominal_surface() -> Surface:
    """Return the nominal die surface of 50 mm by 50 mm with one ridge."""
    g = _greville(6, 3)
    x, y = 50.0 * g[:, None] + 0.0 * g, 50.0 * g + 0.0 * g[:, None]
    z = 10.0 * np.sin(np.pi * g[:, None]) * np.cos(1.5 * g)
    return Surface.bspline(np.stack([x, y, z], axis=-1))


def flat_surface(side: float = 50.0) -> Surface:
    """Return a flat square of a side in mm."""
    side = checks.positive("side", side, "mm")
    return Surface.bspline([[[0.0, 0.0, 0.0], [0.0, side, 0.0]], [[side, 0.0, 0.0], [side, side, 0.0]]], degree=(1, 1))


def _greville(n: int, degree: int) -> Floats:
    """Where the control points of clamped uniform knots lie: means of `degree` knots."""
    knots = door.clamped(n, degree)
    return np.array([knots[i + 1 : i + degree + 1].mean() for i in range(n)])
