"""Straightness of a median line: the thinnest tube about the centres of sections."""

import numpy as np
from scipy.optimize import minimize

from centering.roundness._cylinder_surface import CylinderPoints, perpendiculars
from sdpgrind.base.checks import Floats

_STRAIGHT = 1e-15  # chosen: distance over the length that is rounding of a straight line
_TOLERANCE = 1e-14  # chosen: of the squared radius, over the least-squares tube's; rounding is 1e-16
_STEPS = 200  # chosen: of the quadratic programs, at most; some 10 are usual


def least_squares_tube(centers: Floats) -> float:
    """Twice the largest distance of centres, (m, 3), from their least-squares line, mm."""
    surface = CylinderPoints.of(centers)
    return 2 * float(np.sqrt(_squares(surface, _line(surface))[0].max()))


def smallest_tube(centers: Floats) -> float:
    """Diameter of the thinnest tube about centres, (m, 3), mm.

    Squares of distances from an axis are convex in its place, but for a share of the squared tilt: the
    largest is made small by sequential quadratic programs, in units of the least-squares tube.
    """
    surface = CylinderPoints.of(centers)
    start = _line(surface)
    unit = float(np.sqrt(_squares(surface, start)[0].max()))
    if unit <= _STRAIGHT * (surface.half + np.abs(centers).max()):
        return 2 * unit

    def room(x: Floats) -> Floats:
        return np.asarray(x[4] - _squares(surface, start + unit * x[:4])[0] / unit**2)

    def slope(x: Floats) -> Floats:
        moved = _squares(surface, start + unit * x[:4])[1] / unit
        return np.column_stack([-moved, np.ones(len(moved))])

    goal = np.array([0.0, 0.0, 0.0, 0.0, 1.0])
    found = minimize(
        lambda x: x[4],
        goal,
        jac=lambda x: goal,
        method="SLSQP",
        constraints={"type": "ineq", "fun": room, "jac": slope},
        options={"ftol": _TOLERANCE, "maxiter": _STEPS},
    )
    return 2 * float(np.sqrt(min(_squares(surface, start + unit * found.x[:4])[0].max(), unit**2)))


def _line(surface: CylinderPoints) -> Floats:
    """Place of the least-squares line."""
    rows = np.column_stack([np.ones(surface.z.size), surface.z / surface.half])
    found = np.linalg.lstsq(rows, np.column_stack([surface.x, surface.y]), rcond=None)[0]
    return np.asarray(found.ravel())


def _squares(surface: CylinderPoints, place: Floats) -> tuple[Floats, Floats]:
    """Squared distances (mm^2) and their derivatives over the place, (m, 4), mm."""
    across, up, along, foot = perpendiculars(surface, place)
    level = -2 * np.column_stack([across, up])
    slope = np.column_stack([level, level * (foot / surface.half)[:, np.newaxis]])
    return across**2 + up**2 + along**2, slope
