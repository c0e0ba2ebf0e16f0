"""Burn threshold learned between parts from what their inspection reads."""

from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.warned import warn
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge.learning._attainable import changed, informed
from sdpgrind.plunge.learning._margins import adaptable
from sdpgrind.plunge.learning._threshold import LEAST_SEVERITY, BurnThreshold

_READINGS = {"severity": "severity_reading", "burned": "burned_reading"}
_ERRORS = {"severity": ("severity_sd",), "burned": ("miss", "false_alarm")}


class ThresholdUpdate:
    """Burn threshold learned from the inspection of each part, as `BurnThreshold` does.

    The readings are those of the log's outcome, `severity_reading` or `burned_reading`, with the errors that
    its inspection states; a part without one teaches nothing, nor does one colder than a tenth of the damage
    temperature. A part that burned where the threshold was thought safe warns: find the cause.

    Parameters
    ----------
    problem : CycleProblem
        Problem with `burning_sd` (unit 1) declared. The threshold rests on its model.
    by : {"severity", "burned"}
        Reading that teaches. A part found good teaches almost nothing.

    Raises
    ------
    ValueError
        If `burning_sd` is not declared, or an argument is out of range.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> from sdpgrind.plunge import learning
    >>> problem = plunge.preset("simulation").replace(burning_sd=0.045)
    >>> grinder = hwsim.PlungeGrinder(problem, inspection=hwsim.Inspection(severity_sd=0.03))
    >>> learner = learning.ThresholdUpdate(problem)
    >>> log = hwsim.run(grinder, plunge.CycleController(problem), parts=3, adapt=learner)
    >>> bool(log.outcome.time[2] < log.outcome.time[0])  # s
    True
    """

    def __init__(self, problem: CycleProblem, *, by: str = "severity") -> None:
        self.by = checks.one_of("by", by, _READINGS)
        self.threshold = BurnThreshold(problem)
        self._first: CycleController | None = None
        self._taught = False

    def next(self, controller: CycleController, part_log: Any) -> CycleController:
        """Return `controller` with B, J/(mm^2 s^(1/2)), and its doubt as learned from `part_log`."""
        if self._first is None:
            self._first = adaptable(controller)
            asked = part_log.outcome.attrs.get("confidence", controller.confidence)
            self.threshold.confidence = float(asked)  # of the series, which a part may have to fall short of
        self._read(part_log)
        if not self._taught:
            return controller
        found = self.threshold.estimate  # again without a reading: the wheel may allow what it did not before
        burning = controller.problem.model.burning.replace(B=found["B"])
        learned = changed(controller.problem, burning=burning, burning_sd=found["burning_sd"])
        return informed(controller, learned, self.threshold.confidence)

    def _read(self, part_log: Any) -> None:
        """Update the threshold by the reading of a part, if there is one."""
        stated = part_log.outcome
        if _READINGS[self.by] not in stated:
            return
        reading = float(stated[_READINGS[self.by]].values[-1])
        if not np.isfinite(reading) or (self.by == "severity" and 0.0 < reading < LEAST_SEVERITY):
            return  # no reading, or of a part so cold that it tells nothing
        known = {name: float(stated.attrs[name]) for name in _ERRORS[self.by] if name in stated.attrs}
        read: dict[str, Any] = {self.by: bool(reading) if self.by == "burned" else reading, **known}
        self.threshold.update(part_log, part=None, **read)
        self._taught = True
        if not self.threshold.estimate.ok:
            warn(self.threshold.estimate.message)
