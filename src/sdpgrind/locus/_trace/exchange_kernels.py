"""Exchange of active bounds and constraints at corners, where their gradients become dependent."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.locus._trace.kkt_kernels import _gradient_row, _solve
from sdpgrind.locus._trace.row_kernels import _dot, _made_unit


@compiled(error_model="numpy")
def _column(d, k, held, n, m, out):
    """Fill `out` with the gradient by the controls of the k-th bound or constraint."""
    if k < n:
        out[:] = 0.0
        out[k] = float(held[k])
    else:
        for i in range(n):
            out[i] = d[1 + m + (1 + k - n) * n + i]


@compiled(inline="always")
def _multiplier(d, point, k, held, n, m, h, t):
    """Return the multiplier of the k-th bound or constraint, over the weight of the scaled cost."""
    if k >= n:
        return point[1 + k]
    return -held[k] * _gradient_row(d, point, k, n, m, h, t, np.empty(point.size))


@compiled(inline="always")
def _exchange(d, point, held, new, n, m, h, t):
    """Release the member whose multiplier vanishes first as that of the new one grows; return its index.

    The gradient of the new member depends on the others. Multipliers move to that point. -1: none vanishes.
    """
    others = _held_but(held, new)
    columns, column = np.empty((others.size, n)), np.empty(n)
    for r in range(others.size):
        _column(d, others[r], held, n, m, columns[r])
    _column(d, new, held, n, m, column)
    gram, rates = np.empty((others.size, others.size)), np.empty(others.size)
    for r in range(others.size):
        rates[r] = -_dot(columns[r], column)
        for q in range(others.size):
            gram[r, q] = _dot(columns[r], columns[q])
    if others.size == 0 or _solve(gram, rates) == 0.0:
        return -1
    first, grown = -1, np.inf
    for r in range(others.size):
        if rates[r] < -1e-9:
            reach = max(_multiplier(d, point, others[r], held, n, m, h, t), 0.0) / -rates[r]
            if reach < grown:
                first, grown = others[r], reach
    if first < 0:
        return -1
    for r in range(others.size):
        if others[r] >= n:
            point[1 + others[r]] += grown * rates[r]
    if new >= n:
        point[1 + new] = grown
    held[first] = 0
    if first >= n:
        point[1 + first] = 0.0
    _made_unit(point[n : n + m + 1])
    return first


@compiled(inline="always")
def _held_but(held, new):
    """Return the held indices except the new one."""
    found, count = np.empty(held.size, dtype=np.int64), 0
    for k in range(held.size):
        if held[k] != 0 and k != new:
            found[count] = k
            count += 1
    return found[:count]
