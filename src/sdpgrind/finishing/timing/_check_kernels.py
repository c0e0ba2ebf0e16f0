"""Shares of the limits that a time law uses, at many places between its knots."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.finishing.timing._path_kernels import _piece_at
from sdpgrind.finishing.timing._time_law import advanced

_advanced = compiled(error_model="numpy")(advanced)
QUANTITIES = 4  # derived: speed, acceleration, jerk of the joints; feed
AT_ONCE = 64  # chosen: places whose shares are in memory together, for the processor's vectors


@compiled(error_model="numpy")
def _course(span, parts, row, first, places):
    """Fill places (5, m) = (time, length, feed, acceleration, free) from number `first` on; return m."""
    count = min(AT_ONCE, parts + 1 - first)
    s, v, a, j = row
    for m in range(count):
        time = span * (first + m) / parts
        places[0, m] = time
        places[1, m], places[2, m], places[3, m] = _advanced(time, s, v, a, j)
    return count


@compiled(error_model="numpy")
def _use(path, jerk, limits, feed_max, places, low, high, used, joint):
    """Fill used, joint (4, m) with the greatest share of each limit and its joint, -1: none has a share.

    path: polynomials (6, n) of the joints and where they start, for places from `low` to before `high`.
    """
    polynomials, start = path
    feed, bend, x = places[2, low:high], places[3, low:high], places[4, low:high]
    for m in range(low, high):
        places[4, m] = places[1, m] - start
        used[0, m], used[1, m], used[2, m], used[3, m] = 0.0, 0.0, 0.0, places[2, m] / feed_max
        joint[0, m], joint[1, m], joint[2, m], joint[3, m] = -1.0, -1.0, -1.0, -1.0
    for i in range(polynomials.shape[1]):
        c = polynomials[1, i], polynomials[2, i], polynomials[3, i], polynomials[4, i], polynomials[5, i]
        _speeds(c, i, limits[0, i], x, feed, used[0, low:high], joint[0, low:high])
        _bends(c, i, limits[1, i], x, feed, bend, used[1, low:high], joint[1, low:high])
        if limits[2, i] < np.inf:
            course = x, feed, bend, jerk
            _snatches(c, i, limits[2, i], course, used[2, low:high], joint[2, low:high])


@compiled(error_model="numpy")
def _speeds(c, i, most, x, feed, used, joint):
    """Note the speeds of a joint with the polynomial c (1 to 5) over their greatest."""
    c1, c2, c3, c4, c5 = c
    for m in range(x.size):
        q1 = c1 + x[m] * (2 * c2 + x[m] * (3 * c3 + x[m] * (4 * c4 + x[m] * 5 * c5)))
        share = abs(q1 * feed[m]) / most
        joint[m] = i if share > used[m] else joint[m]
        used[m] = share if share > used[m] else used[m]


@compiled(error_model="numpy")
def _bends(c, i, most, x, feed, bend, used, joint):
    """Note its accelerations."""
    c1, c2, c3, c4, c5 = c
    for m in range(x.size):
        q1 = c1 + x[m] * (2 * c2 + x[m] * (3 * c3 + x[m] * (4 * c4 + x[m] * 5 * c5)))
        q2 = 2 * c2 + x[m] * (6 * c3 + x[m] * (12 * c4 + x[m] * 20 * c5))
        share = abs(q1 * bend[m] + q2 * feed[m] * feed[m]) / most
        joint[m] = i if share > used[m] else joint[m]
        used[m] = share if share > used[m] else used[m]


@compiled(error_model="numpy")
def _snatches(c, i, most, course, used, joint):
    """Note its jerks."""
    c1, c2, c3, c4, c5 = c
    x, feed, bend, jerk = course
    for m in range(x.size):
        q1 = c1 + x[m] * (2 * c2 + x[m] * (3 * c3 + x[m] * (4 * c4 + x[m] * 5 * c5)))
        q2 = 2 * c2 + x[m] * (6 * c3 + x[m] * (12 * c4 + x[m] * 20 * c5))
        q3 = 6 * c3 + x[m] * (24 * c4 + x[m] * 60 * c5)
        share = abs(q1 * jerk + 3.0 * q2 * feed[m] * bend[m] + q3 * feed[m] ** 3) / most
        joint[m] = i if share > used[m] else joint[m]
        used[m] = share if share > used[m] else used[m]


@compiled(error_model="numpy")
def _note(places, start, used, joint, count, each, found, number):
    """Update the greatest shares `each` (4,) of a piece of a law, which starts at a time, and of the law."""
    for quantity in range(QUANTITIES):
        for m in range(count):
            share = used[quantity, m]
            each[quantity] = max(each[quantity], share)
            if share > found[quantity, 0]:
                found[quantity, 0], found[quantity, 1], found[quantity, 4] = share, joint[quantity, m], number
                found[quantity, 2], found[quantity, 3] = start + places[0, m], places[1, m]


@compiled(error_model="numpy")
def worst(breaks, polynomials, law, limits, feed_max, refine, each, found):
    """Greatest shares over a law (5, k + 1) = (knots, length, feed, acceleration, jerk).

    each (k, 4): those in every piece of the law. found (4, 5): the greatest, with its joint, time, length and
    piece, updated.
    """
    places, used, joint = np.empty((5, AT_ONCE)), np.empty((4, AT_ONCE)), np.empty((4, AT_ONCE))
    spacing, at = (breaks[-1] - breaks[0]) / (breaks.size - 1), breaks.size // 2
    for k in range(law.shape[1] - 1):
        span, row = law[0, k + 1] - law[0, k], (law[1, k], law[2, k], law[3, k], law[4, k])
        # a piece of the law may cover many pieces of the path: at least `refine` places in each
        parts = refine * max(1, int(np.ceil(2.0 * (law[1, k + 1] - law[1, k]) / spacing)))
        for quantity in range(QUANTITIES):
            each[k, quantity] = 0.0
        for first in range(0, parts + 1, AT_ONCE):
            count, high = _course(span, parts, row, first, places), 0
            for low in range(count):
                if low < high:
                    continue
                at, high = _piece_at(breaks, places[1, low], at), low + 1
                while high < count and _piece_at(breaks, places[1, high], at) == at:
                    high += 1
                path = polynomials[at], breaks[at]
                _use(path, law[4, k], limits, feed_max, places, low, high, used, joint)
            _note(places, law[0, k], used, joint, count, each[k], found, k)


@compiled(error_model="numpy")
def closest(breaks, polynomials, law, limits, feed_max, refine, closer, each, found):
    """Greatest shares over a whole law, found (4, 5), looked at again in `closer` places nearby."""
    worst(breaks, polynomials, law, limits, feed_max, refine, each, found)
    near, nearby = np.empty((5, 2)), found.copy()
    for quantity in range(QUANTITIES):
        k = int(found[quantity, 4])
        begin = _around(law[:, k : k + 2], found[quantity, 2], refine, near)
        nearby[quantity, 0] = 0.0
        worst(breaks, polynomials, near, limits, feed_max, closer, each, nearby)
        if nearby[quantity, 0] > found[quantity, 0]:
            for i in range(4):
                found[quantity, i] = nearby[quantity, i]
            found[quantity, 2] += begin


@compiled(error_model="numpy")
def _around(piece, time, refine, near):
    """Start of a short part of a piece (5, 2) about a time; the part goes into `near`, from time 0."""
    begin, end, jerk = piece[0, 0], piece[0, 1], piece[4, 0]
    step = (end - begin) / refine
    first = max(begin, min(time - step, end - 2 * step))
    width = min(2 * step, end - begin)
    length, feed, bend = _advanced(first - begin, piece[1, 0], piece[2, 0], piece[3, 0], jerk)
    last = _advanced(width, length, feed, bend, jerk)
    near[0, 0], near[1, 0], near[2, 0], near[3, 0], near[4, 0] = 0.0, length, feed, bend, jerk
    near[0, 1], near[1, 1], near[2, 1], near[3, 1], near[4, 1] = width, last[0], last[1], last[2], jerk
    return first
