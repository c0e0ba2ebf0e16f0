"""Local parabolas of the robust filter from their moments."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_FLAT = 1e-12  # chosen: determinant of the moments over that without weights: nothing near tells the form


@compiled(error_model="numpy")
def heights(moments, sides, whole, before):
    """Heights of parabolas from the moments of weights (5, n) and values (3, n), by Cramer's rule."""
    found = np.empty_like(before)
    for k in range(before.size):
        m0, m1, m2, m3, m4 = moments[0, k], moments[1, k], moments[2, k], moments[3, k], moments[4, k]
        c0, c1, c2 = m2 * m4 - m3 * m3, m2 * m3 - m1 * m4, m1 * m3 - m2 * m2
        det = m0 * c0 + m1 * c1 + m2 * c2
        told = det > _FLAT * whole * whole * whole
        side = sides[0, k] * c0 + sides[1, k] * c1 + sides[2, k] * c2
        found[k] = side / det if told else before[k]
    return found
