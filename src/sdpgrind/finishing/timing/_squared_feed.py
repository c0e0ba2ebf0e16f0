"""Squared feed over arc length: a quadratic spline between two ends that start from rest at constant jerk.

With x = (ds/dt)^2 the acceleration along the path is x'/2 and its jerk x'' sqrt(x)/2. Between the second and
the last but one of the nodes s_0 < ... < s_N, x is a quadratic spline with a knot at each, so that the
acceleration is linear over arc length. From rest at constant jerk j, s = j t^3/6 and x = (9 j/2)^(2/3)
s^(4/3): not smooth at s = 0, so the two outer intervals have that form, x = c_0 (s/s_1)^(4/3), and last
3 s_1/sqrt(c_0). Equal slopes at s_1, (4/3) c_0/s_1 = 2 (c_1 - c_0)/(s_2 - s_1), tie c_0 to c_1; the other end
is the mirror image.

Every interval i has three coefficients: c[i], c[i + 1], c[i + 2] of c_(-1) ... c_N, where the outer two at
either end are not free. Values at places of an interval are rows of three numbers on them.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.base.quadrature import leggauss

# chosen: shares of the time in the outer intervals at which rows stand, from rest on
# (jerk is constant there, so that only the path's derivatives differ)
FROM_REST = (0.1, 0.5, 1.0)
GAUSS = 3  # chosen: points of the quadrature of time in an interval


class SquaredFeed(NamedTuple):
    """Places of N intervals with their rows of three numbers on the coefficients (N + 2,).

    Attributes
    ----------
    nodes : array, (N + 1,)
        Nodes, mm from the start of the run.
    places : array, (N, 3)
        Both ends and the middle of each interval, mm from the start; in the outer ones `FROM_REST`.
    rows : array, (N, 3, 3, 3)
        Of x, x', x'' there.
    samples : array, (N, GAUSS, 3)
        Of x at the points of the quadrature.
    weights : array, (N, GAUSS)
        Weights there, mm.
    ties : array, (2,)
        Value at the outer nodes of the spline over the free coefficient beside it.
    """

    nodes: Floats
    places: Floats
    rows: Floats
    samples: Floats
    weights: Floats
    ties: Floats

    def values(self, c: Floats) -> Floats:
        """Values of x, x', x'' at the places, (N, 3, 3), for coefficients (N + 2,)."""
        return np.asarray(np.einsum("itdk,ik->itd", self.rows, _windows(c)))

    def duration(self, c: Floats) -> float:
        """Time of the whole run, s."""
        x = np.einsum("igk,ik->ig", self.samples, _windows(c))
        return float(np.sum(self.weights / np.sqrt(x)))


def squared_feed(nodes: Floats) -> SquaredFeed:
    """Rows of a spline on at least five nodes, mm from the start of the run."""
    h = np.diff(nodes)
    offsets = np.array([0.0, 0.5, 1.0]) * h[:, None]
    points, shares = leggauss(GAUSS)
    taylor, ties = _taylor(h), 1 / (1 + 2 * h[[1, -2]] / (3 * h[[0, -1]]))
    rows = _moved(taylor, offsets)
    samples = _moved(taylor, (points + 1) / 2 * h[:, None])[:, :, 0]
    weights = shares / 2 * h[:, None]
    places = nodes[:-1, None] + offsets
    for end, sign, free in ((0, 1.0, 2), (-1, -1.0, 0)):
        f = np.array(FROM_REST)
        x = np.stack([f**4, sign * 4 / 3 * f / h[end], 4 / 9 / (f * h[end]) ** 2], axis=1)
        rows[end], samples[end], weights[end] = 0.0, 0.0, 0.0
        rows[end, :, :, free], samples[end, :, free] = ties[end] * x, ties[end]
        places[end], weights[end, 0] = nodes[end] + sign * h[end] * f**3, 3 * h[end]
    _tie(rows, ties)
    _tie(samples, ties)
    return SquaredFeed(nodes, places, rows, samples, weights, ties)


def greville(nodes: Floats) -> Floats:
    """Places (N,) at which the spline has about the value of each coefficient c_0 ... c_(N - 1)."""
    inner = nodes[1:-1]
    return np.concatenate([inner[:1], (inner[:-1] + inner[1:]) / 2, inner[-1:]])


def coefficients(feed: Floats) -> Floats:
    """Coefficients (N + 2,) of a spline with about these feeds (N,), mm/s, at the `greville` places."""
    return np.concatenate([[1.0], feed**2, [1.0]])


def _taylor(h: Floats) -> Floats:
    """Rows of x, x', x'' at the start of every interval of the spline, (N, 3, 3); 0 in the outer two."""
    out = np.zeros((h.size, 3, 3))
    here, before, after = h[1:-1], h[:-2].copy(), h[2:].copy()
    before[0] = after[-1] = 0.0  # the outer knots are threefold
    left, right = before + here, here + after
    out[1:-1, 0, 0], out[1:-1, 0, 1] = here / left, before / left
    out[1:-1, 1, 0], out[1:-1, 1, 1] = -2 / left, 2 / left
    slope = np.stack([np.zeros(here.size), -2 / right, 2 / right], axis=1)
    out[1:-1, 2] = (slope - out[1:-1, 1]) / here[:, None]
    return out


def _moved(taylor: Floats, offsets: Floats) -> Floats:
    """Rows of x, x', x'' at offsets (N, m) from the start of every interval: (N, m, 3, 3)."""
    d, (x, slope, bend) = offsets[:, :, None], (taylor[:, None, order] for order in range(3))
    return np.stack([x + d * (slope + d / 2 * bend), slope + d * bend, bend + 0 * d], axis=2)


def _tie(rows: Floats, ties: Floats) -> None:
    """Move what stands on the tied coefficients to the free ones beside them."""
    rows[1, ..., 1] += ties[0] * rows[1, ..., 0]
    rows[-2, ..., 1] += ties[-1] * rows[-2, ..., 2]
    rows[1, ..., 0] = rows[-2, ..., 2] = 0.0


def _windows(c: Floats) -> npt.NDArray[np.float64]:
    """The three coefficients of every interval, (N, 3)."""
    return np.lib.stride_tricks.sliding_window_view(c, 3)
