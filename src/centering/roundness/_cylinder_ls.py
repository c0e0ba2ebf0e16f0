"""Least-squares cylinder on true distances."""

import numpy as np

from centering.roundness._cylinder_surface import CylinderPoints, distances, slopes
from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import one_blas_thread

STILL = 1e-13  # chosen: last step of the axis over the radius; some 100 roundings of a distance
_ROUNDS = 40  # chosen: steps, at most; 5 to 8 are usual
_WEAK = 1e-4
"""Least singular value over the greatest that determines a cylinder; chosen: below, 1 um of form tilts the
axis by more than 10 mm over the height."""


def least_squares(surface: CylinderPoints) -> tuple[Floats, float]:
    """Place of the axis and radius (mm): Gauss-Newton from the algebraic fit."""
    with one_blas_thread():
        place = _algebraic(surface)
        for _ in range(_ROUNDS):
            distance, slope = slopes(surface, place)
            rows = np.column_stack([slope, np.full(distance.size, -1.0)])
            moved, _, _, singular = np.linalg.lstsq(rows, -distance, rcond=None)
            _refuse_weak(singular)
            place = place + moved[:4]
            if np.abs(moved[:4]).max() <= STILL * moved[4]:
                break
    return place, float(np.mean(distances(surface, place)))


def taper(surface: CylinderPoints, place: Floats) -> float:
    """Slope of the radius over the height, unit 1: that of the least-squares cone near a place."""
    distance, slope = slopes(surface, place)
    rows = np.column_stack([slope, np.ones(distance.size), surface.z])
    with one_blas_thread():
        return float(np.linalg.lstsq(rows, distance - distance.mean(), rcond=None)[0][5])


def _algebraic(surface: CylinderPoints) -> Floats:
    """First place: squares of distances are linear in axis, tilt and a square of the height."""
    x, y, z = surface.x, surface.y, surface.z / surface.half
    rows = np.column_stack([x, y, x * z, y * z, np.ones(x.size), z, z * z])
    return np.asarray(np.linalg.lstsq(rows, x * x + y * y, rcond=None)[0][:4] / 2)


def _refuse_weak(singular: Floats) -> None:
    """Refuse points along too few lines to determine axis and radius."""
    if singular[-1] < _WEAK * singular[0]:
        raise ValueError(
            "readings must go around the part at several heights;"
            f" they determine no cylinder (condition {singular[0] / max(singular[-1], 1e-300):.2g})"
        )
