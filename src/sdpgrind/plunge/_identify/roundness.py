"""Out-of-roundness over the depth of cut of the last turn, from parts that end at different rates."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sdpgrind import identify as idf
from sdpgrind.base.tables import table_of
from sdpgrind.plunge._identify.contact import course, fitted
from sdpgrind.plunge._identify.cycles import Cycle, cycles, fault
from sdpgrind.plunge._model.problem import CycleProblem

NAMES, UNITS = ("roundness_base", "roundness_gain"), ("mm", "1")
_APART = 2.0  # chosen: ratio of final rates; nearer ones leave gain and base apart by noise
_PARTS = 3  # derived: two values and their scatter


def roundness(data: Any, problem: CycleProblem, part: int | Sequence[int] | None) -> idf.Estimate:
    """R_0 and k_r by least squares of the measured roundness; see `plunge.identify`."""
    pairs = [(cycle, read) for cycle, read in _measured(data, part) if np.isfinite(read) and not fault(cycle)]
    depths = np.array([_last_depth(cycle, problem) for cycle, _ in pairs])
    if len(pairs) < _PARTS:
        return _failed(
            f"{len(pairs)} parts with roundness and size are too few: at least {_PARTS} are needed"
        )
    low, high = float(depths.min()), float(depths.max())
    if not low > 0.0 or high < _APART * low:
        rates = problem.model.turns * np.array([low, high])
        return _failed(
            f"final rates of {rates[0]:.3g} to {rates[1]:.3g} mm/s are less than a factor {_APART:g} apart"
        )
    matrix = np.column_stack([np.ones_like(depths), depths])
    found = idf.least_squares(matrix, [read for _, read in pairs], names=NAMES, units=UNITS, throw=False)
    if not found["roundness_gain"] > 0.0 or found["roundness_base"] < 0.0:
        return _failed(f"roundness does not rise with the final rate as R_0 + k_r v/n ({found!r})")
    return found


def _failed(reason: str) -> idf.Estimate:
    status, endless = idf.Status.NOT_IDENTIFIED, np.diag([np.inf, np.inf])
    return idf.Estimate(NAMES, np.zeros(2), endless, status, f"{status}: {reason}", UNITS)


def _measured(data: Any, part: int | Sequence[int] | None) -> list[tuple[Cycle, float]]:
    """Parts with their roundness (mm): the last reading of a column, else of the outcome of a log."""
    table, _ = table_of(data, "controller")
    if "roundness" in table:
        column = idf.series(data, {"roundness": "mm"}, tier="controller", part=part)
        return list(zip(cycles(data, part=part), map(_last, column), strict=True))
    outcome = getattr(data, "outcome", {})
    if "roundness" not in outcome:
        raise ValueError("data must hold roundness (mm) of each part, as a column or in the outcome of a log")
    read = np.asarray(outcome["roundness"], dtype=float)
    numbers = range(read.size) if part is None else np.atleast_1d(part).tolist()
    return [(cycles(data, part=int(k))[0], float(read[int(k)])) for k in numbers]


def _last(column: idf.Series) -> float:
    known = column["roundness"][np.isfinite(column["roundness"])]
    return float(known[-1]) if known.size else np.nan


def _last_depth(cycle: Cycle, problem: CycleProblem) -> float:
    """Depth of cut of the last turn, mm, by the model corrected by the sizes."""
    zero, scale, _ = fitted(cycle, problem.model).value
    rate = float(course(cycle, problem.model, zero, scale).infeed_rate[-1])
    return rate / problem.model.turns
