"""Adaptations in sequence: the recommended one, and the update of the sharpness."""

from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.warned import warn
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge.learning._attainable import changed
from sdpgrind.plunge.learning._carried import CarriedState
from sdpgrind.plunge.learning._margins import ChanceMargin, RoundnessMargin, adaptable
from sdpgrind.plunge.learning._threshold_update import ThresholdUpdate


class SharpnessUpdate:
    """Update of the wear flat area (unit 1) from the last part: post-cycle adaptation, Dong's section 4.

    A controller that estimates online passes its own estimate on; otherwise the mean over the part by its
    power.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> from sdpgrind.plunge import learning
    >>> problem = plunge.preset("simulation")
    >>> assumed = problem.replace(wear_flat_area=0.0234)
    >>> controller = plunge.CycleController(assumed, safety_margin=0.05, online=False)
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), controller, parts=2, adapt=learning.SharpnessUpdate())
    >>> round(float(log["controller"].wear_flat_area_planned[-1]), 3)  # 0..1
    0.026
    """

    def next(self, controller: CycleController, part_log: Any) -> CycleController:
        """Return `controller` with the wear flat area (unit 1) of the last part, by its `part_log`."""
        if adaptable(controller).learns:
            planned = part_log.column("controller", "wear_flat_area_planned")
            area = float(planned[np.isfinite(planned)][-1])
        else:
            from sdpgrind.plunge._identify.identify import identify

            estimate = identify(part_log, "wear_flat_area", problem=controller.problem)
            if not estimate.ok:
                return controller
            area = estimate["wear_flat_area"]
        learned = changed(controller.problem, wear_flat_area=float(np.clip(area, 1e-4, 1.0)))
        return controller.replace(problem=learned)


class Chain:
    """Adaptations in sequence.

    Parameters
    ----------
    *adaptations
        Objects with ``next(controller, part_log)``.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> from sdpgrind.plunge import learning
    >>> len(learning.Chain(learning.SharpnessUpdate(), learning.ChanceMargin()).adaptations)  # dimensionless
    2
    """

    def __init__(self, *adaptations: Any) -> None:
        self.adaptations = tuple(
            checks.able("adaptation", each, "an adaptation", "next") for each in adaptations
        )

    def next(self, controller: Any, part_log: Any) -> Any:
        """Return the controller of the next part; each adaptation gets the result of the one before.

        Parameters
        ----------
        controller : controller
            Controller at the start of the last part.
        part_log : Log
            Log of the last part, in its units.
        """
        for each in self.adaptations:
            controller = each.next(controller, part_log)
        return controller


def adaptation(
    problem: CycleProblem, *, confidence: float = 0.999, power_gain_tolerance: float = 0.0
) -> Chain:
    """Return the recommended adaptation: state carried over, roundness, burn threshold where inspected.

    Controllers of the printed cycle, which has no confidence, get the sharpness of the last part and a chance
    margin.

    Parameters
    ----------
    problem : CycleProblem
        Problem, in mm and s; with `burning_sd` the threshold is learned from inspected parts.
    confidence : float
        Probability that the next part is round enough; of the printed cycle, also that it is not burned.
        Against burning the confidence of the controller holds.
    power_gain_tolerance : float
        Deprecated: `power_gain_sd` of the problem's uncertainty. Greatest relative error by which the power
        monitor reads too low, for a chance margin.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> type(plunge.adaptation(plunge.preset("simulation"))).__name__  # margins in mm
    'Chain'
    """
    checks.kind("problem", problem, CycleProblem, " (see plunge.preset)")
    if power_gain_tolerance:
        warn(
            "power_gain_tolerance is deprecated: problem.replace(power_gain_sd=...) declares the doubt of the"
            " gain",
            DeprecationWarning,
        )
    margin = ChanceMargin(confidence, power_gain_tolerance=power_gain_tolerance)
    learned = [CarriedState(), RoundnessMargin(confidence)]
    if problem.uncertainty.burning_sd:
        learned.append(ThresholdUpdate(problem))
    return Chain(_PrintedOnly(SharpnessUpdate()), _PrintedOnly(margin), *learned)


class _PrintedOnly:
    """Adaptation of controllers of the printed cycle."""

    def __init__(self, adaptation: Any) -> None:
        self.adaptation = adaptation

    def next(self, controller: CycleController, part_log: Any) -> Any:
        printed = adaptable(controller).sparkout == "printed"
        return self.adaptation.next(controller, part_log) if printed else controller
