"""Adaptations one after the other: what is recommended, and the sharpness of the wheel."""

from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._learn.margins import ChanceMargin, RoundnessMargin, adaptable
from sdpgrind.plunge._model.problem import CycleProblem


class SharpnessUpdate:
    """Give the controller the wear flat area (0..1, dimensionless) of the last part: post-cycle adaptation, Dong's section 4.

    What a controller has learned during the part is taken as it is; else the mean over the part by its power.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation")
    >>> controller = plunge.CycleController(problem.replace(wear_flat_area=0.0234), safety_margin=0.05, online=False)
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), controller, parts=2, adapt=plunge.SharpnessUpdate())
    >>> round(float(log["controller"].wear_flat_area_planned[-1]), 3)  # 0..1
    0.026
    """

    def next(self, controller: CycleController, part_log: Any) -> CycleController:
        """Return the controller of the next part, with another wear flat area (unit 1).

        Parameters
        ----------
        controller : CycleController
            That of the last part, as it began.
        part_log : Log
            Of the last part.
        """
        if adaptable(controller).law.online:
            planned = part_log.column("controller", "wear_flat_area_planned")
            area = float(planned[np.isfinite(planned)][-1])
        else:
            from sdpgrind.plunge._identify.identify import identify

            estimate = identify(part_log, "wear_flat_area", problem=controller.problem)
            if not estimate.ok:
                return controller
            area = estimate["wear_flat_area"]
        return controller.replace(
            problem=controller.problem.replace(wear_flat_area=float(np.clip(area, 1e-4, 1.0)))
        )


class Chain:
    """Adaptations one after the other.

    Parameters
    ----------
    *adaptations
        Each with ``next(controller, part_log)``.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> len(plunge.Chain(plunge.SharpnessUpdate(), plunge.ChanceMargin()).adaptations)  # dimensionless
    2
    """

    def __init__(self, *adaptations: Any) -> None:
        self.adaptations = tuple(
            checks.able("adaptation", each, "an adaptation", "next") for each in adaptations
        )

    def next(self, controller: Any, part_log: Any) -> Any:
        """Return the controller of the next part; each sees the log, units as there, and what the one before made.

        Parameters
        ----------
        controller : controller
            That of the last part, as it began.
        part_log : Log
            Of the last part.
        """
        for each in self.adaptations:
            controller = each.next(controller, part_log)
        return controller


def adaptation(
    problem: CycleProblem, *, confidence: float = 0.999, power_gain_tolerance: float = 0.0
) -> Chain:
    """Return what is recommended: a chance margin against burning, and one of its own for roundness.

    A controller that learns during the part needs nothing else; others are given the sharpness of the part before.

    Parameters
    ----------
    problem : CycleProblem
        What is ground, in mm and s.
    confidence : float
        Probability that the next part is neither burned nor out of round.
    power_gain_tolerance : float
        By how much the power monitor may show too little, relative.

    Examples
    --------
    >>> from sdpgrind import plunge
    >>> type(plunge.adaptation(plunge.preset("simulation"))).__name__  # margins in mm
    'Chain'
    """
    checks.kind("problem", problem, CycleProblem, " (see plunge.preset)")
    margin = ChanceMargin(confidence, power_gain_tolerance=power_gain_tolerance)
    return Chain(_OfflineOnly(SharpnessUpdate()), margin, RoundnessMargin(confidence))


class _OfflineOnly:
    """An adaptation of controllers that do not learn during the part."""

    def __init__(self, adaptation: Any) -> None:
        self.adaptation = adaptation

    def next(self, controller: CycleController, part_log: Any) -> Any:
        return controller if controller.law.online else self.adaptation.next(controller, part_log)
