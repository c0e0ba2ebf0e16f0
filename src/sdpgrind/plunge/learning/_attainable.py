"""A learned problem handed to a controller; where no rate keeps its confidence, with the greatest."""

import warnings
from typing import Any

from sdpgrind.base.warned import warn
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._model.always_burns import cooled
from sdpgrind.plunge._model.problem import CycleProblem, greatest_confidence

_SHORT = 1.01  # chosen: share of the least chance of burning, so that a rate is found
_EVEN = 0.5  # chosen: least confidence, that of a wheel or threshold at the edge of burning at every rate
_SPARE = 1e-3  # chosen: distance from that edge over burning_sd; hides the rounding of the coolest rate


def changed(problem: CycleProblem, **values: Any) -> CycleProblem:
    """Problem with learned values; what it warns of was told of the one before.

    A series must go on: where the work burns at every rate with the wear flat area or B as learned, the next
    part gets the nearest with which some rate does not, and a warning says so. Its controller aims at the
    coolest rate, learns within the part how dull the wheel is, and reports ``saturated``.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        of_model = {name: values.pop(name) for name in ("wear_flat_area", "burning") if name in values}
        learned = problem.model.replace(**of_model)
        doubt = values.get("burning_sd", problem.uncertainty.burning_sd) or 0.0
        model = cooled(problem.model, learned, _SPARE * doubt)
        kept = problem.replace(**values, wear_flat_area=model.wear_flat_area, burning=model.burning)
    if model is not learned:
        warn(
            f"the work burns at every infeed rate with wear_flat_area = {learned.wear_flat_area:.3g} and"
            f" B = {learned.burning.B:.4g} as learned: the next part is ground at the coolest; dress the"
            " wheel, or cool the process"
        )
    return kept


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
    warn(
        f"no infeed rate keeps a confidence of {confidence:g} with wheel and burn threshold as learned: the"
        f" next part is ground with {most:.4g}; inspecting parts narrows the doubt"
    )
    return controller.replace(problem=problem, confidence=max(1.0 - _SHORT * (1.0 - most), _EVEN))
