"""A part on an adaptive grinder: a slide with lag, a power monitor with lag, a wheel that dulls."""

from math import exp, inf
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus.processes._grinding import Grinding

_LEGENDRE = np.polynomial.legendre.leggauss(16)
_NODES, _WEIGHTS = (_LEGENDRE[0] + 1) / 2, _LEGENDRE[1] / 2
_FORGOTTEN = 40.0  # lags after which a reading is forgotten; derived: e^-40 is below rounding
_SHORT = 2.0  # lags in one piece of the quadrature; chosen: 16 nodes resolve it


class InfeedCourse(NamedTuple):
    """Infeed that settles on a command: rate (mm/s) and depth (mm) over time, in closed form."""

    command: float
    excess: float  # initial rate minus command, mm/s
    lag: float
    removed: float  # initial depth, mm

    def rate(self, time: Any) -> Any:
        return self.command + (self.excess * np.exp(-time / self.lag) if self.lag else 0.0 * time)

    def depth(self, time: Any) -> Any:
        settling = -self.excess * self.lag * np.expm1(-time / self.lag) if self.lag else 0.0
        return self.removed + self.command * time + settling


class GroundPart:
    """State of slide (mm/s), work (mm), monitor (W) and least slack (W); `rig`: fields of the plant."""

    def __init__(self, process: Grinding, rig: Any) -> None:
        self.process, self._rig = process, rig
        self.rate = self.removed = self.power = 0.0
        self.slack = self.part_slack = inf

    def course(self, command: float) -> InfeedCourse:
        """Infeed from now on under a command, mm/s."""
        return InfeedCourse(command, self.rate - command, self._rig.infeed_lag, self.removed)

    def advance(self, course: InfeedCourse, rotation: float, begin: float, lasts: float) -> None:
        """Advance along a course from a time of the part for a duration, s."""
        if course.command > 0 or self.rate > 0:
            self._feel(course, rotation, begin, lasts)
        else:
            self.power *= exp(-lasts / self._rig.power_lag) if self._rig.power_lag else 0.0
        self.rate, self.removed = float(course.rate(lasts)), float(course.depth(lasts))

    def truth(self, rotation: float) -> tuple[float, float, float, float]:
        """Infeed rate (mm/s), wear flat area, grinding and burning power (W) now."""
        area, power, burning = float(self._area(self.removed)), 0.0, 0.0
        if self.rate > 0:
            power = float(self.process.grinding_power(self.rate, rotation, area))
            burning = float(self.process.burning_power(self.rate, rotation))
        return self.rate, area, power, burning

    def _area(self, removed: Any) -> Any:
        return self._rig.wear_flat_area + self._rig.dulling * removed

    def _feel(self, course: InfeedCourse, rotation: float, begin: float, lasts: float) -> None:
        """Monitored power and least slack of the next seconds.

        Nodes are squared towards the start of each piece: the power of a wheel that begins to cut rises like
        the square root of time.
        """
        lag = self._rig.power_lag
        cuts = _pieces(lasts, self._rig.infeed_lag, lag)
        width = np.diff(cuts)[:, np.newaxis]
        times = (cuts[:-1, np.newaxis] + width * _NODES**2).ravel()
        everywhere = np.concatenate([times, [0.0, lasts]])
        rate = course.rate(everywhere)
        power = self.process.grinding_power(rate, rotation, self._area(course.depth(everywhere)))
        self._judge(begin + everywhere, self.process.burning_power(rate, rotation) - power)
        if lag:
            weights = (width * _WEIGHTS * 2 * _NODES).ravel() * np.exp((times - lasts) / lag) / lag
            self.power = self.power * exp(-lasts / lag) + float(weights @ power[:-2])
        else:
            self.power = float(power[-1])

    def _judge(self, time: Floats, slack: Floats) -> None:
        """Keep the least slack, with and without the touch-in."""
        self.part_slack = min(self.part_slack, float(slack.min()))
        judged = time >= self._rig.touch_in
        if judged.any():
            self.slack = min(self.slack, float(slack[judged].min()))


def _pieces(lasts: float, infeed_lag: float, power_lag: float) -> Floats:
    """Cuts of 0..lasts between which exponentials of both lags are smooth."""
    rises = infeed_lag * 2.0 ** np.arange(6) if infeed_lag else np.empty(0)
    fades = lasts - power_lag * np.arange(_SHORT, _FORGOTTEN + _SHORT, _SHORT) if power_lag else np.empty(0)
    inner = np.concatenate([rises, fades])
    return np.unique(np.concatenate([[0.0, lasts], inner[(inner > 0) & (inner < lasts)]]))
