"""What gives way where something becomes active that cannot be held beside all that is: at corners."""

import numpy as np

from sdpgrind.base.compiled import compiled
from sdpgrind.locus._trace.kkt_kernels import _gradient_row, _solve
from sdpgrind.locus._trace.row_kernels import _made_unit


@compiled(error_model="numpy")
def _column(d, k, held, n, m, out):
    """Gradient by the controls of the k-th of all bounds and constraints."""
    if k < n:
        out[:] = 0.0
        out[k] = float(held[k])
    else:
        for i in range(n):
            out[i] = d[1 + m + (1 + k - n) * n + i]


@compiled(inline="always")
def _multiplier(d, point, k, held, n, m, h, t):
    """Of the k-th of all bounds and constraints, over the weight of the cost's own scale."""
    if k >= n:
        return point[1 + k]
    return -held[k] * _gradient_row(d, point, k, n, m, h, t, np.empty(point.size))


@compiled(inline="always")
def _exchange(d, point, held, new, n, m, h, t):
    """Let the member of a set go whose multiplier is the first to vanish as that of the new one grows, and say which.

    The gradient of the new one depends on those of the others. Multipliers are left as they are then. Gives -1 where none
    vanishes: there feasibility ends.
    """
    others = _held_but(held, new)
    columns, column = np.empty((others.size, n)), np.empty(n)
    for r in range(others.size):
        _column(d, others[r], held, n, m, columns[r])
    _column(d, new, held, n, m, column)
    rates = -columns @ column
    if others.size == 0 or _solve(columns @ columns.T, rates) == 0.0:
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
    """Return what is held, without the new one."""
    found, count = np.empty(held.size, dtype=np.int64), 0
    for k in range(held.size):
        if held[k] != 0 and k != new:
            found[count] = k
            count += 1
    return found[:count]
