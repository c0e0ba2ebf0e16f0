"""Margins that are learned between parts: they shrink to what noise and scatter need."""

from typing import Any

import numpy as np
from scipy.special import ndtri

from sdpgrind.base import checks
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge._learn.readings import (
    at_size,
    measured_slack,
    noise_of_slack,
    scatter_of_roundness,
    scatter_of_slack,
)

_BIN = 5e-4
"""Margins (mm) between which noise does the same."""
_DOUBT = 1.25
"""Scatter that a few dozens of readings may well have, over the one that they show."""


class MarginBounding:
    """Recursive Constraint Bounding of the safety margin: Dong, Danai and Malkin (2004), (8) and (9).

    After each part the margin m shrinks by a share of the slack d that was left, with a buffer n for noise: to m - c (d - n).
    As printed it is m - c (d + n) while d > n, and stays from then on. A part that seems burned (d < 0) brings the last good
    margin back and halves the step.

    Parameters
    ----------
    step : float
        Share c of the slack that is taken, 0 to 1, unit 1. As printed, more than 1/2 can burn.
    noise_buffer : float
        Slack n that is left for noise, mm.
    rule : {"contracting", "printed"}
        Which of both.
    slack : {"measured", "true"}
        From gauge and power monitor, or, in a simulation, what the plant knows.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation")
    >>> controller = plunge.CycleController(problem.replace(wear_flat_area=0.0234), safety_margin=0.05, sparkout="printed")
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), controller, parts=4, adapt=plunge.MarginBounding(step=0.4))
    >>> bool(log.outcome.time[-1] < log.outcome.time[0])  # s
    True
    """

    def __init__(
        self,
        step: float = 0.25,
        noise_buffer: float = 0.005,
        *,
        rule: str = "contracting",
        slack: str = "measured",
    ) -> None:
        self.step = checks.within("step", step, 0.0, 1.0)
        self.noise_buffer = checks.nonnegative("noise_buffer", noise_buffer, "mm")
        self.rule = checks.one_of("rule", rule, ("contracting", "printed"))
        self.slack = checks.one_of("slack", slack, ("measured", "true"))
        self._good: float | None = None
        self._stopped = False

    def next(self, controller: CycleController, part_log: Any) -> CycleController:
        """Return the controller of the next part, with another margin (mm).

        Parameters
        ----------
        controller : CycleController
            That of the last part, as it began.
        part_log : Log
            Of the last part.
        """
        adaptable(controller)
        slack = _slack(self.slack, part_log, controller)
        return controller.replace(safety_margin=self._margin(controller.safety_margin, slack))

    def _margin(self, margin: float, slack: float) -> float:
        if np.isnan(slack) or self._stopped:
            return margin
        if slack < 0:
            self.step /= 2
            return margin if self._good is None else self._good
        self._good = margin
        if self.rule == "printed" and slack <= self.noise_buffer:
            self._stopped = True
            return margin
        buffer = self.noise_buffer if self.rule == "printed" else -self.noise_buffer
        return max(margin - self.step * (slack + buffer), 0.0)


class _Bias:
    """Kalman's filter of a constant that is measured once a part; before the first measurement nothing is known."""

    def __init__(self) -> None:
        self.mean, self.variance = 0.0, np.inf

    def learn(self, measured: float, variance: float) -> None:
        gain = 1.0 if np.isinf(self.variance) else self.variance / (self.variance + variance)
        self.mean += gain * (measured - self.mean)
        self.variance = variance if gain == 1.0 else (1 - gain) * self.variance


class ChanceMargin:
    """The least safety margin at which a part burns with no more than a given probability.

    What the slack d falls short of the margin, m - d, is a constant of the model's error: it is measured once a part and
    filtered (Kalman). The least of many noisy readings is too small; by how much is found by simulation, with the noise that the
    controller reckons with, and taken off: less of it where the readings of a part scatter less than that.

    Parameters
    ----------
    confidence : float
        Probability that the next part is not burned.
    part_sd : float
        Scatter of the slack from part to part that noise does not explain, mm.
    power_gain_tolerance : float
        By how much the power monitor may show too little, relative: no slack that it measures tells of that.
    slack : {"measured", "true"}
        From gauge and power monitor, or, in a simulation, what the plant knows.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation")
    >>> controller = plunge.CycleController(problem.replace(wear_flat_area=0.0234), safety_margin=0.05)
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), controller, parts=3, adapt=plunge.ChanceMargin(0.99))
    >>> bool(log.outcome.time[-1] < 12.3), log.outcome.burned.values  # s
    (True, array([0., 0., 0.]))
    """

    def __init__(
        self,
        confidence: float = 0.99,
        *,
        part_sd: float = 2e-4,
        power_gain_tolerance: float = 0.0,
        slack: str = "measured",
    ) -> None:
        self.confidence = _probability(confidence)
        self.part_sd = checks.nonnegative("part_sd", part_sd, "mm")
        self.power_gain_tolerance = checks.within("power_gain_tolerance", power_gain_tolerance, 0.0, 0.5)
        self.slack = checks.one_of("slack", slack, ("measured", "true"))
        self._shortfall = _Bias()
        self._first: CycleController | None = None

    def next(self, controller: CycleController, part_log: Any) -> CycleController:
        """Return the controller of the next part, with another margin (mm).

        Parameters
        ----------
        controller : CycleController
            That of the last part, as it began.
        part_log : Log
            Of the last part.
        """
        self._first = adaptable(controller) if self._first is None else self._first
        slack = _slack(self.slack, part_log, controller)
        if np.isnan(slack):
            return controller
        bias, sd = (0.0, 0.0) if self.slack == "true" else self._noise(controller, part_log)
        variance = sd**2 + self.part_sd**2
        self._shortfall.learn(controller.safety_margin - slack - bias, variance)
        spread = np.sqrt(self._shortfall.variance + variance)
        margin = self._shortfall.mean + ndtri(self.confidence) * spread + self._hidden(controller)
        return controller.replace(safety_margin=float(np.clip(margin, 0.0, 0.9 * controller.problem.stock)))

    def _noise(self, controller: CycleController, part_log: Any) -> tuple[float, float]:
        """Bias and scatter (mm) of the measured slack; no more bias is taken off than the readings of the part scatter for."""
        assert self._first is not None
        bias, sd, reckoned = noise_of_slack(_binned(self._first, controller.safety_margin))
        seen = scatter_of_slack(part_log, controller)
        return bias * min(1.0, _DOUBT * seen / reckoned) if seen >= 0 and reckoned > 0 else bias, sd

    def _hidden(self, controller: CycleController) -> float:
        """Depth of damage (mm) that a power monitor with too small a gain does not show, at the greatest rate."""
        problem, rate = controller.problem, controller.problem.command_rate_max
        if problem.model.burn_rate >= rate:
            return 0.0
        shown = problem.model.grinding_power(rate)
        more = problem.model.burn_depth(rate, shown * (1 + self.power_gain_tolerance))
        return float(more - problem.model.burn_depth(rate))


class RoundnessMargin:
    """Aim at so much less out-of-roundness that a part is beyond the limit with no more than a given probability.

    A part that was broken off before it came to size teaches nothing.

    Parameters
    ----------
    confidence : float
        Probability that the next part is round enough.
    part_sd : float, optional
        Scatter of the out-of-roundness from part to part, its measurement included, mm; when left out, by simulation of the
        model with the noise that the controller reckons with.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> problem = plunge.preset("simulation")
    >>> controller = plunge.CycleController(problem, safety_margin=0.002)
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), controller, parts=3, adapt=plunge.RoundnessMargin())
    >>> log.outcome.out_of_round.values
    array([0., 0., 0.])
    """

    def __init__(self, confidence: float = 0.999, *, part_sd: float | None = None) -> None:
        self.confidence = _probability(confidence)
        self.part_sd = None if part_sd is None else checks.nonnegative("part_sd", part_sd, "mm")
        self._excess = _Bias()
        self._first: CycleController | None = None

    def next(self, controller: CycleController, part_log: Any) -> CycleController:
        """Return the controller of the next part, which aims at another out-of-roundness (mm).

        Parameters
        ----------
        controller : CycleController
            That of the last part, as it began.
        part_log : Log
            Of the last part, with the out-of-roundness that was measured after it.
        """
        problem = adaptable(controller).problem
        self._first = controller if self._first is None else self._first
        if not at_size(part_log):
            return controller
        sd = scatter_of_roundness(_binned(self._first, 0.0)) if self.part_sd is None else self.part_sd
        aim = problem.roundness_max - controller.roundness_margin
        self._excess.learn(float(part_log.figure("roundness")[-1]) - aim, sd**2)
        spread = np.sqrt(self._excess.variance + sd**2)
        margin = self._excess.mean + ndtri(self.confidence) * spread
        most = 0.9 * (problem.roundness_max - problem.model.roundness_base)
        return controller.replace(roundness_margin=float(np.clip(margin, 0.0, most)))


def adaptable(controller: Any) -> CycleController:
    """Return `controller`, which must be one whose margins can be learned."""
    return checks.kind("controller", controller, CycleController, " to be adapted")


def _slack(source: str, part_log: Any, controller: CycleController) -> float:
    return float(part_log.figure("slack")[-1]) if source == "true" else measured_slack(part_log, controller)


def _binned(controller: CycleController, margin: float) -> CycleController:
    return controller.replace(safety_margin=_BIN * round(margin / _BIN))


def _probability(confidence: float) -> float:
    if not 0.5 <= checks.number("confidence", confidence) < 1:
        raise checks.refuse("confidence", "a probability in [0.5, 1)", confidence)
    return confidence
