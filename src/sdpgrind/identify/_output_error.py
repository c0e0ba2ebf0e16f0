"""Output-error method: parameters of a simulated model by nonlinear least squares on its outputs."""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares as solve

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.identify._estimate import Estimate, Status, finished

_RANK = 1e-10  # chosen: relative singular value below which the residuals do not determine a value


def output_error(
    residual: Callable[[Floats], Floats],
    start: npt.ArrayLike,
    *,
    scale: npt.ArrayLike,
    low: npt.ArrayLike = -np.inf,
    high: npt.ArrayLike = np.inf,
    nuisance: int = 0,
    names: Sequence[str] = (),
    units: Sequence[str] = (),
    throw: bool = True,
) -> Estimate:
    """Fit the values of a model to readings by nonlinear least squares.

    With white noise on the readings alone it reaches the Cramer-Rao bound.

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
    nuisance : int
        Number of values that `residual` itself fits (a mean that it subtracts), unit 1.
    names, units : sequence of str
        Names and units of the values.
    throw : bool
        Raise when the readings do not determine the values; else the estimate's status says so.

    Returns
    -------
    Estimate
        Value and covariance, in `units`.

    Raises
    ------
    ValueError
        For too few residuals, or (with `throw`) undetermined values.

    Examples
    --------
    >>> import numpy as np
    >>> time, read = np.array([0.0, 1.0, 2.0, 3.0]), np.array([2.0, 1.0, 0.5, 0.25])
    >>> fit = output_error(lambda v: read - v[0] * np.exp(-time / v[1]), [1.0, 1.0], scale=[1.0, 1.0],
    ...                    names=("start", "time_constant"), units=("mm", "s"))
    >>> print(round(fit["time_constant"] * np.log(2), 9))  # s
    1.0
    """
    begin = checks.finite_array("start", start)
    steps = np.broadcast_to(checks.finite_array("scale", scale), begin.shape)
    inside = np.clip(begin, np.asarray(low) + 1e-9 * steps, np.asarray(high) - 1e-9 * steps)
    if (count := residual(inside).size) <= begin.size + nuisance:
        raise checks.refuse("residual", f"at least {begin.size + nuisance + 1} readings", count)
    found = solve(
        residual, inside, jac="3-point", bounds=(low, high), x_scale=steps, xtol=1e-12, ftol=1e-14, gtol=1e-14
    )
    names = tuple(names) or tuple(f"value{k}" for k in range(begin.size))
    _, s, vt = np.linalg.svd(found.jac * steps, full_matrices=False)
    if s[-1] <= _RANK * s[0] or s[0] == 0:
        endless = np.diag(np.full(begin.size, np.inf))
        return finished(Estimate(names, found.x, endless, Status.UNDETERMINED, units=tuple(units)), throw)
    freedom = float(count - begin.size - nuisance)
    root = vt.T * (steps[:, None] / s)
    return Estimate(
        names, found.x, 2 * found.cost / freedom * root @ root.T, units=tuple(units), freedom=freedom
    )
