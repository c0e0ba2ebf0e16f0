"""Log-normal roughness after finishing, from tool, path pattern and force."""

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind import sdp
from sdpgrind.base import checks
from sdpgrind.base.budget import afford
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, quantity
from sdpgrind.base.rng import Seed, generator
from sdpgrind.finishing.roughness._terms import NAMES, PATTERNS, SETTINGS, TERMS, checked_patterns, design
from sdpgrind.identify import Estimate


def _tuples(array: Floats) -> Any:
    return tuple(map(_tuples, array)) if array.ndim else float(array)


def _of_shape(*shape: int) -> Any:
    """Check of pure numbers of a shape, kept as tuples."""

    def check(name: str, value: npt.ArrayLike) -> Any:
        array = checks.finite_array(name, value)
        if array.shape != shape:
            raise ValueError(f"{name} must be of shape {shape}; got {array.shape}")
        return _tuples(array)

    return check


def _range(unit: str, default: tuple[float, float]) -> Any:
    """Declare a range of two numbers, 0 < low < high."""

    def check(name: str, value: tuple[float, float]) -> tuple[float, float]:
        low, high = value
        if not 0 < checks.number(name, low, unit) < checks.number(name, high, unit):
            raise checks.refuse(name, "two numbers, 0 < low < high", (low, high), unit)
        return float(low), float(high)

    return custom(check, unit, default=default)


@described("finishing.roughness")
class RoughnessModel(Described):
    """Log-normal roughness R_a of a finished surface.

    ``ln(R_a/µm) = intercept + hilbert5 + zigzag + tool_exponent ln(d/3.5 mm) + force_slope x + force_bend
    x^2`` with x = ln(F/1.111 N) and a normal scatter. The terms hilbert5 and zigzag apply to their own
    pattern only; the pattern hilbert4 has no term. The feed rate has no significant effect (p = 0.31) and no
    term.

    Parameters
    ----------
    coefficients : array_like, shape (6,)
        intercept, hilbert5, zigzag, tool_exponent, force_slope, force_bend; unit 1, of ln(R_a/µm).
    residual_sd : float
        Standard deviation of ln R_a about its mean, unit 1.
    covariance : array_like, shape (6, 6)
        Covariance of the coefficients, unit 1.
    freedom : float
        Degrees of freedom of the residual, unit 1.
    tool_diameter_range, normal_force_range : (float, float)
        Ranges of validity, mm and N.

    Raises
    ------
    ValueError
        A shape is wrong, or the scatter, the covariance or a range is impossible.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> model = fin.roughness.RoughnessModel.published()
    >>> law = model.law("hilbert5", tool_diameter=4.0, normal_force=1.111)
    >>> round(1e3 * float(law.mean), 3), round(1e3 * float(law.sd), 3)  # µm
    (3.576, 0.241)
    >>> round(model.best_force(), 3)  # N
    1.301
    """

    coefficients: npt.ArrayLike = custom(_of_shape(len(NAMES)), "1")
    residual_sd: float = quantity("1", at_least=0)
    covariance: npt.ArrayLike = custom(_of_shape(len(NAMES), len(NAMES)), "1", repr=False)
    freedom: float = quantity("1", above=0)
    tool_diameter_range: tuple[float, float] = _range("mm", (3.0, 4.0))
    normal_force_range: tuple[float, float] = _range("N", (0.556, 1.667))

    def _check(self) -> None:
        _check_covariance(np.asarray(self.covariance))

    @classmethod
    def published(cls) -> Self:
        """Return the least-squares fit of Wang and Jan (2001), Table 2: scatter 6.7 %, values of unit 1.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> [round(b, 4) for b in fin.roughness.RoughnessModel.published().coefficients]
        [1.8658, -0.4732, -0.1581, -0.902, -0.1546, 0.4897]
        """
        from sdpgrind.finishing.roughness._fit import published_estimate

        return cls._of(published_estimate())

    @classmethod
    def _of(cls, estimate: Estimate, **ranges: Any) -> Self:
        size = len(NAMES)
        value, covariance = estimate.value[:size], estimate.covariance[:size, :size]
        return cls(value, estimate["residual_sd"], covariance, estimate.freedom, **ranges)

    @property
    def standard_errors(self) -> Floats:
        """Standard errors of the coefficients, unit 1."""
        return np.sqrt(np.diag(np.asarray(self.covariance)))

    def covers(self, pattern: Any, tool_diameter: npt.ArrayLike, normal_force: npt.ArrayLike) -> bool:
        """Return whether `law` accepts these arguments without ``extrapolate=True``.

        Parameters
        ----------
        pattern : str or array of str
            Any name.
        tool_diameter, normal_force : float or array
            mm and N. NaN is not covered; of arrays, all values must be.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> model = fin.roughness.RoughnessModel.published()
        >>> [model.covers(*at) for at in (("zigzag", 4.0, 1.1), ("zigzag", 6.0, 1.1), ("spiral", 4.0, 1.1))]
        [True, False, False]
        """
        diameter = _inside(np.asarray(tool_diameter, dtype=float), self.tool_diameter_range)
        force = _inside(np.asarray(normal_force, dtype=float), self.normal_force_range)
        return bool(np.all(np.isin(pattern, PATTERNS)) and np.all(diameter) and np.all(force))

    def law(
        self,
        pattern: Any,
        tool_diameter: npt.ArrayLike,
        normal_force: npt.ArrayLike,
        *,
        extrapolate: bool = False,
        uncertain: bool = False,
    ) -> sdp.LogNormal:
        """Return the distribution of R_a, mm.

        Parameters
        ----------
        pattern : str or array of str
            "hilbert4", "hilbert5" or "zigzag".
        tool_diameter, normal_force : float or array
            mm and N; broadcast with the pattern.
        extrapolate : bool
            Allow values outside the ranges of validity.
        uncertain : bool
            Add the uncertainty of the coefficients to the scatter: the predictive distribution.

        Returns
        -------
        sdp.LogNormal
            With the mean and the standard deviation of R_a (mm); the median is exp of the mean logarithm.

        Raises
        ------
        ValueError
            The pattern is unknown, or a value is outside its range.
        """
        rows = self._rows(pattern, tool_diameter, normal_force, extrapolate)
        square = np.full(rows.shape[:-1], self.residual_sd**2)
        if uncertain:
            square = square + np.einsum("...p,pq,...q->...", rows, np.asarray(self.covariance), rows)
        mean = 1e-3 * np.exp(rows @ np.asarray(self.coefficients) + 0.5 * square)
        return sdp.LogNormal(mean, mean * np.sqrt(np.expm1(square)))

    def median(
        self,
        pattern: Any,
        tool_diameter: npt.ArrayLike,
        normal_force: npt.ArrayLike,
        *,
        extrapolate: bool = False,
    ) -> Floats:
        """Return the median R_a, mm; `pattern`, `tool_diameter`, `normal_force`, `extrapolate` of `law`."""
        rows = self._rows(pattern, tool_diameter, normal_force, extrapolate)
        return np.asarray(1e-3 * np.exp(rows @ np.asarray(self.coefficients)))

    def sample(
        self,
        pattern: Any,
        tool_diameter: npt.ArrayLike,
        normal_force: npt.ArrayLike,
        *,
        rng: Seed,
        size: int | tuple[int, ...] | None = None,
        rounding: float | None = None,
        extrapolate: bool = False,
    ) -> Floats:
        """Draw readings of R_a, mm.

        Parameters
        ----------
        pattern, tool_diameter, normal_force, extrapolate
            As in `law`; mm and N.
        rng : int, Generator or SeedSequence
            Source of randomness.
        size : int or tuple of int, optional
            Number of readings. Default: one for each setting.
        rounding : float, optional
            Resolution and least value of the readings, mm: units.um(0.25) in Table 2. None: no rounding.

        Examples
        --------
        >>> from sdpgrind import finishing as fin, units
        >>> model = fin.roughness.RoughnessModel.published()
        >>> float(model.sample("zigzag", 3.0, 1.111, rng=0, rounding=units.um(0.25)).round(5))  # mm
        0.0065
        """
        drawn = self.law(pattern, tool_diameter, normal_force, extrapolate=extrapolate).sample(
            generator(rng), size
        )
        if rounding is None:
            return drawn
        step = checks.positive("rounding", rounding, "mm")
        return np.asarray(np.maximum(np.round(drawn / step), 1.0) * step)

    def responses(
        self,
        settings: Mapping[str, Any],
        *,
        rng: Seed,
        runs: int,
        rounding: float | None = None,
        extrapolate: bool = False,
    ) -> Floats:
        """Draw readings (mm) of a whole study, `runs` times, for `Study.power`.

        Parameters
        ----------
        settings : mapping of str to array, (n,)
            pattern, tool_diameter (mm) and normal_force (N); other factors have no effect.
        rng : int, Generator or SeedSequence
            Source of randomness.
        runs : int
            Number of repetitions.
        rounding, extrapolate
            As in `sample`, mm.

        Returns
        -------
        array, shape (runs, n)
            R_a, mm.
        """
        for name in SETTINGS:
            if name not in settings:
                raise ValueError(f"settings must hold {name}; got {', '.join(settings)}")
        size = (checks.count("runs", runs), np.size(settings["pattern"]))
        afford(f"runs = {runs}", 4 * 8.0 * size[0] * size[1], "fewer runs tell as much")
        values = [settings[name] for name in SETTINGS]
        return self.sample(*values, rng=rng, size=size, rounding=rounding, extrapolate=extrapolate)

    def best_force(self) -> float:
        """Return the force (N) of least roughness within its range, the same for each tool and pattern.

        Examples
        --------
        >>> from sdpgrind import finishing as fin
        >>> round(fin.roughness.RoughnessModel.published().best_force(), 3)  # N
        1.301
        """
        *_, slope, bend = np.asarray(self.coefficients)
        low, high = np.log(np.array(self.normal_force_range) / TERMS.normal_force)
        x = min((low, high), key=lambda end: slope * end + bend * end**2)
        if bend > 0:
            x = float(np.clip(-slope / (2 * bend), low, high))
        return float(TERMS.normal_force * np.exp(x))

    def updated(self, estimate: Estimate) -> Self:
        """Return the model with estimated coefficients and scatter and unchanged ranges.

        Parameters
        ----------
        estimate : Estimate
            Result of `finishing.identify`: coefficients and residual_sd, unit 1.

        Raises
        ------
        ValueError
            The estimate has failed or is of other quantities.
        """
        checks.kind("estimate", estimate, Estimate, ", as finishing.identify gives it")
        if not estimate.ok:
            raise ValueError(f"estimate must have succeeded; got {estimate.message!r}")
        if estimate.names != (*NAMES, "residual_sd"):
            raise ValueError(
                f"estimate must be of {', '.join(NAMES)} and residual_sd; got {', '.join(estimate.names)}"
            )
        return type(self)._of(
            estimate, tool_diameter_range=self.tool_diameter_range, normal_force_range=self.normal_force_range
        )

    def _rows(
        self, pattern: Any, tool_diameter: npt.ArrayLike, normal_force: npt.ArrayLike, extrapolate: bool
    ) -> Floats:
        names = checked_patterns(pattern)
        diameter = self._in_range("tool_diameter", tool_diameter, self.tool_diameter_range, "mm", extrapolate)
        force = self._in_range("normal_force", normal_force, self.normal_force_range, "N", extrapolate)
        return design(names, diameter, force)

    @staticmethod
    def _in_range(
        name: str, value: npt.ArrayLike, ends: tuple[float, float], unit: str, extrapolate: bool
    ) -> Floats:
        array = checks.finite_array(name, value, unit)
        if np.any(array <= 0):
            raise checks.refuse(name, "> 0", float(array.min()), unit)
        outside = ~_inside(array, ends)
        if np.any(outside) and not extrapolate:
            rule = f"in [{ends[0]:g}, {ends[1]:g}], where the model is known, or extrapolate=True given"
            raise checks.refuse(name, rule, float(array[outside].flat[0]), unit)
        return array


def _check_covariance(matrix: Floats) -> None:
    """Refuse a matrix that is not symmetric and positive semidefinite within rounding."""
    rounding = 1e-9 * float(np.abs(matrix).max())
    if np.any(np.abs(matrix - matrix.T) > rounding):
        i, j = (int(k) for k in np.argwhere(np.abs(matrix - matrix.T) > rounding)[0])
        raise ValueError(
            "covariance must be symmetric (1);"
            f" got {matrix[i, j]:g} at [{i}, {j}], {matrix[j, i]:g} at [{j}, {i}]"
        )
    least = float(np.linalg.eigvalsh(matrix)[0])
    if least < -rounding:
        raise ValueError(
            f"covariance must be positive semidefinite, no eigenvalue below 0 (1); got {least:g}"
        )


def _inside(array: Floats, ends: tuple[float, float]) -> npt.NDArray[np.bool_]:
    """Whether values are in a range, within rounding; NaN is not."""
    return np.asarray((array >= ends[0] * (1 - 1e-9)) & (array <= ends[1] * (1 + 1e-9)))
