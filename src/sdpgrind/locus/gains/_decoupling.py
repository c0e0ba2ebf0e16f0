"""Gains for several active measured constraints."""

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


def decoupling_gains(slopes: npt.ArrayLike, theta: float = 1.0) -> Floats:
    """Return the gains K = -theta E_s^-1 for several active measured constraints.

    All eigenvalues of I + K E_s are 1 - theta: the errors fall together, and no constraint disturbs another.

    Parameters
    ----------
    slopes : array, (m, m)
        E_s: row i holds the slopes of slack i by the m coordinates, at fixed hidden states.
    theta : float
        Share of deadbeat, in (0, 1], dimensionless.

    Returns
    -------
    array, (m, m)
        K, units of coordinates over those of responses; the coordinates move by K e, e the slacks.

    Raises
    ------
    ValueError
        When the slopes are not square or (nearly) singular.

    Examples
    --------
    >>> K = decoupling_gains([[-2.0, 0.5], [0.0, -4.0]], theta=0.8)
    >>> K.tolist()
    [[0.4, 0.05], [0.0, 0.2]]
    >>> round(spectral_radius([[-2.0, 0.5], [0.0, -4.0]], K), 6)  # of the loop, dimensionless
    0.2
    """
    matrix = checks.finite_array("slopes", slopes)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise checks.refuse(
            "slopes", "square, a row for each constraint and a column for each coordinate", matrix.shape
        )
    checks.share("theta", theta)
    scaled = matrix / np.maximum(np.abs(matrix).max(axis=1, keepdims=True), 1e-300)
    if np.linalg.cond(scaled) > 1e12:
        raise checks.refuse(
            "slopes", "regular: the constraints must answer differently to the coordinates", matrix.tolist()
        )
    return np.asarray(-theta * np.linalg.inv(matrix)) + 0.0


def spectral_radius(slopes: npt.ArrayLike, gains: npt.ArrayLike) -> float:
    """Return the spectral radius of I + K E_s, dimensionless; the loop is stable below 1.

    Parameters
    ----------
    slopes, gains : array, (m, m)
        E_s and K, as in `decoupling_gains`.
    """
    E, K = checks.finite_array("slopes", slopes), checks.finite_array("gains", gains)
    if E.ndim != 2 or E.shape[0] != E.shape[1] or K.shape != E.shape:
        raise checks.refuse("gains", f"of the shape of the slopes, {E.shape}", K.shape)
    return float(np.abs(np.linalg.eigvals(np.eye(len(E)) + K @ E)).max())
