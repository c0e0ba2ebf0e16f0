"""Starts that are learned from the log of the previous part."""

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from sdpgrind.base import checks
from sdpgrind.locus._control.area_controller import AreaController
from sdpgrind.locus._control.controller import LocusController

Controller = TypeVar("Controller", LocusController, AreaController)
_TABLE = "controller"


class LearnedStart:
    """Start each part at the last coordinate of the previous part: Koren (1989), section 6.

    A part too short for an update leaves the start unchanged. An `AreaController` starts at its last
    estimate, moved on by the readings of the finished part, such as a roughness.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import locus
    >>> problem = locus.preset("grinding")
    >>> controller = locus.LocusController(locus.plan(problem), along="infeed_rate")
    >>> log = hwsim.run(hwsim.AdaptiveGrinder(problem), controller, parts=2, adapt=locus.LearnedStart())
    >>> first, second = log.outcome.time.values  # s
    >>> bool(second < first)
    True
    """

    def next(self, controller: Controller, part_log: Any) -> Controller:
        """Return the controller of the next part, with its start (coordinate or hidden states, in its unit).

        Parameters
        ----------
        controller : LocusController or AreaController
            Controller of the previous part, in its initial state.
        part_log : Log
            Log of the previous part.
        """
        if isinstance(controller, AreaController):
            return _on_area(controller, part_log)
        checks.kind("controller", controller, LocusController, " or an AreaController")
        places = np.asarray(part_log.column(_TABLE, "coordinate_planned"))
        last = places[np.isfinite(places)]
        return controller.replace(start=float(last[-1])) if last.size else controller


def _on_area(controller: AreaController, part_log: Any) -> AreaController:
    """Return the controller with the estimate at the end of a part as its start."""
    hidden = controller.curve.problem.hidden_names
    said = np.array([part_log.column(_TABLE, f"{name}_planned") for name in hidden])
    known = np.flatnonzero(np.isfinite(said).all(axis=0))
    if not known.size:
        return controller
    start = dict(zip(hidden, map(float, said[:, known[-1]]), strict=True))
    learned: AreaController = controller.replace(start=start)
    if known[-1] == said.shape[1] - 1:  # the last readings have been used
        return learned
    after: AreaController = learned.replace(hold="none", lag={})  # at the end of a part all has settled
    after.step(**_last(controller, part_log))
    found: AreaController = learned.replace(start=after.hidden)
    return found


def _last(controller: AreaController, part_log: Any) -> Mapping[str, float]:
    """Return the last measurements of a part: responses, and controls where they are measured."""
    table = part_log[_TABLE]
    names = (*controller.curve.responses, *controller.curve.names)
    return {name: float(table[name].values[-1]) for name in names if name in table.variables}
