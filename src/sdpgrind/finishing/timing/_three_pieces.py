"""Time law through given places, feeds and accelerations: three pieces of constant jerk in each interval.

Pieces of equal length tau = T/3 with jerks j_1, j_2, j_3 meet all three at the next node where

    j_1 + j_2 + j_3 = (a_1 - a_0)/tau,
    5/2 j_1 + 3/2 j_2 + 1/2 j_3 = (v_1 - v_0 - 3 tau a_0)/tau^2,
    19/6 j_1 + 7/6 j_2 + 1/6 j_3 = (h - 3 tau v_0 - 9/2 tau^2 a_0)/tau^3.

So nothing drifts, whatever the error of T.
"""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.quadrature import leggauss
from sdpgrind.finishing.timing._squared_feed import SquaredFeed
from sdpgrind.finishing.timing._time_law import TimeLaw, advanced

PIECES = 3  # derived: as many as place, feed and acceleration at the next node
POINTS = 8  # chosen: Gauss points for the time of an interval, from rest on
# derived: as above
EFFECT = np.array([[1.0, 1.0, 1.0], [5 / 2, 3 / 2, 1 / 2], [19 / 6, 7 / 6, 1 / 6]])


def law_of(begin: float, feed: SquaredFeed, c: Floats) -> TimeLaw:
    """Law from `begin` (mm) of the squared feed with coefficients c."""
    state, times = _states(feed, c), _times(feed, c)
    tau, h = times / PIECES, np.diff(feed.nodes)
    (v, a), (dv, da) = state[:, :-1], np.diff(state)
    missing = [da / tau, (dv - 3 * tau * a) / tau**2, (h - 3 * tau * v - 4.5 * tau**2 * a) / tau**3]
    jerks = np.linalg.solve(EFFECT, np.array(missing))
    s, rows = feed.nodes[:-1], []
    for jerk in jerks:
        rows.append((begin + s, v, a, jerk))
        s, v, a = advanced(tau, s, v, a, jerk)
    length, speed, bend, jerk = (np.stack(column, axis=1).ravel() for column in zip(*rows, strict=True))
    knots = np.concatenate([[0.0], np.cumsum(np.repeat(tau, PIECES))])
    return TimeLaw(knots, length, speed, bend, jerk)


def _states(feed: SquaredFeed, c: Floats) -> Floats:
    """Feed and acceleration at the nodes, (2, N + 1)."""
    inner = feed.values(c)[1:, 0]  # at the start of all intervals but the first; the last has no such row
    tied = feed.ties * c[[2, -3]]
    x = np.concatenate([[0.0], inner[:-1, 0], [tied[1], 0.0]])
    last = -4 / 3 * tied[1] / (feed.nodes[-1] - feed.nodes[-2])
    return np.stack([np.sqrt(x), np.concatenate([[0.0], inner[:-1, 1], [last, 0.0]]) / 2])


def _times(feed: SquaredFeed, c: Floats) -> Floats:
    """Time of every interval, s."""
    h = np.diff(feed.nodes)
    points, shares = leggauss(POINTS)
    d = (points + 1) / 2 * h[1:-1, None]
    x, slope, bend = feed.values(c)[1:-1, 0].T[:, :, None]
    inner = np.sum(shares / np.sqrt(x + d * (slope + d / 2 * bend)), axis=1) * h[1:-1] / 2
    outer = 3 * h[[0, -1]] / np.sqrt(feed.ties * c[[2, -3]])
    return np.concatenate([outer[:1], inner, outer[1:]])
