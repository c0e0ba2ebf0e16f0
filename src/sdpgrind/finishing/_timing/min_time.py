"""The fastest law of a run within the limits of its joints, where the acceleration may jump: swept over a grid of its own.

The square of the feed is linear over arc length between points of the grid. Backward, the greatest feed from which rest can still
be reached; forward, as fast as that allows. The grid is made finer until that no longer saves time; what limits are exceeded by
between its points (in proportion to the square of its step) is gained by playing the law a little slower.
"""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._timing import sweep_kernels
from sdpgrind.finishing._timing.joint_path import JointPath
from sdpgrind.finishing._timing.limits import JointLimits
from sdpgrind.finishing._timing.time_law import TimeLaw
from sdpgrind.finishing._timing.violations import closest, slowing

LEAST, MOST = 64, 1 << 17
"""Least and greatest number of intervals on a run."""
GAIN = 2e-4
"""Share of the duration that half the step must save to be taken; the duration is then known to about as much."""
CHECKS, CHECKED = (4, 20), 40_000
"""Least and greatest number of places in an interval in which limits are checked, and how many in all."""


def fastest_law(run: JointPath, limits: JointLimits, feed_rate: float, acceleration: float | None, gain: float = GAIN) -> TimeLaw:
    """Fastest law of a run; jerk is not limited."""
    parts = -(-LEAST // (run.pieces.breaks.size - 1))
    best = _law(run, limits, feed_rate, acceleration, parts)
    while parts * (run.pieces.breaks.size - 1) < MOST:
        before, parts = best.duration, 2 * parts
        best = _law(run, limits, feed_rate, acceleration, parts)
        if best.duration >= (1 - gain) * before:
            break
    return slowed_to_limits(run, best, limits, feed_rate)


def slowed_to_limits(run: JointPath, law: TimeLaw, limits: JointLimits, feed_rate: float) -> TimeLaw:
    """Play a law just so much slower that limits are kept between its points too; jerk is not looked at."""
    free = limits.replace(jerk_max=None)
    places = int(np.clip(CHECKED // law.length.size, *CHECKS))  # what a short interval hides is small
    return law.slower(slowing(closest(run, law, free, feed_rate, places)[:, 0]))


def _law(run: JointPath, limits: JointLimits, feed_rate: float, acceleration: float | None, parts: int) -> TimeLaw:
    """Fastest law on a grid of so many parts in each piece of the path."""
    grid = grid_of(run, parts)
    return law_of(grid, swept(run, limits, feed_rate, acceleration, grid))


def swept(run: JointPath, limits: JointLimits, feed_rate: float, acceleration: float | None, grid: Floats) -> Floats:
    """Square of the feed (mm^2/s^2) at the points of a grid (mm)."""
    joints = run.derivatives(grid)
    speed, most, _ = limits.table
    p, c = joints[:, 1] / most, joints[:, 2] / most
    if acceleration is not None:
        p = np.column_stack([p, np.full(grid.size, 1 / acceleration)])
        c = np.column_stack([c, np.zeros(grid.size)])
    cap = np.minimum(feed_rate, 1 / np.maximum(np.abs(joints[:, 1] / speed).max(axis=1), 1e-12)) ** 2
    x = np.zeros(grid.size)
    sweep_kernels.fastest(np.diff(grid), np.ascontiguousarray(p), np.ascontiguousarray(c), cap, x)
    return x


def law_of(grid: Floats, x: Floats) -> TimeLaw:
    """Law whose squared feed is linear over arc length between points: constant acceleration in each piece."""
    feed, step = np.sqrt(x), np.diff(grid)
    durations = 2 * step / (feed[1:] + feed[:-1])
    knots = np.concatenate([[0.0], np.cumsum(durations)])
    return TimeLaw(knots, grid[:-1], feed[:-1], np.diff(x) / (2 * step), np.zeros(step.size))


def grid_of(run: JointPath, parts: int) -> Floats:
    """The breaks of the path (mm), each piece cut alike into so many parts."""
    breaks = run.pieces.breaks
    return np.interp(np.arange((breaks.size - 1) * parts + 1) / parts, np.arange(breaks.size), breaks)
