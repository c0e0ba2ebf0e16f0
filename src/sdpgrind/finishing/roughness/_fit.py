"""Identification of the roughness model from readings, and its leave-one-out errors."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind import identify
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.tables import cells_of, column_of, table_of
from sdpgrind.finishing.roughness._terms import NAMES, PATTERNS, checked_patterns, design
from sdpgrind.finishing.study._study import Study
from sdpgrind.identify import Estimate

_SETTINGS = {"tool_diameter": "mm", "normal_force": "N"}
_NUMBERS = _SETTINGS | {"roughness_ra": "mm"}


def identify_roughness(data: Any, *, throw: bool = True) -> Estimate:
    """Estimate the coefficients of `RoughnessModel` from finished parts.

    Parameters
    ----------
    data : Study, mapping of arrays, table, or log
        Study with the factors pattern, tool_diameter (mm) and normal_force (N) and readings in mm; or these
        factors and roughness_ra (mm) as arrays of one length, or as columns of a log; there, rows without a
        reading are left out.
    throw : bool
        Raise if the data do not determine the coefficients; else the status reports it.

    Returns
    -------
    Estimate
        The six coefficients and residual_sd, unit 1, for `RoughnessModel.updated`.

    Raises
    ------
    ValueError
        A factor or a reading is missing or out of range, there are fewer than 7 readings, or (with `throw`)
        they do not determine all coefficients.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> estimate = identify_roughness(fin.Study.published("wang-2001"))
    >>> round(estimate["tool_exponent"], 4), round(estimate["residual_sd"], 5)
    (-0.902, 0.06737)
    """
    rows, target = _system(data)
    size = len(NAMES)
    if target.size <= size:
        raise ValueError(
            f"data must hold {size + 1} readings or more for {size} coefficients; got {target.size}"
        )
    found = identify.least_squares(rows, target, names=NAMES, throw=False)
    missing = _missing_patterns(rows)
    if not found.ok and missing:
        found = replace(found, message=f"{found.message}; no reading is of the pattern {', '.join(missing)}")
    if throw and not found.ok:
        raise ValueError(found.message)
    left = target - rows @ found.value
    sd = float(np.sqrt(left @ left / found.freedom))
    covariance = np.zeros((size + 1, size + 1))
    covariance[:-1, :-1] = found.covariance
    covariance[-1, -1] = sd**2 / (2 * found.freedom)  # large samples of normal scatter
    message = f"from {target.size} readings" if found.ok else found.message
    names, values = (*NAMES, "residual_sd"), np.append(found.value, sd)
    return Estimate(names, values, covariance, found.status, message, (), found.freedom)


def _missing_patterns(rows: Floats) -> list[str]:
    """Patterns without a row of the design matrix; the first has no column of its own."""
    marks = rows[:, 1 : len(PATTERNS)]
    counts = [np.sum(~np.any(marks, axis=1)), *np.sum(marks, axis=0)]
    return [name for name, count in zip(PATTERNS, counts, strict=True) if count == 0]


@cache
def published_estimate() -> Estimate:
    """Estimate from the published experiment."""
    return identify_roughness(Study.published("wang-2001"))


def _system(data: Any) -> tuple[Floats, Floats]:
    """Design matrix (n, 6) of the model and ln(R_a/µm), (n,)."""
    arrays = _of_study(data) if isinstance(data, Study) else _of_columns(data)
    rough = arrays["roughness_ra"]
    if np.any(rough <= 0) or np.any(rough >= 1):
        worst = rough[(rough <= 0) | (rough >= 1)][0]
        raise checks.refuse("roughness_ra", "in (0, 1); units.um(...) for micrometres", float(worst), "mm")
    return design(arrays["pattern"], arrays["tool_diameter"], arrays["normal_force"]), np.log(1e3 * rough)


def _of_study(study: Study) -> dict[str, npt.NDArray[Any]]:
    if study.unit != "mm":
        raise ValueError(f"the study must be of readings in mm; got the unit {study.unit!r}")
    readings, repeats = study.readings.ravel(), study.readings.shape[1]
    there = ~np.isnan(readings)
    settings = {name: np.repeat(values, repeats)[there] for name, values in study.settings.items()}
    return _of_columns(settings | {"roughness_ra": readings[there]})


def _of_columns(data: Any) -> dict[str, npt.NDArray[Any]]:
    """Pattern, settings (mm, N) and roughness (mm) of each row; those of a log without a reading left out."""
    if not isinstance(data, Mapping) and not hasattr(data, "tiers"):
        raise TypeError(f"data must be a Study, arrays by name or a log; got {checks.shown(data)}")
    table, is_log = table_of(data, "data")
    patterns = np.ravel(np.asarray(cells_of(table, "pattern", ""), dtype=object))
    numbers = {name: column_of(table, name, unit) for name, unit in _NUMBERS.items()}
    for name, values in numbers.items():
        if values.size != patterns.size:
            raise ValueError(f"{name} must have {patterns.size} entries, as pattern has; got {values.size}")
    if is_log:
        read = np.array([isinstance(name, str) and name != "" for name in patterns])
        read &= ~np.any([np.isnan(values) for values in numbers.values()], axis=0)
        patterns, numbers = patterns[read], {name: values[read] for name, values in numbers.items()}
    for name, unit in _NUMBERS.items():
        numbers[name] = checks.finite_array(name, numbers[name], unit)
        if name in _SETTINGS and np.any(numbers[name] <= 0):
            raise checks.refuse(name, "> 0", float(numbers[name].min()), unit)
    return {"pattern": checked_patterns(patterns), **numbers}


class LeaveOneOut(NamedTuple):
    """Leave-one-out errors of the roughness model.

    Attributes
    ----------
    q_squared : float
        Predicted share of the variance of ln R_a, unit 1.
    rms_log : float
        Root mean square error of ln R_a, unit 1.
    rms : float
        Root mean square error of R_a, mm.
    mean_error, worst_error : float
        Mean and greatest error relative to the prediction, unit 1.
    worst_of_reading : float
        Greatest error relative to the reading, unit 1.
    """

    q_squared: float
    rms_log: float
    rms: float
    mean_error: float
    worst_error: float
    worst_of_reading: float


def leave_one_out(data: Any) -> LeaveOneOut:
    """Predict the median of each reading (mm) by a model fitted to all others.

    Parameters
    ----------
    data : Study, mapping of arrays, table, or log
        As for `identify_roughness`, at least 8 readings.

    Returns
    -------
    LeaveOneOut
        Errors, unit 1 and mm.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> found = fin.roughness.leave_one_out(fin.Study.published("wang-2001"))
    >>> round(found.q_squared, 3), round(1e3 * found.rms, 3)  # 1, µm
    (0.918, 0.481)
    """
    return left_out(*_system(data))


def left_out(rows: Floats, target: Floats) -> LeaveOneOut:
    """Leave-one-out errors from residuals and leverages of the rows (n, 6); target ln(R_a/µm)."""
    q, _ = np.linalg.qr(rows)
    residual, leverage = target - q @ (q.T @ target), np.sum(q**2, axis=1)
    if np.any(leverage > 1 - 1e-9):
        raise ValueError(
            "data must determine the model without each reading; not so without reading"
            f" {int(np.argmax(leverage)) + 1}"
        )
    error = residual / (1 - leverage)
    q_squared = 1 - float(error @ error) / float(np.sum((target - target.mean()) ** 2))
    read, predicted = 1e-3 * np.exp(target), 1e-3 * np.exp(target - error)
    off = np.abs(read - predicted)
    return LeaveOneOut(
        q_squared,
        float(np.sqrt(np.mean(error**2))),
        float(np.sqrt(np.mean(off**2))),
        float(np.mean(off / predicted)),
        float(np.max(off / predicted)),
        float(np.max(off / read)),
    )
