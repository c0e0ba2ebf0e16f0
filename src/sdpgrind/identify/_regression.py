"""Weighted least squares, and total least squares (noise on both coordinates)."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.identify._estimate import Estimate, Status, columns, finished

RANK = 1e-11  # chosen: least over greatest singular value of unit columns; smaller ones are rounding
# chosen: component along an undetermined direction that names a column; smaller ones are rounding
_SHARE = 1e-6


def least_squares(
    matrix: npt.ArrayLike,
    target: npt.ArrayLike,
    *,
    weights: npt.ArrayLike | None = None,
    noise_sd: float | None = None,
    names: Sequence[str] = (),
    units: Sequence[str] = (),
    throw: bool = True,
) -> Estimate:
    """Fit ``target = matrix @ value`` by weighted least squares.

    QR of columns scaled to length 1: their units do not matter.

    Parameters
    ----------
    matrix : array_like, shape (n, p)
        Regressors, known exactly; n > p rows, n >= p with `noise_sd`.
    target : array_like, shape (n,)
        Noisy readings, any unit.
    weights : array_like, shape (n,), optional
        Inverse variances of the noise up to a common factor, > 0. Default: equal.
    noise_sd : float, optional
        Standard deviation of the noise of a row of weight 1, in the unit of `target`. Default: estimated from
        the residuals.
    names, units : sequence of str
        Names and units of the values.
    throw : bool
        Raise when the data do not determine the values; else the estimate's status says so.

    Returns
    -------
    Estimate
        Value and covariance, in `units`.

    Raises
    ------
    ValueError
        For NaN, shapes that do not agree, too few rows, or (with `throw`) undetermined values.

    Examples
    --------
    >>> fit = least_squares([[1, 0], [1, 1], [1, 2]], [1.0, 3.0, 5.0], names=("start", "slope"))
    >>> fit.value.round(9).tolist()
    [1.0, 2.0]
    """
    rows, goal = _system(matrix, target)
    scale = np.ones(goal.size) if weights is None else np.sqrt(_weights(weights, goal.size))
    count, size = rows.shape
    if count < size + (noise_sd is None):
        raise checks.refuse("target", f"at least {size + (noise_sd is None)} points", count)
    solver = SquareRoot(rows * scale[:, None], goal * scale)
    freedom = np.inf if noise_sd is not None else float(count - size)
    variance = solver.square / freedom if noise_sd is None else checks.nonnegative("noise_sd", noise_sd) ** 2
    return finished(solver.estimate(variance * solver.inverse, freedom, names, units), throw)


class SquareRoot:
    """Least-squares solution by QR and the singular values of the scaled triangle."""

    def __init__(self, rows: Floats, goal: Floats) -> None:
        length = np.sqrt(np.sum(rows**2, axis=0))
        length = np.where(length > 0, length, 1.0)
        q, r = np.linalg.qr(rows / length)
        u, s, vt = np.linalg.svd(r)
        self.determined = bool(s[-1] > RANK * s[0]) if rows.shape[0] >= rows.shape[1] else False
        kept = s > RANK * s[0]
        self.loose = np.any(np.abs(vt[~kept]) > _SHARE, axis=0)
        backward = vt.T * np.where(kept, 1 / np.where(kept, s, 1.0), 0.0)
        self.value = backward @ (u.T @ (q.T @ goal)) / length
        self.square = float(np.sum((goal - rows @ self.value) ** 2))
        self.inverse = backward @ backward.T / np.outer(length, length)
        self.length, self.backward = length, backward  # inverse of the scaled triangle, up to a rotation

    def estimate(
        self, covariance: Floats, freedom: float, names: Sequence[str], units: Sequence[str]
    ) -> Estimate:
        size = self.value.size
        names = tuple(names) or tuple(f"value{k}" for k in range(size))
        if self.determined:
            return Estimate(names, self.value, covariance, units=tuple(units), freedom=freedom)
        endless = np.diag(np.full(size, np.inf))
        loose = ", ".join(name for name, free in zip(names, self.loose, strict=True) if free)
        message = f"{Status.UNDETERMINED} (not determined: {loose})" if loose else ""
        return Estimate(
            names, self.value, endless, Status.UNDETERMINED, message, units=tuple(units), freedom=freedom
        )


def _system(matrix: npt.ArrayLike, target: npt.ArrayLike) -> tuple[Floats, Floats]:
    rows, goal = checks.finite_array("matrix", matrix), checks.finite_array("target", target)
    if rows.ndim != 2 or goal.shape != rows.shape[:1]:
        raise ValueError(
            f"matrix and target must be of shape (n, p) and (n,); got {rows.shape} and {goal.shape}"
        )
    return rows, goal


def _weights(weights: npt.ArrayLike, count: int) -> Floats:
    values = np.broadcast_to(checks.finite_array("weights", weights), (count,))
    if np.any(values <= 0):
        raise checks.refuse("weights", "> 0", float(values.min()))
    return values


def total_least_squares(
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    *,
    noise_ratio: float,
    names: Sequence[str] = ("intercept", "slope"),
    units: Sequence[str] = (),
    throw: bool = True,
) -> Estimate:
    """Fit the line ``y = intercept + slope x`` to noisy x and y, their noises in a known ratio.

    Minimises the sum of (y - intercept - slope x)^2/(noise_ratio^2 + slope^2), squared distances in the
    metric of the noise. The covariance is that of large samples of constant noise.

    Parameters
    ----------
    x, y : array_like, shape (n,)
        At least 3 points.
    noise_ratio : float
        Standard deviation of the noise of y over that of x, > 0, unit of y over unit of x. Large:
        `least_squares` of y on x; small: of x on y.
    names, units : sequence of str
        Names and units of intercept and slope.
    throw : bool
        Raise when the data do not determine the line; else the estimate's status says so.

    Returns
    -------
    Estimate
        Intercept and slope, in `units`.

    Raises
    ------
    ValueError
        For NaN, fewer than 3 points, a ratio <= 0, or (with `throw`) a cloud without a direction.

    Examples
    --------
    >>> total_least_squares([0.0, 1.0, 2.0], [1.0, 3.0, 5.0], noise_ratio=2.0).value.round(9).tolist()
    [1.0, 2.0]
    """
    x, y = columns(x=x, y=y)
    if x.size < 3:
        raise checks.refuse("x", "at least 3 points", x.size)
    ratio = checks.positive("noise_ratio", noise_ratio)
    names, units = tuple(names), tuple(units)
    dx, dy = x - x.mean(), (y - y.mean()) / ratio
    across, along = _principal(dx, dy)
    if abs(along[0]) <= RANK or across[1] <= (1 + 1e-9) * across[0]:
        failed = Estimate(names, np.zeros(2), np.diag([np.inf, np.inf]), Status.UNDETERMINED, units=units)
        return finished(failed, throw)
    slope = float(ratio * along[1] / along[0])
    return _line(x, y, slope, ratio, names, units)


def _principal(dx: Floats, dy: Floats) -> tuple[Floats, Floats]:
    """Eigenvalues (least, greatest) of the scatter of a centred cloud, and the direction of the greatest."""
    spread, axes = np.linalg.eigh(np.array([[dx @ dx, dx @ dy], [dx @ dy, dy @ dy]]))
    return spread, axes[:, 1]


def _line(
    x: Floats, y: Floats, slope: float, ratio: float, names: tuple[str, ...], units: tuple[str, ...]
) -> Estimate:
    """Line of this slope through the centre.

    With v = e - slope u the noise across it, x + slope v/(ratio^2 + slope^2) estimates the true x, with noise
    independent of v.
    """
    count, metric = x.size, ratio**2 + slope**2
    intercept = float(y.mean() - slope * x.mean())
    across = y - intercept - slope * x
    variance_across = float(across @ across) / (count - 2)
    guess = x + slope * across / metric
    spread = float(np.sum((guess - guess.mean()) ** 2))
    true_spread = spread - (count - 1) * variance_across * ratio**2 / metric**2
    slope_variance = variance_across * spread / true_spread**2 if true_spread > 0 else np.inf
    centre = float(x.mean())
    covariance = slope_variance * np.array([[centre**2, -centre], [-centre, 1.0]])
    covariance[0, 0] += variance_across / count
    return Estimate(names, np.array([intercept, slope]), covariance, units=units, freedom=float(count - 2))
