"""Points that lie off a fitted surface, each alone: reflections and dust in a scan, not form."""

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import erfcinv

from sdpgrind.base.checks import Bools, Floats

GAUSS = 1.4826  # derived: standard deviation over median distance of Gaussian noise
FALSE = 1.0  # chosen: points that a clean cloud with Gaussian noise loses, on average
NEIGHBOURS, ALIKE = 12, 3  # chosen: of 12 points around, so many on the same side make it form
HALF = 0.5  # chosen: of its distance, which neighbours keep around the top of a bump
SHARE = 0.02  # chosen: of the points; where more are off, each alone, the net rings at an edge or a step


def kept(places: Floats, distances: Floats, tolerance: float) -> Bools:
    """Which points at `places` (m, 2), with signed `distances` (m,) from a surface, are no outliers (m,).

    An outlier is farther away than the farthest of m points with Gaussian noise is expected to be, by the
    median distance, farther than `tolerance`, and alone: neighbours that are off likewise are form, and so
    are outliers that are many.
    """
    far = np.abs(distances) > max(_most(distances), tolerance)
    if far.any():
        far[far] = _alone(places, distances, np.flatnonzero(far))
    return np.asarray(~far) if np.mean(far) <= SHARE else np.ones_like(far)


def _most(distances: Floats) -> float:
    """Distance that `FALSE` points of Gaussian noise exceed, by the median."""
    share = min(FALSE / len(distances), 0.5)
    return float(np.sqrt(2.0) * erfcinv(share) * GAUSS * np.median(np.abs(distances)))


def _alone(places: Floats, distances: Floats, far: np.ndarray) -> Bools:
    """Which of the points `far` have few neighbours that lie half as far to the same side."""
    count = min(NEIGHBOURS + 1, len(places))
    _, near = cKDTree(places).query(places[far], k=count)
    own = distances[far, None]
    alike = np.sign(own) * distances[near] > HALF * np.abs(own)
    return np.asarray(alike.sum(axis=1) - 1 < ALIKE)  # itself is among them
