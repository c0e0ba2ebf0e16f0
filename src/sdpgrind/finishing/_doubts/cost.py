"""Roughness that tool and path of the problem leave, by the model at both ends of each interval."""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base.doubts.rows import Doubt
from sdpgrind.base.doubts.stakes import Figure, Stake, stakes
from sdpgrind.finishing._doubts.parts import believed
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.roughness._model import RoughnessModel
from sdpgrind.finishing.roughness._terms import NAMES, PATTERNS


def of_roughness(problem: FinishingProblem, rows: Sequence[Doubt]) -> tuple[Figure | None, tuple[Stake, ...]]:
    """Return the median roughness, um, at the best force, as believed and at the ends of each interval.

    The motion does not depend on it. None: the model does not know the pattern of the path.
    """
    if problem.path.pattern not in PATTERNS:
        return None, ()
    force = problem.model.best_force()
    what = f"median roughness at {force:.3g} N, tool {problem.tool_diameter:g} mm, {problem.path.pattern}"
    figure = Figure(
        what, "um", _roughness(problem, problem.model, force), "by the model; no motion depends on it"
    )
    return figure, stakes(rows, figure, lambda name, value: _with(problem, name, value, force))


def _with(problem: FinishingProblem, name: str, value: float, force: float) -> float | None:
    if name not in NAMES:
        return None
    values = believed(problem.model) | {name: value}
    model = problem.model.replace(coefficients=[values[each] for each in NAMES])
    return _roughness(problem, model, force)


def _roughness(problem: FinishingProblem, model: RoughnessModel, force: float) -> float:
    """Median roughness, um."""
    tool = problem.tool_diameter
    return 1e3 * float(np.asarray(model.median(problem.path.pattern, tool, force, extrapolate=True)))
