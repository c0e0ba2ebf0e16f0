"""Output-error method: parameters of a simulated model by nonlinear least squares on its outputs."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares as solve

from sdpgrind.base import checks, serial
from sdpgrind.base.checks import Floats
from sdpgrind.identify._estimate import Estimate, Status, finished

_RANK = 1e-10  # chosen: relative singular value below which the residuals do not determine a value
_NOISES = ("first order", "white")
_ROUNDS = 2  # chosen: fits with a new correlation, whose first estimate is free of bias already
_SPARE = {"white": 1, "first order": 3}  # derived: readings beyond the values for a variance; a correlation


def output_error(
    residual: Callable[[Floats], Floats],
    start: npt.ArrayLike,
    *,
    scale: npt.ArrayLike,
    low: npt.ArrayLike = -np.inf,
    high: npt.ArrayLike = np.inf,
    noise: str = "first order",
    time: npt.ArrayLike | None = None,
    nuisance: int = 0,
    jacobian: Callable[[Floats], Floats] | None = None,
    names: Sequence[str] = (),
    units: Sequence[str] = (),
    throw: bool = True,
) -> Estimate:
    """Fit the values of a model to readings by nonlinear least squares.

    With noise on the readings alone it reaches the Cramer-Rao bound. Filters of gauges make each reading
    resemble the one before: by default the correlation rho is estimated from the residuals e and the filtered
    residuals e_k - rho e_k-1 are fitted, twice, so that the intervals hold for such noise too.

    Parameters
    ----------
    residual : callable
        Readings minus model outputs, shape (n,), any unit, as a function of the values, shape (p,).
    start : array_like, shape (p,)
        Initial values, in `units`.
    scale : array_like, shape (p,)
        Changes of the values of equal importance, > 0, in `units`.
    low, high : array_like, shape (p,)
        Bounds, in `units`.
    noise : {"first order", "white"}
        Noise of the readings: each resembles the one before, or independent.
    time : array_like, shape (n,), optional
        Times of the residuals, s. A series begins where the time falls or stays: its first reading resembles
        none before. Default: one series of even steps.
    nuisance : int
        Number of values that `residual` itself fits (a mean that it subtracts), unit 1.
    jacobian : callable, optional
        Slopes of the residuals by the values, shape (n, p), as a function of the values. Default: by steps.
    names, units : sequence of str
        Names and units of the values.
    throw : bool
        Raise when the readings do not determine the values; else the estimate's status says so.

    Returns
    -------
    Estimate
        Value and covariance, in `units`; sd of the noise, in the unit of the residuals, and its correlation.

    Raises
    ------
    ValueError
        For another noise, times of another shape, too few residuals, or (with `throw`) undetermined values.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(8.0)
    >>> read = 2.0 ** (1 - time)
    >>> fit = output_error(lambda v: read - v[0] * np.exp(-time / v[1]), [1.0, 1.0], scale=[1.0, 1.0],
    ...                    names=("start", "time_constant"), units=("mm", "s"))
    >>> print(round(fit["time_constant"] * np.log(2), 9))  # s
    1.0
    """
    spare = _SPARE[checks.one_of("noise", noise, _NOISES)]
    begin = checks.finite_array("start", start)
    steps = np.broadcast_to(checks.finite_array("scale", scale), begin.shape)
    inside = np.clip(begin, np.asarray(low) + 1e-9 * steps, np.asarray(high) - 1e-9 * steps)
    fitted = begin.size + nuisance
    if (count := checks.finite_array("residual", residual(inside)).size) < fitted + spare:
        raise checks.refuse("residual", f"at least {fitted + spare} readings for {noise} noise", count)
    apart = serial.gaps(_times(time, count), count)
    options: dict[str, Any] = {
        "bounds": (low, high), "x_scale": steps, "xtol": 1e-12, "ftol": 1e-14, "gtol": 1e-14
    }  # fmt: skip
    found, rho = solve(residual, inside, jacobian or "3-point", **options), 0.0
    for _ in range(_ROUNDS if noise == "first order" else 0):
        rho = serial.correlation(residual(found.x), fitted, apart)
        most = 1 if rho == serial.MOST else None  # the model drifts: its values stay those of the plain fit
        slopes = "3-point" if jacobian is None else _filtered(jacobian, rho, apart)
        found = solve(_filtered(residual, rho, apart), found.x, slopes, max_nfev=most, **options)
    return _estimate(found, steps, (count, fitted, rho), names, units, throw)


def _filtered(function: Callable[[Floats], Floats], rho: float, apart: Floats) -> Callable[[Floats], Floats]:
    """Residuals, or their slopes, without the noise's correlation."""
    white = serial.whitening(rho, apart)
    return lambda values: white(function(values).T).T


def _times(time: npt.ArrayLike | None, count: int) -> Floats | None:
    if time is None:
        return None
    times = checks.finite_array("time", time, "s")
    if times.shape != (count,):
        raise checks.refuse("time", f"of shape {(count,)}, one for each residual", times.shape, "s")
    return times


def _estimate(
    found: Any,
    steps: Floats,
    seen: tuple[int, int, float],
    names: Sequence[str],
    units: Sequence[str],
    throw: bool,
) -> Estimate:
    """Estimate of a solution; `seen`: numbers of readings and of fitted values, correlation of the noise."""
    count, fitted, rho = seen
    names = tuple(names) or tuple(f"value{k}" for k in range(steps.size))
    _, s, vt = np.linalg.svd(found.jac * steps, full_matrices=False)
    if s[-1] <= _RANK * s[0] or s[0] == 0:
        endless = np.diag(np.full(steps.size, np.inf))
        return finished(Estimate(names, found.x, endless, Status.UNDETERMINED, units=tuple(units)), throw)
    variance = 2 * found.cost / (count - fitted)
    root = vt.T * (steps[:, None] / s)
    return Estimate(
        names,
        found.x,
        variance * root @ root.T,
        units=tuple(units),
        freedom=serial.effective(count, fitted, rho),
        noise_sd=float(np.sqrt(variance / (1 - rho**2))),
        noise_correlation=rho,
    )
