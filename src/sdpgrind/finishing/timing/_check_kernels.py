"""Shares of the limits that a time law uses, at many places between its knots."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.finishing.timing._path_kernels import _derivatives, _piece_at
from sdpgrind.finishing.timing._time_law import advanced

_advanced = compiled(advanced)
QUANTITIES = 4  # derived: speed, acceleration, jerk of the joints; feed
CLOSER = 20  # chosen: places about the greatest share of a limit


@compiled
def _note(time, law, path, joints, limits, feed_max, found):
    """Update found (4, 4) = (ratio, joint, time, length) with the shares at one time in a piece of a law."""
    start, s, v, a, j = law
    length, feed, bend = _advanced(time, s, v, a, j)
    _derivatives(path[0], length - path[1], joints)
    _greater(found[3], feed / feed_max, -1, start + time, length)
    for i in range(joints.shape[1]):
        q1, q2, q3 = joints[1, i], joints[2, i], joints[3, i]
        _greater(found[0], abs(q1 * feed) / limits[0, i], i, start + time, length)
        _greater(found[1], abs(q1 * bend + q2 * feed * feed) / limits[1, i], i, start + time, length)
        if limits[2, i] < np.inf:
            jerk = q1 * j + 3.0 * q2 * feed * bend + q3 * feed**3
            _greater(found[2], abs(jerk) / limits[2, i], i, start + time, length)


@compiled
def _greater(row, ratio, joint, time, length):
    """Keep the greatest ratio and its place."""
    if ratio > row[0]:
        row[0], row[1], row[2], row[3] = ratio, joint, time, length


@compiled
def worst(breaks, polynomials, law, limits, feed_max, refine, found):
    """Greatest shares, (k, 4, 4), over a law (5, k + 1) = (knots, length, feed, acceleration, jerk)."""
    joints, piece = np.empty((4, polynomials.shape[2])), 0
    spacing = (breaks[-1] - breaks[0]) / (breaks.size - 1)
    for k in range(law.shape[1] - 1):
        span, row = law[0, k + 1] - law[0, k], (law[0, k], law[1, k], law[2, k], law[3, k], law[4, k])
        # a piece of the law may cover many pieces of the path: at least `refine` places in each
        parts = refine * max(1, int(np.ceil(2.0 * (law[1, k + 1] - law[1, k]) / spacing)))
        for i in range(parts + 1):
            time = span * i / parts
            piece = _piece_at(breaks, _advanced(time, *row[1:])[0], piece)
            _note(time, row, (polynomials[piece], breaks[piece]), joints, limits, feed_max, found[k])


@compiled
def closest(breaks, polynomials, law, limits, feed_max, refine, each, found):
    """Greatest shares over a whole law, (4, 4), looked at again nearby; `each` for those of its pieces."""
    worst(breaks, polynomials, law, limits, feed_max, refine, each)
    near, closer = np.empty((5, 2)), np.empty((1, QUANTITIES, 4))
    for quantity in range(QUANTITIES):
        piece = np.argmax(each[:, quantity, 0])
        begin = _around(law[:, piece : piece + 2], each[piece, quantity, 2], refine, near)
        closer[:], closer[0, :, 1] = 0.0, -1.0
        worst(breaks, polynomials, near, limits, feed_max, CLOSER, closer)
        closer[0, quantity, 2] += begin
        nearby = closer[0, quantity, 0] > each[piece, quantity, 0]
        for i in range(4):
            found[quantity, i] = closer[0, quantity, i] if nearby else each[piece, quantity, i]


@compiled
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
