"""Continuation of an optimum after a small change of the problem."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.locus._problem.tape_kernels import work_size
from sdpgrind.locus._trace.kkt_kernels import GOOD, _curvature, _newton, _sizes
from sdpgrind.locus._trace.seed_kernels import _mended


@compiled(error_model="numpy")
def resettle(kkt, n, m, h, hidden, point, held):
    """Solve the conditions again, correcting the active set, in place; return the curvature, -inf: failed."""
    work, d = np.empty(work_size(kkt)), np.empty(_sizes(n, m, h))
    row, t = np.zeros(point.size), np.int64(0)  # a literal 0 would compile the callees a second time
    row[point.size - 1] = 1.0
    for _ in range(2 * (n + m) + 2):
        point[point.size - 1] = hidden[0]
        anchor = point.copy()
        left = _newton(kkt, n, m, h, hidden, t, held, anchor, row, np.int64(20), point, work, d)[1]
        if not left <= GOOD:
            return -np.inf
        if not _mended(d, point, held, n, m, h, t):
            return _curvature(d, point, held, n, m)
    return -np.inf
