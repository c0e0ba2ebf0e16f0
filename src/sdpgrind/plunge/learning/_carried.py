"""Sharpness, deflection and wheel wear as the last part left them, for the next."""

from typing import Any

import numpy as np

from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._control.filter_state import SHARPNESS, STIFFNESS, WEAR, Q
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._model.taken import grinding_ratio
from sdpgrind.plunge._model.uncertainty import Uncertainty
from sdpgrind.plunge.learning._attainable import changed, informed
from sdpgrind.plunge.learning._margins import adaptable
from sdpgrind.plunge.learning._readings import at_size
from sdpgrind.plunge.learning._replay import ReplayedPart, replayed

# chosen: what may change from part to part, over what is declared not to be known. measured: with so narrow a
# doubt of the wear flat area, 60 of 100 parts burn after a wheel dulls by 1.4 at once; as declared none
_DRIFT = 0.2
_REPLAYED = ("time", "command_rate_command", "size", "grinding_power", "power_saturated")


class CarriedState:
    """Estimates of the filter carried from part to part: wear flat area, force ratio (unit 1), wheel wear.

    Each next part begins with what the last one taught. The doubt of the wear flat area stays as declared,
    since a wheel may dull at once and is learned again within a second; those of force ratio and wheel wear
    are what is left, widened by a fifth of what was declared. For one machine, wheel and steel that go on; a
    wheel of its own for each part is not learned. Parts that ended before size, and controllers that do not
    estimate, teach nothing.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> from sdpgrind.plunge import learning
    >>> problem = plunge.preset("simulation")
    >>> grinder = hwsim.PlungeGrinder(problem, truth=problem.model.replace(wear_flat_area=0.0286))
    >>> controller = plunge.CycleController(problem)
    >>> learned = learning.CarriedState().next(controller, hwsim.run(grinder, controller))
    >>> round(learned.problem.model.wear_flat_area, 3), learned.problem.uncertainty.deflection_sd < 0.03
    (0.029, True)
    """

    def __init__(self) -> None:
        self._first: CycleController | None = None

    def next(self, controller: CycleController, part_log: Any) -> CycleController:
        """Return `controller` with values and doubts (relative, unit 1) that `part_log` taught."""
        problem = adaptable(controller).problem
        self._first = controller if self._first is None else self._first
        if not (controller.learns and at_size(part_log)):
            return controller
        part = replayed(_columns(part_log), problem)
        if not part.touched:
            return controller
        learned = _learned(problem, part, self._first.problem.uncertainty)
        return informed(controller, learned, self._first.confidence)


def _columns(part_log: Any) -> Any:
    """Columns of the log of one part: its labels take longer than the replay."""
    columns = {name: part_log.column("controller", name) for name in _REPLAYED}
    return columns if np.all(np.diff(columns["time"]) > 0) else part_log


def _learned(problem: CycleProblem, part: ReplayedPart, declared: Uncertainty) -> CycleProblem:
    """Problem with the estimates of a part and their standard deviations."""
    model, mean, sd = problem.model, part.mean, np.sqrt(np.diag(part.covariance))
    grown = 0.0 if model.wear is None else model.wear.growth * mean[Q]

    def doubt(learned: float, first: float) -> float:
        return min(float(np.hypot(learned, _DRIFT * first)), first)

    return changed(
        problem,
        wear_flat_area=float(np.clip(model.wear_flat_area * mean[SHARPNESS] - grown, 1e-4, 1.0)),
        normal_force_ratio=model.normal_force_ratio / float(mean[STIFFNESS]),
        grinding_ratio=grinding_ratio(model, float(mean[WEAR])),
        deflection_sd=doubt(sd[STIFFNESS] / mean[STIFFNESS], declared.deflection_sd),
        wheel_wear_sd=doubt(sd[WEAR], declared.wheel_wear_sd),
    )
