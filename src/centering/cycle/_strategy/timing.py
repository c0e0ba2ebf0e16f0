"""Time between two pushes, and greatest table speed at an offset."""

from math import pi

import numpy as np

from centering._problem.problem import CenteringProblem
from centering.cycle._strategy.table_limit import TableLimit, least_friction
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, described, quantity


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

    def start_time(self, offset: float, speed: float, limit: TableLimit) -> float:
        """Return the mean time from rest to first touch, s: run-up, measurement, half a turn.

        The table at an offset (mm) runs up to `speed` (rad/s) as fast as its limit allows.
        """
        return limit.turning_time(self.first_arc + pi, offset, speed)


def table_speeds(problem: CenteringProblem, offset: Floats, speed: str | float) -> Floats:
    """Return the greatest table speeds (rad/s) without slip or outrun tip at offsets (mm), or `speed`.

    They hold for the least friction of the problem, before a push has shown that of the part.
    """
    fastest = TableLimit(problem, least_friction(problem)).speeds(offset)
    return np.asarray(fastest if isinstance(speed, str) else np.minimum(fastest, speed))
