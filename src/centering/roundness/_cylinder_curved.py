"""Second-order step of an extreme cylinder along its contacts, where linear programs would go to and fro."""

import numpy as np
from scipy.linalg import null_space

from centering.roundness._cylinder_surface import CylinderPoints, slopes
from sdpgrind.base.checks import Bools, Floats

_SAME = 1e-9  # chosen: singular value over the greatest below which contacts say the same
_LEVEL = 1e-9  # chosen: least curvature times the radius; a leveller step ends at the box in any case
_NEAR = 1e-4  # chosen: difference of places over the radius; its square is the relative error of a curvature


def curved_step(contacts: CylinderPoints, place: Floats, outer: Bools, prices: Floats, box: float) -> Floats:
    """Step of the axis, mm, within a box, that keeps all contacts and goes down on curved distances.

    Unknown are the place, top and bottom; contacts are on one of these. Newton's step in what they leave free
    goes down in each direction, bent upwards or not.
    """
    distance, slope = slopes(contacts, place)
    rows = np.column_stack([slope, -outer.astype(float), -(~outer).astype(float)])
    kept = np.linalg.lstsq(rows, distance.mean() - distance, rcond=None)[0]
    free = null_space(rows, rcond=_SAME)
    bent = np.zeros((6, 6))
    bent[:4, :4] = _curvature(contacts, place, np.where(outer, prices, -prices), _NEAR * distance.mean())
    width = np.array([0.0, 0.0, 0.0, 0.0, float(np.any(outer)), -float(np.any(~outer))])
    bends, ways = np.linalg.eigh(free.T @ bent @ free)
    rise = ways.T @ (free.T @ (width + bent @ kept))
    step = (kept - free @ (ways @ (rise / np.maximum(np.abs(bends), _LEVEL / distance.mean()))))[:4]
    return np.asarray(step * (box / max(float(np.abs(step).max()), box)))


def _curvature(contacts: CylinderPoints, place: Floats, weights: Floats, near: float) -> Floats:
    """Weighted second derivatives of the distances over the place, (4, 4), 1/mm."""
    moved = near * np.eye(4)
    rows = [weights @ (slopes(contacts, place + d)[1] - slopes(contacts, place - d)[1]) for d in moved]
    found = np.array(rows) / (2 * near)
    return np.asarray((found + found.T) / 2)
