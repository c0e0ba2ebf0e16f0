"""Control points of a least-squares fit at known parameters, with a small bending term."""

import numpy as np
from scipy.linalg import LinAlgError, solveh_banded

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._fit_kernels import normal_equations

# source: finishing-any-robot.md, section 2; of the mean weight of a coefficient: it only decides where no
# point lies
BENDING = 1e-6

Knots = tuple[Floats, Floats]


def control_points(uv: Floats, points: Floats, knots: Knots, degree: tuple[int, int]) -> Floats:
    """Control points (nu, nv, 3) of the surface with least squared distances from `points` at `uv` (2, m)."""
    nu, nv = (len(each) - p - 1 for each, p in zip(knots, degree, strict=True))
    band = np.zeros((nu * nv, max(degree[0], min(nu - 1, 2)) * nv + max(degree[1], 2) + 1))
    right = np.zeros((nu * nv, 3))
    normal_equations(*knots, *degree, *np.ascontiguousarray(uv), points, band, right)
    _add_bending(band.reshape(nu, nv, -1), BENDING * band[:, 0].mean(), knots, degree)
    try:
        found = solveh_banded(band.T, right, lower=True, overwrite_ab=True, overwrite_b=True)
    except LinAlgError:
        raise ValueError(
            "points must spread over an area (mm); they lie on a few lines, between which no surface is told"
        ) from None
    return np.asarray(found).reshape(nu, nv, 3)


def _add_bending(band: Floats, weight: float, knots: Knots, degree: tuple[int, int]) -> None:
    """Add the squares of second differences along both directions to a band (nu, nv, width)."""
    nv = band.shape[1]
    (bend_u, bend_v) = (_bending(each, p) for each, p in zip(knots, degree, strict=True))
    for off, (along_u, along_v) in enumerate(zip(bend_u, bend_v, strict=True)):
        if along_u.any():
            band[:, :, off * nv] += weight * along_u[:, None]
        band[:, :, off] += weight * along_v


def _bending(knots: Floats, degree: int) -> Floats:
    """Three diagonals of D^T D, (3, n) with zeros behind their ends; D bends no straight line.

    Differences are those of slopes between Greville abscissae, over which control points of a straight line
    run straight.
    """
    n = len(knots) - degree - 1
    step = np.diff([knots[i + 1 : i + degree + 1].mean() for i in range(n)]) * (n - 1)
    rows = np.zeros((max(n - 2, 0), 3))
    rows[:, 0], rows[:, 2] = 1.0 / step[:-1], 1.0 / step[1:]
    rows[:, 1] = -rows[:, 0] - rows[:, 2]
    diagonals = np.zeros((3, n))
    for a in range(3):
        for b in range(a, 3):
            diagonals[b - a, a : a + len(rows)] += rows[:, a] * rows[:, b]
    return diagonals
