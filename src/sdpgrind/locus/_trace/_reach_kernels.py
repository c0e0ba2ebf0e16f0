"""A feasible place where no point of a lattice is one."""

import numpy as np

from sdpgrind.base.compiled import compiled
from sdpgrind.locus._problem.tape_kernels import work_size
from sdpgrind.locus._trace.kkt_kernels import _evaluate, _sizes, _solve

AIM = 1e-8
"""How far inside the limits, scaled; there is room for a barrier."""
EDGE = 1e-4
"""How near the bounds of controls."""
STARTS, STEPS = 5, 60


@compiled(error_model="numpy")
def reach(kkt, n, m, h, hidden, t, lattice):
    """From the points of a lattice that are the least infeasible to a feasible place (n,); NaN: none was found."""
    work, d, point = np.empty(work_size(kkt)), np.empty(_sizes(kkt, n, m, h)), np.zeros(n + m + 2)
    point[n + m + 1] = hidden[t]
    worst = np.empty(lattice.shape[0])
    for k in range(worst.size):
        point[:n] = lattice[k]
        _evaluate(kkt, n, h, point, hidden, t, work, d)
        worst[k] = _excess(d, m)
    for k in np.argsort(worst)[:STARTS]:
        point[:n] = lattice[k]
        if _gone_inside(kkt, n, m, h, hidden, t, point, work, d):
            return point[:n].copy()
    return np.full(n, np.nan)


@compiled(error_model="numpy")
def _excess(d, m):
    """By how much limits are exceeded: sum of squares; inf where there is no value."""
    total = 0.0
    for j in range(1, m + 1):
        total += max(d[j] + AIM, 0.0) ** 2
    return total if np.isfinite(total) and np.isfinite(d[0]) else np.inf


@compiled(error_model="numpy")
def _gone_inside(kkt, n, m, h, hidden, t, point, work, d):
    """Least squares on what is exceeded, by Levenberg's method; says whether nothing is in the end."""
    damping, before = 1e-3, np.inf
    a, b, old = np.empty((n, n)), np.empty(n), point.copy()
    for _ in range(STEPS):
        _evaluate(kkt, n, h, point, hidden, t, work, d)
        now = _excess(d, m)
        if now == 0.0:
            return True
        if now < before:
            before, damping = now, 0.3 * damping
            old[:] = point
        else:
            point[:], damping = old, 4.0 * damping
            _evaluate(kkt, n, h, point, hidden, t, work, d)
        a[:], b[:] = np.eye(n) * damping, 0.0
        for j in range(1, m + 1):
            over = max(d[j] + AIM, 0.0)
            slope = d[1 + m + j * n : 1 + m + (j + 1) * n]
            if over > 0.0:
                a += np.outer(slope, slope)
                b -= over * slope
        _solve(a, b)
        for i in range(n):
            point[i] = min(max(point[i] + b[i], EDGE), 1.0 - EDGE)
    return False
