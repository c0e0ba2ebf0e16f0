"""Speed and acceleration of the table at which the least friction in doubt still holds the ring."""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from centering._problem.model import GRAVITY
from centering._problem.problem import CenteringProblem
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen

SURE = 3.0902  # derived: quantile of 99.9 % of the standard normal distribution
_LEAST = 0.1  # chosen: least friction over that of the model; keeps it positive under a wide scatter
# derived: least distance from zero of the curve of force and moment, each over its maximum, that a thin ring
# with even pressure bears; there it slides as fast as it spins, and both are 2/pi
_SHARE = 2.0 * sqrt(2.0) / pi
_STEADY = 0.8  # chosen: share of the friction for turning alone; more leaves too little to gain speed with
_REACH = 60.0  # mm/s, chosen: how fast the rim may come toward the tip, so that the tip outruns it
_SLOWEST = 0.05  # chosen: share of the friction for a change of speed where turning uses up the rest
_SPEEDS = 64  # chosen: nodes of the speed in a run-up; twice as many change its time by less than 0.1 %
_SHARES = np.linspace(0.0, 1.0, _SPEEDS + 1)


def least_friction(problem: CenteringProblem) -> float:
    """Return the factor of friction that 99.9 % of the parts exceed at the low end of the range."""
    low = problem.friction_range[0]
    return max(low * (1.0 - SURE * problem.scatter.friction_part_sd), _LEAST * low)


@dataclass(frozen=True)
class TableLimit(Frozen):
    """Greatest speed and acceleration of a table that throws no ring.

    Friction holds the place of the ring against turning, w^2 d and w' d, and its spin against w' R. It bears
    both while ``hypot(w^2 d, w' hypot(R, d)) <= 0.9 mu g``.

    Parameters
    ----------
    problem : CenteringProblem
        Part, friction and limits of the machine.
    friction : float
        Least factor of friction.

    Examples
    --------
    >>> from centering import preset
    >>> limit = TableLimit(preset("printed"), 0.45)  # mu g = 883 mm/s^2
    >>> [round(limit.speed(offset), 2) for offset in (2.0, 10.0)]  # rad/s
    [10.47, 6.0]
    >>> [round(limit.acceleration(10.0, speed), 2) for speed in (0.0, 8.0)]  # rad/s^2
    [8.82, 5.23]
    """

    problem: CenteringProblem
    friction: float

    @property
    def held(self) -> float:
        """Acceleration that the least friction holds, mm/s^2."""
        return self.problem.model.mu_static * GRAVITY * self.friction

    def speed(self, offset: float) -> float:
        """Return the greatest speed (rad/s) at an offset (mm), without slip or outrun tip."""
        return float(self.speeds(np.array([offset]))[0])

    def speeds(self, offset: Floats) -> Floats:
        """Return the greatest speeds (rad/s) at offsets (mm)."""
        turned = np.sqrt(_STEADY * self.held / offset)
        most = np.minimum(self.problem.limits.spindle_speed_max, turned)
        return np.asarray(np.minimum(most, _REACH / offset))

    def acceleration(self, offset: float, speed: float) -> float:
        """Return the greatest acceleration (rad/s^2) at an offset (mm) and a speed (rad/s)."""
        return float(self.accelerations(offset, np.array([speed]))[0])

    def accelerations(self, offset: float, speed: Floats) -> Floats:
        """Return the greatest accelerations (rad/s^2) at an offset (mm) and speeds (rad/s)."""
        most, away = _SHARE * self.held, sqrt(self.problem.model.part.radius**2 + offset**2)
        left = np.sqrt(np.maximum(most**2 - (speed**2 * offset) ** 2, (_SLOWEST * most) ** 2))
        return np.asarray(np.minimum(self.problem.limits.spindle_acceleration_max, left / away))

    def shown(self, offset: float, speed: float, acceleration: float) -> float:
        """Return the factor of friction that a thrown ring showed: it has at most that one.

        The ring lay at an offset (mm) on a table with a speed (rad/s) and an acceleration (rad/s^2).
        """
        pull = offset * sqrt(speed**4 + acceleration**2)
        asked = sqrt(pull**2 + (acceleration * self.problem.model.part.radius) ** 2) / _SHARE
        return asked / (self.problem.model.mu_static * GRAVITY)

    def run_up(self, offset: float, speed: float) -> tuple[Floats, Floats, Floats]:
        """Return speeds (rad/s) of the fastest run-up from rest to a speed, times (s) and angles (rad).

        The acceleration is the greatest at the offset (mm) all along.
        """
        speeds, (times, angles) = speed * _SHARES, np.zeros((2, _SPEEDS + 1))
        middle, step = 0.5 * (speeds[1:] + speeds[:-1]), speed / _SPEEDS
        taken = step / self.accelerations(offset, middle)
        np.cumsum(taken, out=times[1:])
        np.cumsum(taken * middle, out=angles[1:])
        return speeds, times, angles

    def turning_time(self, angle: float, offset: float, speed: float) -> float:
        """Return the time (s) in which a table at rest turns by an angle (rad), in a `run_up` and after."""
        _, time, turned = self.run_up(offset, speed)
        if angle > turned[-1]:
            return float(time[-1] + (angle - turned[-1]) / speed)
        return float(np.interp(np.sqrt(angle), np.sqrt(turned), time))
