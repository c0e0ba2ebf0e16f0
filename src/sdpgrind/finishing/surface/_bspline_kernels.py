"""Points and derivatives of a (rational) B-spline surface at scattered parameters."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def _find_span(knots, degree, x):
    """Index of the non-empty span with x, by halving; the right end belongs to the last one."""
    low, high = degree, len(knots) - degree - 1
    while knots[high - 1] == knots[high]:
        high -= 1
    if x >= knots[high]:
        return high - 1
    while high - low > 1:
        middle = (low + high) // 2
        if x < knots[middle]:
            high = middle
        else:
            low = middle
    return low


@compiled(error_model="numpy")
def _basis(knots, degree, span, x, out):
    """Basis functions of a span with two derivatives, into `out` (3, degree + 2), by Cox-de Boor.

    Only functions whose support holds the span, which is not empty, so that 0/0 does not occur.
    """
    out[:] = 0.0
    out[0, degree] = 1.0
    for d in range(1, degree + 1):
        left = 0.0  # inverse width of a support of degree d - 1; the first of them does not reach this span
        for r in range(degree - d, degree + 1):
            i = span - degree + r
            right = 1.0 / (knots[i + d + 1] - knots[i + 1]) if r < degree else 0.0
            out[2, r] = d * (left * out[1, r] - right * out[1, r + 1])
            out[1, r] = d * (left * out[0, r] - right * out[0, r + 1])
            out[0, r] = left * (x - knots[i]) * out[0, r] + right * (knots[i + d + 1] - x) * out[0, r + 1]
            left = right


@compiled(error_model="numpy")
def _divide_by_weight(flat):
    """Quotient rule, in place: rows (w Q, w) with u, v, uu, uv, vv derivatives become those of Q."""
    w, wu, wv = flat[0, 3], flat[1, 3], flat[2, 3]
    for c in range(3):
        q = flat[0, c] / w
        qu = (flat[1, c] - wu * q) / w
        qv = (flat[2, c] - wv * q) / w
        flat[3, c] = (flat[3, c] - 2.0 * wu * qu - flat[3, 3] * q) / w
        flat[4, c] = (flat[4, c] - wu * qv - wv * qu - flat[4, 3] * q) / w
        flat[5, c] = (flat[5, c] - 2.0 * wv * qv - flat[5, 3] * q) / w
        flat[0, c], flat[1, c], flat[2, c] = q, qu, qv


@compiled(error_model="numpy")
def divide(flat, out):
    """Apply the quotient rule to sums `flat` (6, m, 4), changed in place, and write Q to Qvv (6, m, 3)."""
    for k in range(flat.shape[1]):
        _divide_by_weight(flat[:, k])
        for d in range(6):
            for c in range(3):
                out[d, k, c] = flat[d, k, c]


@compiled(error_model="numpy")
def evaluate(net, rational, knots_u, knots_v, degree_u, degree_v, u, v, out):
    """Write Q, Qu, Qv, Quu, Quv, Qvv at each (u, v) into `out` (6, m, 3).

    `net` (nu, nv, 4) holds (wx, wy, wz, w), or (x, y, z, 0) for a surface that is not rational; four columns
    suit the processor's vectors.
    """
    bu, bv = np.empty((3, degree_u + 2)), np.empty((3, degree_v + 2))
    row, flat = np.empty((3, 4)), np.empty((6, 4))
    at_u, at_v = 0, 0
    for k in range(len(u)):
        if k == 0 or u[k] != u[k - 1]:
            at_u = _find_span(knots_u, degree_u, u[k])
            _basis(knots_u, degree_u, at_u, u[k], bu)
        if k == 0 or v[k] != v[k - 1]:
            at_v = _find_span(knots_v, degree_v, v[k])
            _basis(knots_v, degree_v, at_v, v[k], bv)
        flat[:] = 0.0
        for i in range(degree_u + 1):
            _along_v(net[at_u - degree_u + i], at_v - degree_v, degree_v, bv, row)
            for c in range(4):
                flat[0, c] += bu[0, i] * row[0, c]
                flat[1, c] += bu[1, i] * row[0, c]
                flat[2, c] += bu[0, i] * row[1, c]
                flat[3, c] += bu[2, i] * row[0, c]
                flat[4, c] += bu[1, i] * row[1, c]
                flat[5, c] += bu[0, i] * row[2, c]
        if rational:
            _divide_by_weight(flat)
        for d in range(6):
            for c in range(3):
                out[d, k, c] = flat[d, c]


@compiled(error_model="numpy")
def evaluate_points(net, rational, knots_u, knots_v, degree_u, degree_v, u, v, out):
    """Write Q at each (u, v) into `out` (m, 3): the bits of `evaluate`, without derivatives."""
    bu, bv = np.empty(degree_u + 2), np.empty(degree_v + 2)
    row, flat = np.empty(4), np.empty(4)
    at_u, at_v = 0, 0
    for k in range(len(u)):
        if k == 0 or u[k] != u[k - 1]:
            at_u = _find_span(knots_u, degree_u, u[k])
            _values(knots_u, degree_u, at_u, u[k], bu)
        if k == 0 or v[k] != v[k - 1]:
            at_v = _find_span(knots_v, degree_v, v[k])
            _values(knots_v, degree_v, at_v, v[k], bv)
        flat[:] = 0.0
        for i in range(degree_u + 1):
            row[:] = 0.0
            for j in range(degree_v + 1):
                for c in range(4):
                    row[c] += bv[j] * net[at_u - degree_u + i, at_v - degree_v + j, c]
            for c in range(4):
                flat[c] += bu[i] * row[c]
        for c in range(3):
            out[k, c] = flat[c] / flat[3] if rational else flat[c]


@compiled(error_model="numpy")
def _values(knots, degree, span, x, out):
    """Basis functions of a span, as `_basis`."""
    out[:] = 0.0
    out[degree] = 1.0
    for d in range(1, degree + 1):
        left = 0.0
        for r in range(degree - d, degree + 1):
            i = span - degree + r
            right = 1.0 / (knots[i + d + 1] - knots[i + 1]) if r < degree else 0.0
            out[r] = left * (x - knots[i]) * out[r] + right * (knots[i + d + 1] - x) * out[r + 1]
            left = right


@compiled(error_model="numpy")
def _along_v(points, first, degree, bv, row):
    """Sum one line of control points against the basis along v and its derivatives, into `row` (3, 4)."""
    row[:] = 0.0
    for j in range(degree + 1):
        for c in range(4):
            value = points[first + j, c]
            row[0, c] += bv[0, j] * value
            row[1, c] += bv[1, j] * value
            row[2, c] += bv[2, j] * value
