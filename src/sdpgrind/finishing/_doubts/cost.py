"""Roughness that tool and path of the problem leave, by the model at both ends of each interval."""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake, stakes, together
from sdpgrind.finishing._doubts.parts import FittedRoughness
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.roughness._model import RoughnessModel
from sdpgrind.finishing.roughness._terms import NAMES, PATTERNS
from sdpgrind.identify import Estimate

_ROUNDING = 1e-9  # chosen: relative; forces that are alike
_ALONE = "by the model; no motion depends on it"
_JOINTLY = f"{_ALONE}; below, the other coefficients of the fit go with the one at its end"


def of_roughness(
    problem: FinishingProblem, rows: Sequence[Doubt], fitted: FittedRoughness | None
) -> tuple[Figure | None, tuple[Stake, ...]]:
    """Return the median roughness, um, at the best force, as believed and at the ends of each interval.

    The motion does not depend on it. None: the model does not know the pattern of the path.
    """
    if problem.path.pattern not in PATTERNS:
        return None, ()
    force = problem.model.best_force()
    what = f"median roughness at {force:.3g} N, tool {problem.tool_diameter:g} mm, {problem.path.pattern}"
    value = _roughness(problem, problem.model, force)
    if fitted is None:
        return Figure(what, "um", value, _ALONE), ()
    figure = Figure(what, "um", value, _JOINTLY)
    found = stakes(rows, figure, lambda name, end: _with(problem, fitted.estimate, name, end, force))
    model, best = fitted.problem.model, fitted.problem.model.best_force()
    moved = "" if np.isclose(best, force, rtol=_ROUNDING, atol=0.0) else f"at {best:.3g} N"
    return figure, together(found, lambda: _roughness(problem, model, best), moved)


def _with(
    problem: FinishingProblem, estimate: Estimate, name: str, value: float, force: float
) -> float | None:
    if name not in NAMES:
        return None
    told = given(estimate, name, value)
    return _roughness(problem, problem.model.replace(coefficients=told[: len(NAMES)]), force)


def given(estimate: Estimate, name: str, value: float) -> list[float]:
    """Return the values that are likeliest where one of them is given: a fit tells them jointly."""
    k = estimate.names.index(name)
    column = estimate.covariance[:, k]
    share = column / column[k] if column[k] > 0 else np.zeros_like(column)
    told = estimate.value + share * (value - estimate.value[k])
    return [float(each) for each in told]


def _roughness(problem: FinishingProblem, model: RoughnessModel, force: float) -> float:
    """Median roughness, um."""
    tool = problem.tool_diameter
    return 1e3 * float(np.asarray(model.median(problem.path.pattern, tool, force, extrapolate=True)))
