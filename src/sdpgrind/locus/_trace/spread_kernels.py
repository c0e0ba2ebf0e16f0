"""Tables along a run of nodes: cubic guesses, corrected by Newton's method in blocks of points."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.locus._problem.tape_kernels import BLOCK, _room, _run_block, work_size
from sdpgrind.locus._trace.kkt_kernels import (
    CLOSE,
    _conditions,
    _curvature,
    _gradient_row,
    _newton,
    _sizes,
    _solve,
)
from sdpgrind.locus._trace.row_kernels import _copied, _hermite, _made_unit

EXACT = 1e-11  # chosen: residual after one step; a larger one gets further steps


@compiled(error_model="numpy")
def spread(kkt, n, m, h, hidden, t, held, nodes, tangents, points, along, pulls, residuals, curvatures):
    """Fill a table of `points` along the nodes of one run, at equal arclength.

    `along`: unit tangents; `pulls`: slopes of the Lagrangian by held controls over the cost's weight, or 0.
    """
    size, count, arc, segment = n + m + 2, points.shape[0], _lengths(nodes), 0
    work, d, rows = _room(kkt, BLOCK), np.empty((BLOCK, _sizes(n, m, h))), np.empty((BLOCK, size))
    a, b, single = np.empty((size, size)), np.empty(size), np.empty(work_size(kkt))
    for since in range(0, count, BLOCK):
        here = min(BLOCK, count - since)
        for k in range(here):
            s = arc[-1] * (since + k) / max(count - 1, 1)
            while segment < arc.size - 2 and s > arc[segment + 1]:
                segment += 1
            _cubic(nodes, tangents, arc, segment, s, points[since + k], rows[k])
        _run(kkt, n, h, hidden, t, points[since : since + here], work, d)
        for k in range(here):
            _step(d[k], points[since + k], rows[k], held, n, m, h, t, a, b)
        _run(kkt, n, h, hidden, t, points[since : since + here], work, d)
        for k in range(here):
            place = since + k
            residuals[place] = _finish(
                kkt, d[k], points[place], rows[k], held, n, m, h, hidden, t, a, b, single,
                along[place], pulls[place],
            )  # fmt: skip
            curvatures[place] = _curvature(d[k], points[place], held, n, m)


@compiled(inline="always")
def _lengths(nodes):
    """Return the length of the polygon up to each node."""
    arc = np.zeros(len(nodes))
    for k in range(len(nodes) - 1):
        total = 0.0
        for i in range(nodes.shape[1]):
            total += (nodes[k + 1, i] - nodes[k, i]) ** 2
        arc[k + 1] = arc[k] + np.sqrt(total)
    return arc


@compiled(inline="always")
def _cubic(nodes, tangents, arc, k, s, point, row):
    """Fill the Hermite guess of point and tangent at arclength s in segment k."""
    span = arc[k + 1] - arc[k]
    u = (s - arc[k]) / span if span > 0.0 else 0.0
    a, b, c, e = _hermite(u, span)
    for i in range(point.size):
        point[i] = a * nodes[k, i] + b * tangents[k, i] + c * nodes[k + 1, i] + e * tangents[k + 1, i]
        row[i] = (1 - u) * tangents[k, i] + u * tangents[k + 1, i]


@compiled(error_model="numpy")
def _run(kkt, n, h, hidden, t, points, work, d):
    """Run the tape at all points; the rest of the block repeats the last."""
    for k in range(BLOCK):
        place = min(k, len(points) - 1)
        for i in range(n):
            work[i * BLOCK + k] = points[place, i]
        for i in range(h):
            work[(n + i) * BLOCK + k] = hidden[i]
        work[(n + t) * BLOCK + k] = points[place, points.shape[1] - 1]
    _run_block(kkt, work, d)


@compiled(inline="always")
def _step(d, point, row, held, n, m, h, t, a, b):
    """Do one Newton step across the curve."""
    _conditions(d, point, held, n, m, h, t, b, a)
    last = point.size - 1
    _copied(row, a[last])
    b[last] = 0.0
    if _largest(b) > CLOSE and _solve(a, b) != 0.0:  # exact ends of the range stay
        for i in range(point.size):
            point[i] -= b[i]


@compiled(error_model="numpy")
def _largest(values):
    """Return the largest absolute value; inf if one is not finite."""
    largest = 0.0
    for value in values:
        if not np.isfinite(value):
            return np.inf
        largest = max(largest, abs(value))
    return largest


@compiled(inline="always")
def _finish(kkt, d, point, row, held, n, m, h, hidden, t, a, b, work, tangent, pulls):
    """Refine a point if necessary, fill its tangent and `pulls`, and return its residual."""
    last = point.size - 1
    _conditions(d, point, held, n, m, h, t, b, a)
    b[last] = 0.0
    left = _largest(b)
    if not left <= EXACT:
        left = _newton(kkt, n, m, h, hidden, t, held, point.copy(), row, np.int64(6), point, work, d)[1]
        _conditions(d, point, held, n, m, h, t, b, a)
    _copied(row, a[last])
    b[:], b[last] = 0.0, 1.0
    _solve(a, b)
    _made_unit(b)
    _copied(b, tangent)
    for i in range(n):
        pulls[i] = _gradient_row(d, point, i, n, m, h, t, b) / point[n] if held[i] != 0 else 0.0
    return left
