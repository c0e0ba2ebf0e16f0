"""Position of the feed axis over time, as a planned cycle asks for it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sdpgrind.base.checks import Floats

if TYPE_CHECKING:
    import xarray as xr

_FINER = 10  # chosen: straight lines between two samples; their distance from the plan falls with the square


@dataclass(frozen=True)
class AxisCourse:
    """Straight lines between positions of the axis, mm, from first contact, over time, s.

    `error` is their greatest distance from the plan between two samples, mm.
    """

    time: Floats
    position: Floats
    error: float

    def deviation(self, time: Floats, position: Floats) -> float:
        """Greatest distance (mm) of lines between positions (mm) over time (s); both hold their ends."""
        every = np.union1d(self.time, time)
        return float(np.max(np.abs(self(every) - np.interp(every, time, position))))

    def __call__(self, time: Floats) -> Floats:
        """Positions, mm, at times, s; after the end the last one."""
        return np.interp(time, self.time, self.position)


def axis_course(course: "xr.Dataset", worn: float, *, straight: bool) -> AxisCourse:
    """Feed of the axis along a trajectory: metal removed, deflection, and radius that the wheel loses.

    `worn` is the wheel's radius lost per radius removed, mm/mm. Between two samples of a replay a command is
    held, and the feed is straight; that of an exact plan is bent.
    """
    time, stock = course.time.values, course.remaining.values
    fed = (stock[0] - stock) * (1.0 + worn) + course.deflection.values
    if straight:
        kept = np.concatenate([[True], np.diff(time) > 0.0])
        return AxisCourse(time[kept], fed[kept], 0.0)
    return _smooth(time, fed, course.command_rate.values)


def _smooth(time: Floats, fed: Floats, rate: Floats) -> AxisCourse:
    """Cubic between samples by their rates (mm/s), as straight lines; a change of rate has two samples.

    A line of length h, along which the rate changes by d in one direction, leaves the curve by h d/4 at most.
    """
    kept = np.flatnonzero(np.diff(time) > 0.0)
    h, share = np.diff(time)[kept, None], np.arange(_FINER) / _FINER
    first, last = fed[kept, None], fed[kept + 1, None]
    bends = (rate[kept, None] * h - (last - first)) * (1 - share) - (
        rate[kept + 1, None] * h - (last - first)
    ) * share
    between = first + (last - first) * share + share * (1 - share) * bends
    error = float(np.max(h[:, 0] * np.abs(np.diff(rate)[kept]))) / (4 * _FINER**2)
    times = time[kept, None] + h * share
    return AxisCourse(np.append(times, time[-1]), np.append(between, fed[-1]), error)
