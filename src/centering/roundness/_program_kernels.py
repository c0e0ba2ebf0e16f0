"""The linear program of an extreme cylinder on linearised distances, by exchange of one row of six.

Unknown are the step of the place (4), top and bottom, in any unit of length. A row is a point under the top,
a point over the bottom, or a wall of the box of steps: row @ unknown >= limit. Six rows with prices >= 0 that
add up to the cost prove a lower bound. The row that is violated most enters, that whose price ends first
leaves, and the bound rises, until no row is violated.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_VIOLATED = 1e-10  # chosen: violation that is left, over the larger of 1 and the box; rounding is some 1e-14
_TURNS = 1e-9  # chosen: least share of a row in the one that enters; less says nothing but rounding
_STEPS = 500  # chosen: exchanges at most; measured: 23 for 7 x 360 points


@compiled
def program(height, slope, box, outer, inner, rows):
    """Least outer * top - inner * bottom, steps within a box: unknown (6,), prices (6,), whether solved.

    Writes the six rows that hold it to `rows`: point k under the top k, over the bottom n + k, then walls.
    """
    start(height, slope, outer, inner, rows)
    matrix, limits, cost = np.zeros((6, 6)), np.zeros(6), np.zeros(6)
    cost[4], cost[5] = outer, -inner
    entering, inverse, shares = np.zeros(6), np.zeros((6, 6)), np.zeros(6)
    unknown, prices = np.zeros(6), np.zeros(6)
    for k in range(6):
        limits[k] = _row(rows[k], height, slope, box, matrix[k])
    for _ in range(_STEPS):
        if not _inverted(matrix, inverse):
            break
        _times(inverse, limits, unknown)
        _times(inverse.T, cost, prices)
        enters, violated = _violated(height, slope, box, outer, inner, unknown)
        if violated <= _VIOLATED * max(1.0, box) or _holds(rows, enters):
            return unknown, prices, True
        limit = _row(enters, height, slope, box, entering)
        _times(inverse.T, entering, shares)
        leaves = _leaving(shares, prices)
        if leaves < 0:
            break
        rows[leaves], limits[leaves] = enters, limit
        for k in range(6):
            matrix[leaves, k] = entering[k]
    return unknown, prices, False


@compiled
def _holds(rows, enters):
    """Whether the row to enter is one of the six: what it is violated by is rounding."""
    found = False
    for row in rows:
        found |= row == enters
    return found


@compiled
def _times(matrix, vector, product):
    """Write matrix @ vector: the operator itself, and `np.linalg.inv`, compile for a second and a half."""
    for k in range(6):
        product[k] = 0.0
        for j in range(6):
            product[k] += matrix[k, j] * vector[j]


@compiled
def _inverted(matrix, inverse):
    """Write the inverse, by Gauss-Jordan elimination with pivots from rows; return whether there is one."""
    left = np.empty((6, 6))
    for k in range(6):
        for j in range(6):
            left[k, j], inverse[k, j] = matrix[k, j], 1.0 if k == j else 0.0
    for k in range(6):
        pivot = k
        for i in range(k + 1, 6):
            if abs(left[i, k]) > abs(left[pivot, k]):
                pivot = i
        if left[pivot, k] == 0.0:
            return False
        for j in range(6):
            left[k, j], left[pivot, j] = left[pivot, j], left[k, j]
            inverse[k, j], inverse[pivot, j] = inverse[pivot, j], inverse[k, j]
        _cleared(left, inverse, k)
    return True


@compiled
def _cleared(left, inverse, k):
    """Divide row k by its pivot, and take it from all others."""
    scale = 1.0 / left[k, k]
    for j in range(6):
        left[k, j] *= scale
        inverse[k, j] *= scale
    for i in range(6):
        factor = left[i, k]
        for j in range(6 if i != k and factor != 0.0 else 0):
            left[i, j] -= factor * left[k, j]
            inverse[i, j] -= factor * inverse[k, j]


@compiled
def start(height, slope, outer, inner, rows):
    """Six rows whose prices are >= 0: highest and lowest point, and the walls that face their difference."""
    n, high, low = height.size, 0, 0
    for k in range(n):
        high = k if height[k] > height[high] else high
        low = k if height[k] < height[low] else low
    for k in range(4):
        pull = outer * slope[high, k] - inner * slope[low, k]
        rows[k] = 2 * n + 2 * k + (0 if pull >= 0.0 else 1)
    rows[4] = high if outer else 2 * n + 8
    rows[5] = n + low if inner else 2 * n + 9


@compiled
def _row(code, height, slope, box, row):
    """Write the coefficients of a row; return its limit."""
    n = height.size
    row[:] = 0.0
    if code < 2 * n:
        sign, point = (-1.0, code) if code < n else (1.0, code - n)
        for k in range(4):  # a loop: an array put into a slice compiles the text of its shape error
            row[k] = sign * slope[point, k]
        row[4 if code < n else 5] = -sign
        return -sign * height[point]
    wall = code - 2 * n
    if wall < 8:
        row[wall // 2] = 1.0 if wall % 2 == 0 else -1.0
        return -box
    row[wall - 4] = 1.0  # a side that does not count stays at 0
    return 0.0


@compiled
def _violated(height, slope, box, outer, inner, unknown):
    """Row that is violated most, and its violation."""
    n, top, bottom = height.size, unknown[4], unknown[5]
    a, b, c, d = unknown[0], unknown[1], unknown[2], unknown[3]
    far, near, most, least = 0, 0, -np.inf, np.inf
    for k in range(n):
        moved = height[k] + slope[k, 0] * a + slope[k, 1] * b + slope[k, 2] * c + slope[k, 3] * d
        if moved > most:
            far, most = k, moved
        if moved < least:
            near, least = k, moved
    code, worst = far, (most - top if outer else -np.inf)
    if inner and bottom - least > worst:
        code, worst = n + near, bottom - least
    for k in range(4):
        beyond = abs(unknown[k]) - box
        if beyond > worst:
            code, worst = 2 * n + 2 * k + (0 if unknown[k] < 0.0 else 1), beyond
    return code, worst


@compiled
def _leaving(shares, prices):
    """Row whose price ends first as that of the entering one grows; of nearly equal ones the largest share.

    Harris (1973): a small share beside a large one of nearly the same ratio would make the six rows alike.
    """
    least = np.inf
    for k in range(6):
        if shares[k] > _TURNS:
            least = min(least, (max(prices[k], 0.0) + _TURNS) / shares[k])
    leaves = -1
    for k in range(6):
        near = shares[k] > _TURNS and max(prices[k], 0.0) <= least * shares[k]
        if near and (leaves < 0 or shares[k] > shares[leaves]):
            leaves = k
    return leaves
