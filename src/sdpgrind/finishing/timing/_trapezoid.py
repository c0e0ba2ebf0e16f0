"""Motion from rest to rest with limits along the path alone: speed trapezoid, also with limited jerk."""

from math import sqrt

import numpy as np

from sdpgrind.base.quantities import Described, described, quantity
from sdpgrind.finishing.timing._time_law import TimeLaw, integrated


@described()
class Trapezoid(Described):
    """Trapezoidal speed profile from rest to rest, in closed form (Wang, Fig. 9).

    Parameters
    ----------
    length : float
        Travel, mm, >= 0.
    speed_max : float
        Commanded speed, mm/s.
    acceleration : float
        Acceleration and deceleration, mm/s^2.

    Raises
    ------
    ValueError
        When the length is < 0, or the speed or the acceleration is not > 0.

    Examples
    --------
    >>> short = Trapezoid(0.2, speed_max=25.0, acceleration=1000.0)
    >>> round(short.duration, 6), round(short.peak, 3), round(short.mean_share, 2)
    (0.028284, 14.142, 0.28)
    """

    length: float = quantity("mm", at_least=0, usual=(0.0, 1e6), typical=100)
    speed_max: float = quantity("mm/s", above=0, usual=(1e-3, 1e6), typical=25)
    acceleration: float = quantity("mm/s^2", above=0, usual=(1e-3, 1e7), typical=1000)

    @property
    def peak(self) -> float:
        """Greatest speed reached, mm/s: sqrt(L a) where the travel is too short for the commanded one."""
        return min(self.speed_max, sqrt(self.length * self.acceleration))

    @property
    def reached(self) -> bool:
        """Whether the commanded speed (mm/s) is reached."""
        return self.length * self.acceleration >= self.speed_max**2

    @property
    def duration(self) -> float:
        """Time from rest to rest, s: L/v + v/a with the peak speed v; 0 for no travel."""
        return self.length / self.peak + self.peak / self.acceleration if self.length > 0 else 0.0

    @property
    def mean_share(self) -> float:
        """Mean speed over the commanded one, dimensionless; 0 for no travel."""
        return self.length / (self.duration * self.speed_max) if self.length > 0 else 0.0


def trapezoid_law(start: float, shape: Trapezoid) -> TimeLaw:
    """Trapezoid as a time law from `start` (mm)."""
    ramp = shape.peak / shape.acceleration
    durations = np.array([ramp, max(shape.duration - 2 * ramp, 0.0), ramp])
    accelerations = np.array([shape.acceleration, 0.0, -shape.acceleration])
    keep = durations > 1e-12 * shape.duration
    return integrated(start, durations[keep], accelerations[keep], np.zeros(int(keep.sum())))


def double_s_law(start: float, shape: Trapezoid, jerk: float) -> TimeLaw:
    """Fastest law within speed, acceleration, jerk (mm/s^3) along the path from `start` (mm), 7 pieces."""
    v, a, j = double_s_peaks(shape, jerk)
    snatch, ramp = a / j, v / a - a / j
    cruise = shape.length / v - (v / a + a / j)
    durations = np.array([snatch, ramp, snatch, cruise, snatch, ramp, snatch])
    jerks = np.array([j, 0.0, -j, 0.0, -j, 0.0, j])
    firsts = np.array([0.0, a, a, 0.0, 0.0, -a, -a])
    keep = durations > 1e-12 * durations.sum()
    return integrated(start, durations[keep], firsts[keep], jerks[keep])


def double_s_peaks(shape: Trapezoid, jerk: float) -> tuple[float, float, float]:
    """Greatest speed and acceleration reached with limited jerk, and the jerk (mm/s, mm/s^2, mm/s^3)."""
    length, v, a = shape.length, shape.speed_max, shape.acceleration
    a = min(a, sqrt(v * jerk))  # reached on the way to the commanded speed
    if length >= v * (v / a + a / jerk):
        return v, a, jerk
    a = min(shape.acceleration, (length * jerk**2 / 2) ** (1 / 3))  # only ramps: L = v (v/a + a/j)
    return (sqrt((a * a / jerk) ** 2 + 4 * length * a) - a * a / jerk) / 2, a, jerk
