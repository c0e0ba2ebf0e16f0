"""Margins learned between parts: they shrink to the value that noise and scatter require."""

from math import exp, floor, inf, log
from typing import Any

import numpy as np
from scipy.special import ndtri

from sdpgrind.base import checks
from sdpgrind.plunge._control.controller import CycleController
from sdpgrind.plunge.learning._attainable import changed
from sdpgrind.plunge.learning._readings import (
    at_size,
    measured_slack,
    noise_of_slack,
    scatter_of_roundness,
    scatter_of_slack,
)

_BIN = 5e-4  # chosen: step of the margins at which noise is simulated, mm
# chosen: relative step of the learned values at which noise is simulated. measured: within it the standard
# deviation of the roundness, from 64 parts, scatters by 4 %, and a quarter is added to it
_SHARE = 0.02
_DOUBT = 1.25  # chosen: upper confidence factor of a standard deviation from a few dozen readings


class MarginBounding:
    """Recursive Constraint Bounding of the safety margin: Dong, Danai and Malkin (2004), (8) and (9).

    After each part the margin m shrinks by a share c of the slack d, with a buffer n for noise: to m - c (d -
    n). As printed it is m - c (d + n) while d > n, and stays from then on. After a burned part (d < 0) the
    last good margin returns and the step is halved.

    Parameters
    ----------
    step : float
        Share c of the slack, 0 to 1, unit 1. As printed, more than 1/2 can burn.
    noise_buffer : float
        Buffer n, mm.
    rule : {"contracting", "printed"}
        m - c (d - n), or (9) as printed.
    slack : {"measured", "true"}
        Slack from gauge and power monitor, or, in a simulation, that of the plant.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> from sdpgrind.plunge import learning
    >>> problem = plunge.preset("simulation")
    >>> assumed = problem.replace(wear_flat_area=0.0234)
    >>> controller = plunge.CycleController(assumed, safety_margin=0.05, sparkout="printed")
    >>> rule = learning.MarginBounding(step=0.4)
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), controller, parts=4, adapt=rule)
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
        """Return `controller` with a new safety margin (mm), by the `part_log` of the last part."""
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


class _ConstantFilter:
    """Kalman filter of a constant measured once per part, without prior knowledge."""

    def __init__(self) -> None:
        self.mean, self.variance = 0.0, np.inf

    def learn(self, measured: float, variance: float) -> None:
        gain = 1.0 if np.isinf(self.variance) else self.variance / (self.variance + variance)
        self.mean += gain * (measured - self.mean)
        self.variance = variance if gain == 1.0 else (1 - gain) * self.variance


class ChanceMargin:
    """Least safety margin at which the probability of burning is at most 1 - `confidence`.

    The shortfall m - d of the slack d from the margin m is a constant error of the model: a Kalman filter
    estimates it from one measurement per part. The minimum of noisy readings is biased low; the bias is found
    by simulation with the controller's noise, scaled down where the readings of a part scatter less, and
    subtracted.

    Parameters
    ----------
    confidence : float
        Probability that the next part is not burned.
    part_sd : float
        Standard deviation of the slack between parts beyond noise, mm.
    power_gain_tolerance : float
        Greatest relative error by which the power monitor reads too low; the measured slack cannot show it.
    slack : {"measured", "true"}
        Slack from gauge and power monitor, or, in a simulation, that of the plant.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> from sdpgrind.plunge import learning
    >>> problem = plunge.preset("simulation")
    >>> controller = plunge.CycleController(problem.replace(wear_flat_area=0.0234), safety_margin=0.05)
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), controller, parts=3, adapt=learning.ChanceMargin(0.99))
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
        self.confidence = checks.confidence("confidence", confidence)
        self.part_sd = checks.nonnegative("part_sd", part_sd, "mm")
        self.power_gain_tolerance = checks.within("power_gain_tolerance", power_gain_tolerance, 0.0, 0.5)
        self.slack = checks.one_of("slack", slack, ("measured", "true"))
        self._shortfall = _ConstantFilter()
        self._first: CycleController | None = None

    def next(self, controller: CycleController, part_log: Any) -> CycleController:
        """Return `controller` with a new safety margin (mm), by the `part_log` of the last part."""
        adaptable(controller)
        self._first = controller if self._first is None else self._first
        slack = _slack(self.slack, part_log, controller)
        if np.isnan(slack):
            return controller
        bias, sd = (0.0, 0.0) if self.slack == "true" else self._noise(controller, part_log)
        variance = sd**2 + self.part_sd**2
        self._shortfall.learn(controller.safety_margin - slack - bias, variance)
        spread = np.sqrt(self._shortfall.variance + variance)
        margin = self._shortfall.mean + ndtri(self.confidence) * spread + self._hidden_damage(controller)
        return controller.replace(safety_margin=float(np.clip(margin, 0.0, 0.9 * controller.problem.stock)))

    def _noise(self, controller: CycleController, part_log: Any) -> tuple[float, float]:
        """Bias and standard deviation (mm) of the measured slack; bias scaled by the part's own scatter."""
        assert self._first is not None
        bias, sd, assumed = noise_of_slack(_binned(self._first, controller.safety_margin))
        seen = scatter_of_slack(part_log, controller)
        return bias * min(1.0, _DOUBT * seen / assumed) if seen >= 0 and assumed > 0 else bias, sd

    def _hidden_damage(self, controller: CycleController) -> float:
        """Damage (mm) at the greatest rate that a power monitor of too low a gain hides."""
        problem, rate = controller.problem, controller.problem.command_rate_max
        if problem.model.burn_rate >= rate:
            return 0.0
        shown = problem.model.grinding_power(rate)
        more = problem.model.burn_depth(rate, shown * (1 + self.power_gain_tolerance))
        return float(more - problem.model.burn_depth(rate))


class RoundnessMargin:
    """Least roundness margin that exceeds the roundness limit with probability at most 1 - `confidence`.

    A part that ended before size is ignored.

    Parameters
    ----------
    confidence : float
        Probability that the next part is round enough.
    part_sd : float, optional
        Standard deviation of the out-of-roundness between parts, measurement included, mm. Default:
        simulation of the model with the noise assumed by the controller.

    Raises
    ------
    ValueError
        If a value is out of range.

    Examples
    --------
    >>> import hwsim
    >>> from sdpgrind import plunge
    >>> from sdpgrind.plunge import learning
    >>> problem = plunge.preset("simulation")
    >>> controller = plunge.CycleController(problem, safety_margin=0.002)
    >>> log = hwsim.run(hwsim.PlungeGrinder(problem), controller, parts=3, adapt=learning.RoundnessMargin())
    >>> log.outcome.out_of_round.values
    array([0., 0., 0.])
    """

    def __init__(self, confidence: float = 0.999, *, part_sd: float | None = None) -> None:
        self.confidence = checks.confidence("confidence", confidence)
        self.part_sd = None if part_sd is None else checks.nonnegative("part_sd", part_sd, "mm")
        self._excess = _ConstantFilter()
        self._first: CycleController | None = None
        self._sd = self.part_sd

    def next(self, controller: CycleController, part_log: Any) -> CycleController:
        """Return `controller` with a new roundness margin (mm), by the roundness in `part_log`."""
        problem = adaptable(controller).problem
        self._first = controller if self._first is None else self._first
        if not at_size(part_log):
            return controller
        if self._sd is None:
            self._sd = scatter_of_roundness(_coarse(self._first))
        aim = problem.roundness_max - controller.roundness_margin
        self._excess.learn(float(part_log.figure("roundness")[-1]) - aim, self._sd**2)
        spread = np.sqrt(self._excess.variance + self._sd**2)
        margin = self._excess.mean + ndtri(self.confidence) * spread
        most = 0.9 * (problem.roundness_max - problem.model.roundness_base)
        return controller.replace(roundness_margin=float(np.clip(margin, 0.0, most)))


def adaptable(controller: Any) -> CycleController:
    """Return `controller`; TypeError unless it is a CycleController."""
    return checks.kind("controller", controller, CycleController, " to be adapted")


def _slack(source: str, part_log: Any, controller: CycleController) -> float:
    return float(part_log.figure("slack")[-1]) if source == "true" else measured_slack(part_log, controller)


def _binned(controller: CycleController, margin: float) -> CycleController:
    return controller.replace(safety_margin=_BIN * round(margin / _BIN))


def _coarse(controller: CycleController) -> CycleController:
    """Controller without a margin, its learned values on a grid: series on one machine share a simulation.

    They are rounded down: no rate becomes unsafe by a sharper wheel or by less doubt.
    """
    model, doubts = controller.problem.model, controller.problem.uncertainty
    problem = changed(
        controller.problem,
        wear_flat_area=_rounded_down(model.wear_flat_area),
        normal_force_ratio=_rounded_down(model.normal_force_ratio),
        grinding_ratio=_rounded_down(model.grinding_ratio),
        deflection_sd=_rounded_down(doubts.deflection_sd),
        wheel_wear_sd=_rounded_down(doubts.wheel_wear_sd),
    )
    return controller.replace(problem=problem, safety_margin=0.0)


def _rounded_down(value: float) -> float:
    return exp(_SHARE * floor(log(value) / _SHARE)) if 0.0 < value < inf else value
