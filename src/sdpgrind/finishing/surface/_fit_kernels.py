"""Normal equations of a least-squares fit on a tensor basis, as a band."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.finishing.surface._bspline_kernels import _basis, _find_span


@compiled(error_model="numpy")
def normal_equations(knots_u, knots_v, degree_u, degree_v, u, v, points, band, right):
    """Add A^T A to `band` (n, width) and A^T points to `right` (n, 3).

    The band is the upper triangle by rows, from the diagonal on. A holds the products of basis functions at
    (u, v), a row a point; coefficient (i, j) of the net has the number i nv + j.
    """
    nv = len(knots_v) - degree_v - 1
    bu, bv = np.empty((3, degree_u + 2)), np.empty((3, degree_v + 2))
    for k in range(len(u)):
        at_u, at_v = _find_span(knots_u, degree_u, u[k]), _find_span(knots_v, degree_v, v[k])
        _basis(knots_u, degree_u, at_u, u[k], bu)
        _basis(knots_v, degree_v, at_v, v[k], bv)
        for i in range(degree_u + 1):
            for j in range(degree_v + 1):
                weight = bu[0, i] * bv[0, j]
                row = (at_u - degree_u + i) * nv + at_v - degree_v + j
                for c in range(3):
                    right[row, c] += weight * points[k, c]
                for m in range(j, degree_v + 1):
                    band[row, m - j] += weight * bu[0, i] * bv[0, m]
                for other in range(i + 1, degree_u + 1):
                    off = (other - i) * nv - j
                    for m in range(degree_v + 1):
                        band[row, off + m] += weight * bu[0, other] * bv[0, m]
