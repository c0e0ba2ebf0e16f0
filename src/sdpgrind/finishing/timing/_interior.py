"""Fastest law of a run on given nodes, with limits of jerk: squared feed by interior points.

Joint q(s) has the speed q' sqrt(x), the acceleration q' x'/2 + q'' x and the jerk
sqrt(x) (q''' x + 3/2 q'' x' + 1/2 q' x''). Speed and acceleration are linear in x; the limit J of jerk is

    |q''' x + 3/2 q'' x' + 1/2 q' x''| <= J x^(-1/2),

linear against a convex right side. The time int x^(-1/2) ds is convex. The feasible set is not: the end is a
local optimum, and no bound proves that it is the only one.
"""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.timing import _interior_kernels as interior_kernels
from sdpgrind.finishing.timing._limits import LawError, LimitedRun
from sdpgrind.finishing.timing._squared_feed import SquaredFeed

# chosen: share of every limit that the start uses, from which the first steps are whole
SPARE = 0.7
# of the time, chosen: complementarity at the start; a smaller one stays nearer to a bad start, and may end at
# another optimum (0.3: 0.1 % slower from one of 300 starts)
START = 3.0


class FeedRows(NamedTuple):
    """Limits at the places of N intervals.

    Attributes
    ----------
    cap : array, (N, 3)
        Greatest squared feed, mm^2/s^2.
    joints : array, (N, 3, n, 5)
        Numbers a_0, a_1 and b_0, b_1, b_2: acceleration and jerk / sqrt(x) over their limits are
        a_0 x + a_1 x' and b_0 x + b_1 x' + b_2 x''.
    """

    cap: Floats
    joints: Floats


def rows_of(given: LimitedRun, feed: SquaredFeed, narrow: Floats) -> FeedRows:
    """Limits at the places; those of speed, acceleration and jerk narrowed by factors (3, N) >= 1."""
    run, limits, feed_rate, along = given
    q = run.derivatives(run.length[0] + feed.places.ravel())[:, 1:].reshape(*feed.places.shape, 3, -1)
    (speed, most, jerk), (v, a, j) = limits.table, narrow[:, :, None, None]
    fastest = 1 / np.maximum(np.max(np.abs(q[:, :, 0]) * v / speed, axis=2), 1e-12)
    joints = np.stack(
        [
            a * q[:, :, 1] / most,
            a * q[:, :, 0] / (2 * most),
            j * q[:, :, 2] / jerk,
            j * 3 * q[:, :, 1] / (2 * jerk),
            j * q[:, :, 0] / (2 * jerk),
        ],
        axis=3,
    )
    if along is not None:
        path = np.zeros((*feed.places.shape, 1, 5))
        path[..., 1] = 1 / (2 * along)
        joints = np.concatenate([joints, path], axis=2)
    return FeedRows(np.minimum(feed_rate, fastest) ** 2, joints)


def slowed_start(feed: SquaredFeed, rows: FeedRows, c: Floats) -> Floats:
    """Coefficients slowed so that every row is at most at `SPARE`, over the whole run."""
    values = feed.values(c)
    x = values[:, :, 0]
    speed = float(np.max(x / rows.cap))
    push = np.einsum("itjd,itd->itj", rows.joints[..., :2], values[..., :2])
    snatch = np.einsum("itjd,itd->itj", rows.joints[..., 2:], values) * np.sqrt(x)[:, :, None]
    bent, jerk = float(np.max(np.abs(push))), float(np.max(np.abs(snatch)))
    return np.asarray(c / max(1.0, speed / SPARE, bent / SPARE, (jerk / SPARE) ** (2 / 3)))


def improved(feed: SquaredFeed, rows: FeedRows, c: Floats, gap: float) -> Floats:
    """Coefficients of the fastest law, from a start whose every value is > 0.

    Parameters
    ----------
    feed : SquaredFeed
        The spline.
    rows : FeedRows
        Its limits.
    c : array, (N + 2,)
        Start; slowed into the limits.
    gap : float
        Duality gap of the last linearized program over the time.

    Raises
    ------
    LawError
        When a number is not finite.
    """
    out = slowed_start(feed, rows, c)
    mu = START * feed.duration(out) / (rows.cap.size * (4 * rows.joints.shape[2] + 1))
    problem = (feed.rows, feed.samples, feed.weights, rows.joints, rows.cap)
    steps = interior_kernels.interior(problem, out, mu, gap)
    if steps < 0:
        raise LawError("interior points met a number that is not finite")
    return out
