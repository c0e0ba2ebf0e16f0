"""A learned problem handed to a controller; where no rate keeps its confidence, with the greatest."""

import warnings
from typing import Any

from sdpgrind.base.warned import warn
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._model.problem import CycleProblem, greatest_confidence

_SHORT = 1.01  # chosen: share of the least chance of burning, so that a rate is found


def changed(problem: CycleProblem, **values: Any) -> CycleProblem:
    """Problem with learned values; what it warns of was told of the one before."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return problem.replace(**values)


def informed(controller: CycleController, problem: CycleProblem, confidence: float) -> CycleController:
    """Controller of the next part with a learned problem.

    A series must go on: where what was learned leaves no rate of the asked confidence, the part is ground
    with the greatest that there is, and a warning says so.
    """
    if controller.sparkout == "printed" or not problem.uncertainty.burning_sd:
        return controller.replace(problem=problem)
    most = greatest_confidence(problem, problem.learned_chance)
    if most >= confidence:
        return controller.replace(problem=problem, confidence=confidence)
    if 1.0 - most > 0.5 / _SHORT:
        raise ValueError(
            f"B = {problem.model.burning.B:.4g} as learned burns at every infeed rate: cool the process"
        )
    warn(
        f"no infeed rate keeps a confidence of {confidence:g} with wheel and burn threshold as learned: the"
        f" next part is ground with {most:.4g}; inspecting parts narrows the doubt"
    )
    return controller.replace(problem=problem, confidence=1.0 - _SHORT * (1.0 - most))
