"""Recursive least squares with forgetting: square-root form, and covariance form for comparison."""

from collections.abc import Sequence
from math import inf, isfinite, sqrt
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.identify._estimate import Estimate, Status
from sdpgrind.identify._regression import SquareRoot
from sdpgrind.identify._triangle_kernels import (
    COUNT,
    EPS,
    FULL,
    LOST,
    RESIDUAL,
    SQUARES,
    WEIGHT,
    TriangleLaw,
    triangle_step,
)
from sdpgrind.identify.kernels import covariance_step

if TYPE_CHECKING:
    from sdpgrind.codegen import Recipe

METHODS = ("square_root", "covariance")
_POWER = 2.0  # derived: of residuals, whose squares are summed


class RecursiveLeastSquares:
    """Recursive least squares with exponential forgetting.

    The value minimises ``sum w_i (target_i - row_i value)^2 + w_0 (value - b0)' P0^-1 (value - b0)``, w the
    product of the forgetting of all later rows, b0 and ``P0 = covariance/noise_sd^2`` of the prior: Mears
    (4.40), errata corrected. Without prior and forgetting the estimate is that of `least_squares` on all rows
    so far. The covariance holds for noise of constant variance, also with forgetting. Per row,
    `sdpgrind.identify.kernels` take a tenth of the time, in a compiled loop a hundredth.

    Parameters
    ----------
    names : sequence of str
        Names of the p values.
    forgetting : float
        Weight that older rows keep when one is added, in (0, 1], unit 1; the memory is about 1/(1 -
        forgetting) rows. For rows without information (a spindle at rest) pass 1 to `update`, or the
        knowledge fades.
    units : sequence of str
        Units of the values.
    prior : Estimate, optional
        Prior knowledge of the same names, with a covariance; forgotten like rows. Infinite variance: none.
    noise_sd : float, optional
        Standard deviation of the noise of a target, in its unit; needed with a prior. Default: estimated from
        the residuals.
    method : {"square_root", "covariance"}
        Triangle of the information matrix, whose variances stay positive (default); or the covariance, which
        needs a prior of finite variances and takes 6.6 times as long for three values. Forgetting without new
        information loses the digits of both in the end, and the status says so: the triangle recovers with
        new rows, the covariance after `reset`.

    Raises
    ------
    ValueError, TypeError
        For a forgetting out of range, a prior of other values or without positive definite covariance, or a
        missing argument.

    Examples
    --------
    >>> rls = RecursiveLeastSquares(("start", "slope"))
    >>> for x in (0.0, 1.0, 2.0):
    ...     rls.update([1.0, x], 1.0 + 2.0 * x)
    >>> rls.estimate.value.round(9).tolist()
    [1.0, 2.0]
    """

    def __init__(
        self,
        names: Sequence[str],
        *,
        forgetting: float = 1.0,
        units: Sequence[str] = (),
        prior: Estimate | None = None,
        noise_sd: float | None = None,
        method: str = "square_root",
    ) -> None:
        self._names, self._units = checks.unique("names", names), tuple(units)
        self._forgetting = checks.share("forgetting", forgetting, "1")
        self._noise_sd = None if noise_sd is None else checks.positive("noise_sd", noise_sd)
        self._method = checks.one_of("method", method, METHODS)
        self._prior = prior
        if prior is not None:
            _check_prior(prior, self._names, self._noise_sd)
        if method == "covariance" and (prior is None or np.any(np.isinf(np.diag(prior.covariance)))):
            raise checks.refuse("prior", "given, with finite variances, for method covariance", prior)
        self.reset()

    def reset(self) -> None:
        """Return to the prior."""
        self._count = 0
        self._form: _Form = _start(len(self._names), self._prior, self._noise_sd, self._method)

    @property
    def count(self) -> int:
        """Number of rows so far."""
        return self._count

    def update(self, row: npt.ArrayLike, target: float, forgetting: float | None = None) -> None:
        """Add one row, ``target = row @ value + noise``.

        Parameters
        ----------
        row : array_like, shape (p,)
            Regressors, known exactly.
        target : float
            Reading, any unit.
        forgetting : float, optional
            Weight that the rows before this one keep, in (0, 1], unit 1. Default: that of the estimator.

        Raises
        ------
        ValueError
            For NaN, a row of the wrong length, or a weight out of range.
        """
        entry = checks.finite_array("row", row)
        if entry.shape != (len(self._names),):
            raise ValueError(f"row must be of shape {(len(self._names),)}; got {entry.shape}")
        weight = self._forgetting if forgetting is None else checks.share("forgetting", forgetting, "1")
        self._form.take(entry, checks.number("target", target), weight)
        self._count += 1

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it: the triangle before its first row."""
        from sdpgrind.identify._recipe import Names, rows_recipe

        if self._method != "square_root":
            rule = "'square_root': the other one ends by eigenvalues, which are not translated"
            raise checks.refuse("method", rule, self._method)
        fresh = _Triangle(len(self._names), self._prior, self._noise_sd)
        law = TriangleLaw(len(self._names), fresh.power, self._forgetting, self._noise_sd or 0.0)
        return rows_recipe(Names(self._names, self._units), law, fresh.state)

    @property
    def estimate(self) -> Estimate:
        """Estimate from the rows so far; `Status.UNDETERMINED` until they determine the values."""
        return self._form.estimate(self._names, self._units)


class _Form(Protocol):
    """State of a recursion."""

    def take(self, row: Floats, target: float, forgetting: float) -> None: ...
    def estimate(self, names: tuple[str, ...], units: tuple[str, ...]) -> Estimate: ...


def _start(size: int, prior: Estimate | None, noise_sd: float | None, method: str) -> _Form:
    if prior is not None and noise_sd is not None and method == "covariance":
        return _Covariance(prior, noise_sd)
    return _Triangle(size, prior, noise_sd)


def _check_prior(prior: Estimate, names: tuple[str, ...], noise_sd: float | None) -> None:
    checks.kind("prior", prior, Estimate)
    if prior.names != names:
        raise checks.refuse("prior", f"an estimate of {', '.join(names)}", ", ".join(prior.names))
    if noise_sd is None:
        raise checks.refuse("noise_sd", "given with a prior, which is weighed by it", noise_sd)
    known, correlation = _known(prior)
    if not np.all(np.isfinite(correlation)) or np.linalg.eigvalsh(correlation).min(initial=1.0) <= 0:
        raise ValueError(
            "prior must have a positive definite covariance; got one that is not, of " + ", ".join(names)
        )
    checks.finite_array("value of the prior", prior.value[known])


def _known(prior: Estimate) -> tuple[Bools, Floats]:
    """Return the mask of values with a finite variance, and their correlation."""
    variance = np.diag(prior.covariance)
    known = ~np.isinf(variance)
    if np.any(variance[known] <= 0):
        k = int(np.argmax(known & (variance <= 0)))
        raise checks.refuse(f"variance of {prior.names[k]} in the prior", "> 0", float(variance[k]))
    sd = np.sqrt(variance[known])
    return known, prior.covariance[np.ix_(known, known)] / np.outer(sd, sd)


class _Triangle:
    """Triangle of the rows and targets, and that of the rows with squared weights, in one row of numbers."""

    def __init__(self, size: int, prior: Estimate | None, noise_sd: float | None) -> None:
        self._size, self._entry, self._noise_sd = size, np.zeros(size + 1), noise_sd
        self.power = _POWER if noise_sd is None else 0.0
        self.state = np.zeros(size * (2 * size + 1) + COUNT + 1)
        if prior is not None and noise_sd is not None:
            array, double, _ = self._parts()
            double[:] = array[:, :size] = _root(prior, noise_sd)
            array[:, size] = double @ np.where(np.isinf(np.diag(prior.covariance)), 0.0, prior.value)

    def _parts(self) -> tuple[Floats, Floats, Floats]:
        """Views of both triangles, and of what is behind them."""
        size = self._size
        array, double, sums = np.split(self.state, [size * (size + 1), size * (2 * size + 1)])
        return array.reshape(size, size + 1), double.reshape(size, size), sums

    def take(self, row: Floats, target: float, forgetting: float) -> None:
        size = self._size
        self._entry[:size], self._entry[size] = row, target
        triangle_step(self.state, size, self.power, self._entry, forgetting)
        if self.state[RESIDUAL - COUNT - 1] == inf:
            raise OverflowError(f"target is too far from what the values predict: {target:g}")

    def estimate(self, names: tuple[str, ...], units: tuple[str, ...]) -> Estimate:
        # by LAPACK, as all fits; `triangle_told`, which is exported, is equal to rounding
        size, (array, squared, sums) = self._size, self._parts()
        weight, squares, residual = (float(sums[k]) for k in (WEIGHT, SQUARES, RESIDUAL))
        rows = np.vstack([array[:, :size], np.zeros(size)])
        solver = SquareRoot(rows, np.append(array[:, size], sqrt(residual)))
        double = squared / solver.length
        half = double @ solver.backward
        root = half @ solver.backward.T  # the covariance is its square: no variance can be negative
        self._say_lost(solver, double, root, weight)
        sandwich = root.T @ root / np.outer(solver.length, solver.length)
        if self._noise_sd is not None:
            return solver.estimate(self._noise_sd**2 * sandwich, inf, names, units)
        freedom = weight - float(np.sum(half**2))
        if sums[COUNT] <= size or freedom <= FULL * weight:
            solver.determined, freedom = False, 1.0
        # Equivalent number of rows of equal weight (Kish).
        effective = weight**2 / squares if squares else 0.0
        return solver.estimate(solver.square / freedom * sandwich, max(effective - size, 1.0), names, units)

    def _say_lost(self, solver: SquareRoot, double: Floats, root: Floats, weight: float) -> None:
        """Name the values that have lost their digits: squared weights fade twice as fast as weights."""
        rounding = EPS * sqrt(weight) * np.linalg.norm(double) * np.linalg.norm(solver.backward)
        lost = rounding * np.linalg.norm(solver.backward, axis=1) > LOST * np.linalg.norm(root, axis=0)
        solver.loose, solver.determined = solver.loose | lost, solver.determined and not np.any(lost)


def _root(prior: Estimate, noise_sd: float) -> Floats:
    """Triangle of the prior's information, in units of that of one row."""
    known, correlation = _known(prior)
    root = np.zeros((known.size, known.size))
    lower = np.linalg.cholesky(np.linalg.inv(correlation))
    root[np.ix_(known, known)] = noise_sd * lower.T / prior.sd[known]
    return root


def _symmetric(matrix: Floats) -> Floats:
    return np.asarray(0.5 * (matrix + matrix.T))


class _Covariance:
    """Value, inverse information, and covariance under constant noise, both over the noise variance."""

    def __init__(self, prior: Estimate, noise_sd: float) -> None:
        self._value, self._noise_sd = prior.value.copy(), noise_sd
        self._inv_info = prior.covariance / noise_sd**2
        self._true = self._inv_info.copy()
        self._gain = np.zeros(self._value.size)
        self._weight, self._lost = 0.0, False

    def take(self, row: Floats, target: float, forgetting: float) -> None:
        if self._lost:
            return
        covariance_step(self._value, self._inv_info, row, target, forgetting, self._gain)
        keep = np.eye(row.size) - np.outer(self._gain, row)
        with np.errstate(over="ignore", invalid="ignore"):  # of rows that are too long
            self._true = keep @ self._true @ keep.T + np.outer(self._gain, self._gain)
        self._weight = forgetting * self._weight + 1.0
        self._lost = not self._sound()

    def _sound(self) -> bool:
        """Whether the least variance of any combination is well above rounding."""
        variance = self._inv_info.diagonal()
        if not (isfinite(self._true.sum()) and isfinite(self._inv_info.sum()) and variance.min() > 0):
            return False
        sd = np.sqrt(variance)
        least = np.linalg.eigvalsh(self._inv_info / np.outer(sd, sd))[0]
        return bool(EPS * sqrt(self._weight) <= LOST * least)

    def estimate(self, names: tuple[str, ...], units: tuple[str, ...]) -> Estimate:
        if not self._lost:
            return Estimate(names, self._value, self._noise_sd**2 * _symmetric(self._true), units=units)
        message = (
            "the covariance form has wound up and lost its digits: forget less, or use method square_root"
        )
        endless = np.diag(np.full(len(names), np.inf))
        return Estimate(names, np.zeros(len(names)), endless, Status.UNDETERMINED, message, units=units)
