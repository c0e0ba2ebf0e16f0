"""Time between two pushes, and greatest table speed at an offset."""

from math import pi, sqrt

import numpy as np

from centering._problem.model import GRAVITY
from centering._problem.problem import CenteringProblem
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, quantity

_MARGIN = 0.6  # chosen: share of the friction at rest that turning with the table may use up
_REACH = 60.0  # mm/s, chosen: how fast the rim may come toward the tip, so that the tip outruns it


@described("centering.cycle_timing")
class CycleTiming(Described):
    """Duration of a cycle without its pushes; the defaults suit `CenteringController`.

    Parameters
    ----------
    measuring_arc : float
        Rotation of the table during the measurement before a push and after the last one, rad.
    busy_time : float
        Time from the turning point of the tip to the measurement plus that from its approach to the first
        touch, s.
    first_arc : float
        Rotation of the table during the first measurement, from rest, rad.

    Raises
    ------
    ValueError
        A value is not > 0.

    Examples
    --------
    >>> CycleTiming().busy_time  # s
    0.1
    """

    measuring_arc: float = quantity("rad", above=0, usual=(0.001, 20.0), typical=1.6, default=1.6)
    busy_time: float = quantity("s", above=0, default=0.1)
    first_arc: float = quantity("rad", above=0, usual=(0.001, 20.0), typical=0.3, default=0.3)

    def start_time(self, speed: float, acceleration: float) -> float:
        """Return the mean time from rest to first touch, s: ramp, measurement, half a turn.

        The table ramps to `speed` (rad/s) at `acceleration` (rad/s^2).
        """
        angle, turned = self.first_arc + pi, 0.5 * speed**2 / acceleration
        return (
            sqrt(2.0 * angle / acceleration)
            if angle < turned
            else speed / acceleration + (angle - turned) / speed
        )


def table_speeds(problem: CenteringProblem, offset: Floats, speed: str | float) -> Floats:
    """Return the greatest table speeds (rad/s) without slip or outrun tip at offsets (mm), or `speed`."""
    limits, model = problem.limits, problem.model
    slip = np.sqrt(_MARGIN * model.mu_static * GRAVITY / offset)
    fastest = np.minimum(np.minimum(limits.spindle_speed_max, slip), _REACH / offset)
    return np.asarray(fastest if isinstance(speed, str) else np.minimum(fastest, speed))
