"""Moments of a function of uncertain quantities: Brown (1988), Table 2-1 corrected, (2.15), (2.16).

``method="printed"`` gives the table as printed: its correlated variance of a product ignores the sign of the
correlation and its mean the covariance; its variance of a ratio of independent quantities is less accurate
than first order and contradicts its correlated column.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

METHODS = ("corrected", "printed")


class Moments(NamedTuple):
    """Mean and standard deviation of a quantity, both in its own unit."""

    mean: float
    sd: float


def sample_moments(sample: npt.ArrayLike, *, method: str = "corrected") -> Moments:
    """Return mean and standard deviation of a sample, the variance over n - 1; over n when "printed".

    Parameters
    ----------
    sample : array_like
        At least two numbers of any unit.
    method : {"corrected", "printed"}
        Over n - 1, or over n as in Brown (1988), section 2.5.

    Raises
    ------
    ValueError
        For fewer than two numbers or NaN.

    Examples
    --------
    >>> sample_moments([1.0, 2.0, 3.0])
    Moments(mean=2.0, sd=1.0)
    """
    values = checks.finite_array("sample", sample).ravel()
    if values.size < 2:
        raise checks.refuse("sample", "at least two numbers", values.tolist())
    return Moments(float(values.mean()), float(values.std(ddof=_corrected(method))))


def sum_moments(x: tuple[float, float], y: tuple[float, float], *, correlation: float = 0.0) -> Moments:
    """Return the moments of X + Y, exact.

    Parameters
    ----------
    x, y : Moments or (mean, sd)
        Both in one unit.
    correlation : float
        Coefficient of correlation in [-1, 1], unit 1.

    Raises
    ------
    ValueError
        When an sd is negative or the correlation out of range.

    Examples
    --------
    >>> sum_moments((1.0, 3.0), (2.0, 4.0))
    Moments(mean=3.0, sd=5.0)
    """
    (mx, sx), (my, sy), r = _checked(x, y, correlation)
    return Moments(mx + my, _root(sx**2 + sy**2 + 2 * r * sx * sy))


def difference_moments(
    x: tuple[float, float], y: tuple[float, float], *, correlation: float = 0.0
) -> Moments:
    """Return the moments of X - Y, exact.

    Parameters
    ----------
    x, y : Moments or (mean, sd)
        Both in one unit.
    correlation : float
        Coefficient of correlation in [-1, 1], unit 1.

    Raises
    ------
    ValueError
        When an sd is negative or the correlation out of range.

    Examples
    --------
    >>> difference_moments((3.0, 3.0), (2.0, 4.0), correlation=1.0)
    Moments(mean=1.0, sd=1.0)
    """
    (mx, sx), (my, sy), r = _checked(x, y, correlation)
    return Moments(mx - my, _root(sx**2 + sy**2 - 2 * r * sx * sy))


def product_moments(
    x: tuple[float, float], y: tuple[float, float], *, correlation: float = 0.0, method: str = "corrected"
) -> Moments:
    """Return the moments of X Y, exact for independent and for jointly normal quantities.

    Parameters
    ----------
    x, y : Moments or (mean, sd)
        Any units.
    correlation : float
        Coefficient of correlation in [-1, 1], unit 1.
    method : {"corrected", "printed"}
        "printed": Table 2-1 as printed.

    Raises
    ------
    ValueError
        When an sd is negative or the correlation out of range.

    Examples
    --------
    >>> round(product_moments((3.0, 0.3), (2.0, 0.3), correlation=-0.8).sd**2, 4)
    0.3193
    """
    (mx, sx), (my, sy), r = _checked(x, y, correlation)
    plain = (mx * sy) ** 2 + (my * sx) ** 2
    if not _corrected(method):
        return Moments(mx * my, _root((plain + (sx * sy) ** 2) * (1 + r**2)))
    variance = plain + 2 * r * mx * my * sx * sy + (sx * sy) ** 2 * (1 + r**2)
    return Moments(mx * my + r * sx * sy, _root(variance))


def ratio_moments(
    x: tuple[float, float], y: tuple[float, float], *, correlation: float = 0.0, method: str = "corrected"
) -> Moments:
    """Return the moments of X/Y: the mean to second order, the variance to first order.

    Parameters
    ----------
    x, y : Moments or (mean, sd)
        Any units; Y keeps away from 0: abs(mean) > 2 sd.
    correlation : float
        Coefficient of correlation in [-1, 1], unit 1.
    method : {"corrected", "printed"}
        "printed": Table 2-1 as printed, its independent column where the correlation is 0.

    Raises
    ------
    ValueError
        When an sd is negative, the correlation out of range, or Y too near 0.

    Examples
    --------
    >>> ratio = ratio_moments((1.0, 0.0), (1.0, 0.2))
    >>> round(ratio.mean, 12), round(ratio.sd, 12)
    (1.04, 0.2)
    """
    (mx, sx), (my, sy), r = _checked(x, y, correlation)
    if abs(my) <= 2 * sy:
        raise ValueError(f"y must have abs(mean) > 2 sd for a ratio; got mean {my!r} and sd {sy!r}")
    variance = (sx / my) ** 2 + (mx * sy / my**2) ** 2 - 2 * r * mx * sx * sy / my**3
    if not _corrected(method):
        independent = ((mx * sy) ** 2 + (my * sx) ** 2) / (my**2 * (my**2 + sy**2))
        return Moments(mx / my, _root(independent if r == 0 else variance))
    return Moments(mx / my * (1 + (sy / my) ** 2) - r * sx * sy / my**2, _root(variance))


def delta_method(
    function: Callable[[Floats], float], mean: npt.ArrayLike, covariance: npt.ArrayLike, *, order: int = 2
) -> Moments:
    """Return the moments of a function of several quantities, by its derivatives at their means.

    Variance: Brown (1988) (2.16) with covariances. Mean: to second order, f + 1/2 tr(H C); with ``order=1`` f
    at the means, (2.15). Derivatives are central differences over a 100th of the standard deviations.

    Parameters
    ----------
    function : callable
        Function of an array of shape (p,) that returns a float; any units.
    mean : array_like, shape (p,)
        Means, in the units of the quantities.
    covariance : array_like, shape (p, p) or (p,)
        Covariance, or the standard deviations of independent quantities.
    order : {1, 2}
        Order of the mean.

    Returns
    -------
    Moments
        In the unit of the function.

    Raises
    ------
    ValueError
        For NaN, shapes that do not agree, or a matrix that is no covariance.

    Examples
    --------
    >>> moments = delta_method(lambda q: q[0] * q[1], mean=[3.0, 2.0], covariance=[0.3, 0.3])
    >>> round(moments.mean, 6), round(moments.sd**2, 6)
    (6.0, 1.17)
    """
    centre, matrix = checks.finite_array("mean", mean), _covariance(covariance)
    if centre.ndim != 1 or matrix.shape != (centre.size, centre.size):
        raise ValueError(f"covariance must fit {centre.size} quantities; got shape {matrix.shape}")
    checks.one_of("order", order, (1, 2))
    # On the scaled principal axes of the covariance the quantities are independent, of variance 1.
    spread, axes = np.linalg.eigh(matrix)
    if spread[0] < -1e-9 * max(abs(spread[-1]), 1e-300):
        raise checks.refuse("covariance", "without negative eigenvalues", float(spread[0]))
    steps = 0.01 * (axes * np.sqrt(np.maximum(spread, 0.0))).T
    middle = float(function(centre))
    up = np.array([function(centre + step) for step in steps])
    down = np.array([function(centre - step) for step in steps])
    slope, bend = (up - down) / 0.02, (up - 2 * middle + down) / 1e-4
    return Moments(middle + (0.5 * float(bend.sum()) if order == 2 else 0.0), float(np.sqrt(slope @ slope)))


def _covariance(covariance: npt.ArrayLike) -> Floats:
    matrix = checks.finite_array("covariance", covariance)
    if matrix.ndim == 1:
        return np.diag(matrix**2)
    if matrix.ndim != 2 or not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0):
        raise checks.refuse(
            "covariance", "a symmetric matrix or a list of standard deviations", matrix.tolist()
        )
    return matrix


def _checked(
    x: tuple[float, float], y: tuple[float, float], correlation: float
) -> tuple[tuple[float, float], tuple[float, float], float]:
    first, second = (
        (checks.number(f"{name} mean", mean), checks.nonnegative(f"{name} sd", sd))
        for name, (mean, sd) in (("x", x), ("y", y))
    )
    return first, second, checks.within("correlation", correlation, -1, 1, "1")


def _corrected(method: str) -> bool:
    return bool(checks.one_of("method", method, METHODS) == "corrected")


def _root(variance: float) -> float:
    return float(np.sqrt(max(variance, 0.0)))
