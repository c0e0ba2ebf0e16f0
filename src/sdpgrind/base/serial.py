"""Noise in which readings resemble the one before: its correlation, its filter, and a test of order.

First-order noise e has the correlation rho^h between readings h steps apart. A series begins where the time
falls or stays; its first reading is correlated with none before.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq, minimize_scalar
from scipy.special import betainc

from sdpgrind.base.checks import Floats

_FINE = {"xatol": 1e-3}  # chosen: far below the standard error of a correlation
_TINY = 1e-300  # chosen: keeps the logarithm of an exact zero finite
MOST = 0.98  # chosen: greatest correlation; a greater one cannot be told from a drift of the model


def gaps(time: npt.ArrayLike | None, count: int) -> Floats:
    """Steps before each of `count` readings over the median step, unit 1; inf: the first of a series."""
    if time is None:
        return np.concatenate([[np.inf], np.ones(count - 1)])
    steps = np.diff(np.asarray(time, dtype=float))
    rising = steps > 0
    typical = float(np.median(steps[rising])) if np.any(rising) else 1.0
    return np.concatenate([[np.inf], np.where(rising, steps / typical, np.inf)])


def filtered(residual: Floats, correlation: float, apart: Floats) -> Floats:
    """White residuals (..., n), as much information: sqrt((1 - rho^2)/(1 - rho^2h)) (e_k - rho^h e_k-1)."""
    return whitening(correlation, apart)(residual)


def whitening(correlation: float, apart: Floats) -> Callable[[Floats], Floats]:
    """`filtered` of many residuals with one correlation: its factors are computed once."""
    if correlation == 0.0:
        return lambda residual: residual
    carried = correlation**apart
    scale, later = np.sqrt((1 - correlation**2) / (1 - carried**2)), carried[1:]

    def white(residual: Floats) -> Floats:
        out = np.array(residual)
        out[..., 1:] -= later * residual[..., :-1]
        out *= scale
        return out

    return white


def filtered_back(white: Floats, correlation: float, apart: Floats) -> Floats:
    """Transpose of `filtered`: sum_k white_k filtered(e)_k = sum_k filtered_back(white)_k e_k."""
    if correlation == 0.0:
        return white
    scaled = np.sqrt((1 - correlation**2) / (1 - correlation ** (2 * apart))) * white
    return np.asarray(scaled - np.roll(correlation**apart * scaled, -1, axis=-1))


def correlation(residual: Floats, fitted: int, apart: Floats) -> float:
    """Correlation of first-order noise one step apart, from residuals after a fit of `fitted` values."""
    later = np.isfinite(apart)
    square = float(residual @ residual)
    if square == 0.0 or not np.any(later):
        return 0.0
    products = float(residual[1:] @ (residual[:-1] * later[1:])) / int(later.sum())
    alike = _given_back(products * residual.size / square, fitted, residual.size)
    steps = apart[later]
    if alike <= 0.0 or alike >= float(np.mean(MOST**steps)):
        return 0.0 if alike <= 0.0 else MOST
    return float(brentq(lambda rho: np.mean(rho**steps) - alike, 0.0, MOST))


def unbiased(ratio: float, fitted: int, count: float) -> float:
    """Correlation of first-order noise, from the ratio of sums e_k e_k-1 and e_k^2 of `count` residuals."""
    return float(np.clip(_given_back(ratio, fitted, count), 0.0, MOST))


def _given_back(ratio: float, fitted: int, count: float) -> float:
    """Slow regressors take p (1 + rho)/n off the mean of the ratio, its own spread 2 rho/n."""
    return (count * ratio + fitted) / max(count - fitted - 2, 1.0)


def local_correlation(residual: Floats, block: int) -> float:
    """Most likely correlation of neighbours about a line of its own in each block of so many readings.

    The likelihood is restricted to what lines leave. A slow misfit of the model does not raise it; gaps count
    as steps.
    """
    count = residual.size // block
    each, apart = residual[: count * block].reshape(count, block), gaps(None, block)
    lines = np.stack([np.ones(block), np.linspace(-1.0, 1.0, block)])

    def unlikely(rho: float) -> float:
        basis, scale = np.linalg.qr(filtered(lines, rho, apart).T)
        white = filtered(each, rho, apart)
        square = float(np.sum((white - white @ basis @ basis.T) ** 2))
        spread = np.log(np.abs(np.diag(scale))).sum() - np.log(1 - rho**2) / 2
        return (block - 2) / 2 * float(np.log(max(square, _TINY))) + float(spread)

    return float(minimize_scalar(unlikely, bounds=(0.0, MOST), method="bounded", options=_FINE).x)


def variance(weights: Floats, correlation: float, apart: Floats) -> float:
    """Variance of the sum of `weights` times first-order noise of variance 1."""
    total, carried, before = 0.0, 0.0, 0.0
    for weight, share in zip(weights.tolist(), (correlation**apart).tolist(), strict=True):
        carried = share * (carried + before)
        total += weight * (weight + 2 * carried)
        before = weight
    return total


def effective(count: float, fitted: int, correlation: float) -> float:
    """Degrees of freedom of first-order noise after a fit of `fitted` values, >= 1."""
    return max(count * (1 - correlation) / (1 + correlation) - fitted, 1.0)


def durbin_watson(residual: Floats, matrix: Floats) -> tuple[float, float]:
    """Durbin and Watson's d of a regression, and the probability of a lesser one of independent noise.

    d/4 has the beta distribution of the exact mean and variance of d for these regressors.
    """
    square = float(residual @ residual)
    count, size = matrix.shape
    if square == 0.0 or count <= size + 1:
        return 2.0, 0.5
    basis = np.linalg.qr(matrix)[0]
    steps = np.diff(basis, axis=0)  # D Q; d = |D e|^2/|e|^2
    edge = np.zeros((1, size))
    back = np.diff(np.vstack([edge, steps, edge]), axis=0)  # -D'D Q
    inside = steps.T @ steps
    first = 2 * (count - 1) - float(np.trace(inside))  # trace of M D'D, M = 1 - Q Q'
    second = 6 * count - 8 - 2 * float(np.sum(back**2)) + float(np.sum(inside**2))  # of its square
    freedom = count - size
    mean = first / freedom
    variance = 2 * (second - freedom * mean**2) / (freedom * (freedom + 2))
    d, share = float(np.sum(np.diff(residual) ** 2)) / square, mean / 4
    weight = share * (1 - share) * 16 / variance - 1
    return d, float(betainc(share * weight, (1 - share) * weight, min(d / 4, 1.0)))
