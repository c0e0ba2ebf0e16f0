"""Least duration of any law of a run: proved, with or without limits of jerk.

The squared speed w = q'^2 x of a joint changes by at most twice its greatest acceleration over its way:

    |dw/dq| = 2 |q' x'/2 + q'' x| <= 2 A.

So w at a point is at most w at the point before it plus 2 A times the way in between, whatever the course
(the same from the point behind). Both ends are at rest; from there these bounds give a greatest squared feed
at every point of a grid. In an interval each joint goes its way no faster than at A up to a peak, within its
greatest speed, and down to the bound at the other end; the slowest joint gives the least time of the
interval. Nothing is neglected between the points: a coarser grid gives a lower bound, not a wrong one.
"""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.halving import halved
from sdpgrind.finishing.timing import _bound_kernels as bound_kernels
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._limits import JointLimits, LimitedRun, check_runs, each_feed
from sdpgrind.finishing.timing._min_time import LEAST, MOST, grid_of

GAIN = 5e-4  # of the duration, chosen: gain by half the step that is left out
ROUNDED = 1e-9  # of the duration, chosen: above the rounding of its sums
STILL = 1e-12  # of the steepest slope, chosen: rounding of a slope of zero
# of the greatest joint, chosen: above the rounding of a way; a joint that turns back at a point has a speed
# of about zero there and beside it, and a way of zero would let nothing pass
BLUR = 1e-14


def lower_bound(
    runs: Sequence[JointPath],
    limits: JointLimits,
    *,
    feed_rate: float | Sequence[float],
    acceleration: float | None = None,
) -> float:
    """Return a duration that no time law of the runs, each from rest to rest, is below.

    Limits of speed and acceleration count, those of jerk do not: so the bound holds with them, too, and is
    farther below what is possible (by some 4 % where jerk takes 0.1 s to full acceleration on 60 mm).

    Parameters
    ----------
    runs : sequence of JointPath
        The runs, mm and rad or mm.
    limits : JointLimits
        Limits of the joints.
    feed_rate : float or sequence of float
        Greatest feed along the path, mm/s, of all runs or of each.
    acceleration : float, optional
        Greatest acceleration of the contact point along its path, mm/s^2. None: no limit.

    Returns
    -------
    float
        Sum over all runs, s.

    Raises
    ------
    ValueError
        When the runs do not have the joints of the limits, or a rate is not > 0.

    Examples
    --------
    >>> run = JointPath([0.0, 100.0], [[0.0], [100.0]])
    >>> limits = JointLimits(["X"], speed_max=[50.0], acceleration_max=[2000.0])
    >>> round(lower_bound([run], limits, feed_rate=40.0), 4)  # 100/40 + 40/2000
    2.52
    """
    feeds = each_feed(feed_rate, len(runs))
    along = checks.positive("acceleration", acceleration, "mm/s^2") if acceleration is not None else None
    check_runs(runs, limits)
    return sum(bound_of(LimitedRun(run, limits, feed, along)) for run, feed in zip(runs, feeds, strict=True))


def bound_of(given: LimitedRun) -> float:
    """Return a duration, s, that no law of a run is below."""
    pieces = given.run.pieces.breaks.size - 1
    parts = -(-LEAST // pieces)
    best = bound_on(given, parts)
    while parts * pieces < MOST:
        parts *= 2
        before, best = best, max(best, bound_on(given, parts))
        if best <= (1 + GAIN) * before:
            break
    return best


def bound_on(given: LimitedRun, parts: int) -> float:
    """Lower bound of the duration, s, on a grid of `parts` in each piece of the path and turning points."""
    run, limits, feed_rate, along = given
    grid = _with_turns(given, grid_of(run, parts))
    q, h = run.derivatives(grid), np.diff(grid)
    slopes, ways = np.ascontiguousarray(q[:, 1]), np.abs(np.diff(q[:, 0], axis=0))
    bounded = _one_way(q[:, 1:], h)
    farthest = np.where(bounded, ways, _longest(q[:, 1:], h)) + BLUR * np.abs(q[:, 0]).max(axis=0)
    (speed, most, _), path = limits.table, np.ones((grid.size, 1))
    if along is not None:
        slopes, farthest = np.hstack([slopes, path]), np.column_stack([farthest, h])
        ways, bounded = np.column_stack([ways, h]), np.column_stack([bounded, path[1:] > 0])
        speed, most = np.append(speed, feed_rate), np.append(most, along)
    with np.errstate(divide="ignore"):
        x = np.minimum(feed_rate, np.min(speed / np.abs(slopes), axis=1)) ** 2
    bound_kernels.highest(slopes, farthest, most, x)
    least = np.where(bounded, _least_times(np.abs(slopes) * np.sqrt(x)[:, None], ways, speed, most), 0.0)
    return float(np.sum(np.maximum(least.max(axis=1), h / feed_rate))) * (1 - ROUNDED)


def _with_turns(given: LimitedRun, grid: Floats) -> Floats:
    """Grid with the places at which joints turn back, where their speed is zero whatever the feed."""
    slopes = given.run.derivatives(grid)[:, 1]
    cell, joint = np.nonzero(slopes[:-1] * slopes[1:] < 0)
    rising = slopes[cell, joint] < 0

    def before(place: Floats) -> Bools:
        here = given.run.derivatives(place)[np.arange(place.size), 1, joint]
        return np.asarray((here < 0) == rising)

    turns = halved(grid[cell], grid[cell + 1], before, 60)
    return np.unique(np.concatenate([grid, turns]))


def _one_way(q: Floats, h: Floats) -> Bools:
    """Whether joints never turn back in an interval, (m - 1, n); derivatives 1 to 3 at its ends, (m, 3, n).

    The second derivative is a cubic, between the least and the greatest of its four Bernstein coefficients.
    Where it keeps its sign, the slope goes from one end to the other.
    """
    slope, least, most = q[:, 0], *_bends(q, h)
    still = STILL * np.abs(slope).max()
    same = (slope[:-1] * slope[1:] >= 0) | (np.minimum(np.abs(slope[:-1]), np.abs(slope[1:])) <= still)
    far = np.minimum(np.abs(slope[:-1]), np.abs(slope[1:])) > h[:, None] * np.maximum(-least, most)
    return np.asarray(same & ((least >= 0) | (most <= 0) | far))


def _longest(q: Floats, h: Floats) -> Floats:
    """Longest way that a joint can go in an interval, (m - 1, n)."""
    slope, least, most = np.abs(q[:, 0]), *_bends(q, h)
    step = h[:, None]
    return np.asarray(step * (np.minimum(slope[:-1], slope[1:]) + step * np.maximum(-least, most)))


def _bends(q: Floats, h: Floats) -> tuple[Floats, Floats]:
    """Least and greatest Bernstein coefficient of the second derivative in each interval, (m - 1, n)."""
    bend, third, step = q[:, 1], q[:, 2], h[:, None]
    four = np.stack([bend[:-1], bend[:-1] + step * third[:-1] / 3, bend[1:] - step * third[1:] / 3, bend[1:]])
    return four.min(axis=0), four.max(axis=0)


def _least_times(v: Floats, ways: Floats, speed: Floats, most: Floats) -> Floats:
    """Least times (s) of joints for their ways between speeds of at most v (m, n): up to a peak, and down."""
    v0, v1 = v[:-1], v[1:]
    squares = (v0**2 + v1**2) / 2
    peak = np.sqrt(squares + most * ways)
    short = (2 * peak - v0 - v1) / most
    long = (ways - (speed**2 - squares) / most) / speed + (2 * speed - v0 - v1) / most
    return np.asarray(np.where(peak <= speed, short, long))
