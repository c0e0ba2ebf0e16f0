"""Optimality conditions, their Jacobian, and Newton's method.

The unknowns are Y = (q, mu_0, mu, p): scaled controls q (n), weight mu_0 of the cost, weights mu of the m
constraints, scaled hidden state p. The squares of the weights sum to 1; multipliers are mu/mu_0, and mu_0 = 0
is the end of feasibility. A set `held` (n + m,) marks each control as free (0), at its least (-1) or greatest
(1) value, and each constraint as active (1) or inactive (0).
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.locus._problem.tape_kernels import run

CLOSE = 1e-13  # chosen: residual that ends Newton's method; rounding prevents less
# chosen: last step of a point accepted at `GOOD`; near crossings small residuals are far from the root
STILL = 1e-8
GOOD = 1e-10  # chosen: residual of an accepted point that cannot be improved


@compiled(error_model="numpy")
def _sizes(n, m, h):
    """Return the number of outputs of the tape."""
    return (1 + m) * (1 + n + n * n + n * h + h)


@compiled(error_model="numpy")
def _evaluate(kkt, n, h, point, hidden, t, work, out):
    """Run the tape at a point; `hidden` are scaled hidden states, the t-th replaced by the point's own."""
    for i in range(n):
        work[i] = point[i]
    for k in range(h):
        work[n + k] = hidden[k]
    work[n + t] = point[point.size - 1]
    run(kkt, work, work, out)


@compiled(error_model="numpy")
def _gradient_row(d, point, i, n, m, h, t, row):
    """Return the slope of the Lagrangian by the i-th control; `row`: its derivatives by all unknowns."""
    f = 1 + m
    hess, mixed = f * (1 + n), f * (1 + n + n * n)
    row[:] = 0.0
    value = 0.0
    for j in range(f):
        mu = point[n + j]
        slope = d[f + j * n + i]
        value += mu * slope
        row[n + j] = slope
        for k in range(n):
            row[k] += mu * d[hess + (j * n + i) * n + k]
        row[n + f] += mu * d[mixed + (j * n + i) * h + t]
    return value


@compiled(error_model="numpy")
def _constraint_row(d, j, n, m, h, t, row):
    """Return the j-th constraint (1..m); `row`: its derivatives by all unknowns."""
    f = 1 + m
    row[:] = 0.0
    for k in range(n):
        row[k] = d[f + j * n + k]
    row[n + f] = d[f * (1 + n + n * n + n * h) + j * h + t]
    return d[j]


@compiled(error_model="numpy")
def _conditions(d, point, held, n, m, h, t, residual, jacobian):
    """Fill F(Y) and F_Y, n + 1 + m rows: stationarity or bounds, norm, constraints or multipliers."""
    f = 1 + m
    for i in range(n):
        if held[i] == 0:
            residual[i] = _gradient_row(d, point, i, n, m, h, t, jacobian[i])
        else:
            jacobian[i, :] = 0.0
            jacobian[i, i] = 1.0
            residual[i] = point[i] - (0.0 if held[i] < 0 else 1.0)
    jacobian[n, :] = 0.0
    total = -1.0
    for j in range(f):
        total += point[n + j] ** 2
        jacobian[n, n + j] = 2.0 * point[n + j]
    residual[n] = total
    for j in range(1, f):
        if held[n + j - 1] == 1:
            residual[n + j] = _constraint_row(d, j, n, m, h, t, jacobian[n + j])
        else:
            jacobian[n + j, :] = 0.0
            jacobian[n + j, n + j] = 1.0
            residual[n + j] = point[n + j]


@compiled(error_model="numpy")
def _solve(a, b):
    """Solve a x = b in place by Gaussian elimination with pivoting; return the determinant (0: unsolved)."""
    size = b.size
    determinant = 1.0
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if not abs(a[best, k]) > 0.0:
            return 0.0
        if best != k:
            for c in range(k, size):
                a[k, c], a[best, c] = a[best, c], a[k, c]
            b[k], b[best] = b[best], b[k]
            determinant = -determinant
        determinant *= a[k, k]
        for i in range(k + 1, size):
            factor = a[i, k] / a[k, k]
            if factor != 0.0:
                for c in range(k + 1, size):
                    a[i, c] -= factor * a[k, c]
                b[i] -= factor * b[k]
    for k in range(size - 1, -1, -1):
        for c in range(k + 1, size):
            b[k] -= a[k, c] * b[c]
        b[k] /= a[k, k]
    return determinant


@compiled(error_model="numpy")
def _tangent_at(d, point, held, n, m, h, t, along, tangent):
    """Fill the unit tangent on the side of `along`; return the determinant of the bordered Jacobian."""
    size = point.size
    a, residual = np.empty((size, size)), np.empty(size)
    _conditions(d, point, held, n, m, h, t, residual, a)
    for k in range(size):
        a[size - 1, k] = along[k]
        tangent[k] = 0.0
    tangent[size - 1] = 1.0
    determinant = _solve(a, tangent)
    length = 0.0
    for k in range(size):
        length += tangent[k] ** 2
    length = np.sqrt(length)
    for k in range(size):
        tangent[k] /= length
    return determinant * length


@compiled(error_model="numpy")
def _newton(kkt, n, m, h, hidden, t, held, anchor, row, most, point, work, d):
    """Solve F(Y) = 0 and row.(Y - anchor) = 0 from `point`, in place; return steps and residual.

    `d` receives the output of the tape at the solution.
    """
    size = point.size
    a, b = np.empty((size, size)), np.empty(size)
    before, moved = np.inf, np.inf
    for step in range(most + 1):
        _evaluate(kkt, n, h, point, hidden, t, work, d)
        _conditions(d, point, held, n, m, h, t, b, a)
        along = 0.0
        for k in range(size):
            a[size - 1, k] = row[k]
            along += row[k] * (point[k] - anchor[k])
        b[size - 1] = along
        left = 0.0
        for k in range(size):
            left = max(left, abs(b[k]))
            if not np.isfinite(b[k]):
                return step, np.inf
        if left <= CLOSE or step == most or (left <= GOOD and left > 0.1 * before and moved <= STILL):
            return step, left
        before, moved = left, 0.0
        if _solve(a, b) == 0.0:
            return step, np.inf
        for k in range(size):
            point[k] -= b[k]
            moved = max(moved, abs(b[k]))
    return most, left


@compiled(inline="always")
def _free_directions(d, held, n, m, basis):
    """Fill `basis` with orthonormal rows, active gradients over free controls, then others; return counts.

    A negative second count means dependent active gradients.
    """
    f = 1 + m
    rows, dependent = np.int64(0), False  # a literal 0 would compile other kernels a second time
    for j in range(1, f):
        if held[n + j - 1] == 1:
            whole = 0.0  # largest slope, the scale of rounding
            for i in range(n):
                basis[rows, i] = d[f + j * n + i] if held[i] == 0 else 0.0
                whole = max(whole, abs(d[f + j * n + i]))
            if _length(basis, rows, n) > 1e-16 * whole and _orthonormal(basis, rows, n, 1e-9) and rows < n:
                rows += 1
            else:
                dependent = True
    active = rows
    for i in range(n):
        if held[i] == 0 and rows < n:
            basis[rows, :] = 0.0
            basis[rows, i] = 1.0
            if _orthonormal(basis, rows, n, 1e-6):
                rows += 1
    return active, -1 if dependent else rows - active


@compiled(error_model="numpy")
def _orthonormal(basis, k, n, least):
    """Make row k orthonormal to those above; return whether enough remains."""
    before = _length(basis, k, n)
    for _ in range(2 if k else 0):
        for r in range(k):
            dot = 0.0
            for i in range(n):
                dot += basis[k, i] * basis[r, i]
            for i in range(n):
                basis[k, i] -= dot * basis[r, i]
    after = _length(basis, k, n)
    if not after > least * before:
        return False
    for i in range(n):
        basis[k, i] /= after
    return True


@compiled(error_model="numpy")
def _length(basis, k, n):
    total = 0.0
    for i in range(n):
        total += basis[k, i] * basis[k, i]
    return np.sqrt(total)


@compiled(error_model="numpy")
def _curvature(d, point, held, n, m):
    """Return the least curvature of the Lagrangian in free directions; inf: none, -inf: dependent set."""
    basis = np.zeros((n + m + 1, n))
    active, free = _free_directions(d, held, n, m, basis)
    if free < 0:
        return -np.inf
    if free == 0:
        return np.inf
    if free == 1:
        return _curved(d, point, basis, active, active, n, m)
    reduced = np.zeros((free, free))
    for a in range(free):
        for b in range(a + 1):
            both = _curved(d, point, basis, active + a, active + b, n, m) + _curved(
                d, point, basis, active + b, active + a, n, m
            )
            reduced[a, b] = reduced[b, a] = 0.5 * both
    return np.linalg.eigvalsh(reduced)[0]


@compiled(error_model="numpy")
def _curved(d, point, basis, a, b, n, m):
    """Return the second derivative of the Lagrangian along rows a and b, over the weight of the cost."""
    hess, total = (1 + m) * (1 + n), 0.0
    for j in range(1 + m):
        for i in range(n):
            for k in range(n):
                total += point[n + j] * basis[a, i] * d[hess + (j * n + i) * n + k] * basis[b, k]
    return total / point[n]
