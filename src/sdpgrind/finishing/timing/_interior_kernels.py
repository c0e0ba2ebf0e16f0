"""Interior-point steps for the fastest squared feed x within limits of speed, acceleration and jerk.

At every place there is a row x <= cap, and for each joint

    |a| <= 1 with a = a_0 x + a_1 x',  and  |b| <= x^(-1/2) with b = b_0 x + b_1 x' + b_2 x''.

With r = x^(-1/2), the rooms of its four rows are 1 - a, 1 + a, r - b, r + b. As r is convex in x, its tangent
lies below it: a step that keeps the linear rooms keeps the true ones. For the same reason the curvature of r
is left out of the matrix: it enters with the negative sign of a row that is not convex.

All four rows are summed up at a place in (x, x', x''), then spread to the three coefficients of its interval,
which gives a matrix with two bands on either side of its diagonal.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# chosen: bounds of a dual over mu/room; without them a row far from where it will be stays too stiff
LEAST, MOST = 1e-3, 1e3
ALMOST = 0.99  # chosen: share of the way to the nearest row
DOWN = 0.9  # chosen: greatest share that a step takes from x, on x and not on the coefficients
LOWER = 0.15  # chosen: factor of mu when the present one is reached
# chosen: squared Newton decrement over the gap at which a mu counts as reached; it does not grow with
# rounding, as the residual does where rooms are small
REACHED = 0.1
LARGE = 10.0  # chosen: greatest complementarity over mu at which it counts as reached
STEPS = 300  # chosen: limit; some 15 to 45 are taken


@compiled(error_model="numpy")
def _at(row, c, i):
    """One quantity at a place: a row of three numbers on the coefficients of interval i."""
    return row[0] * c[i] + row[1] * c[i + 1] + row[2] * c[i + 2]


@compiled(error_model="numpy")
def _dual(z, was, change, spread, pace, mu):
    """Dual after a step: room before, its linear change over a whole step, 1/room after."""
    y = z + pace * ((mu - z * change) / was - z)
    return min(max(y, LEAST * mu * spread), MOST * mu * spread)


@compiled(error_model="numpy")
def _pair(z, k, was, now, step, mu):
    """Update the duals of two rows with rooms r - v and r + v; was, now = (r, v), step = (pace, 1/share, dr).

    Return sum and difference of dual over room, and difference and sum of 1/room; both complementarities.
    """
    bent, moved = step[2], (now[1] - was[1]) * step[1]
    below, above = now[0] - now[1], now[0] + now[1]
    p, q = 1.0 / below, 1.0 / above
    y = _dual(z[k], was[0] - was[1], bent - moved, p, step[0], mu)
    w = _dual(z[k + 1], was[0] + was[1], bent + moved, q, step[0], mu)
    z[k], z[k + 1] = y, w
    return (y * p + w * q, y * p - w * q, q - p, q + p), (y * below, w * above)


@compiled(error_model="numpy")
def _with(sums, pair, g0, g1, g2, d):
    """Sums at a place with two rows added whose rooms have the gradients (d, 0, 0) -+ g."""
    s, t, e, p = pair
    f = s * g0 - t * d
    return (
        sums[0] + (f * g0 + d * (s * d - t * g0)),
        sums[1] + f * g1,
        sums[2] + f * g2,
        sums[3] + s * g1 * g1,
        sums[4] + s * g1 * g2,
        sums[5] + s * g2 * g2,
        sums[6] + (e * g0 + p * d),
        sums[7] + e * g1,
        sums[8] + e * g2,
    )


@compiled(error_model="numpy")
def _place(joints, duals, cap, was, now, step, mu, tally):
    """Sums of all rows at one place, x, x', x'' of which were `was` and are `now`, and the tally with it."""
    x, dx, ddx = was
    y, dy, ddy = now
    r, s = 1.0 / np.sqrt(x), 1.0 / np.sqrt(y)
    slope = -0.5 * s / y
    flat, bent = (step[0], step[1], 0.0), (step[0], step[1], -0.5 * r / x * (y - x) * step[1])
    last, room = 4 * joints.shape[0], cap - y
    z = _dual(duals[last], cap - x, (x - y) * step[1], 1.0 / room, step[0], mu)
    duals[last] = z
    total, most = tally[0] + z * room, max(tally[1], z * room)
    sums = (z * (1.0 / room), 0.0, 0.0, 0.0, 0.0, 0.0, -(1.0 / room), 0.0, 0.0)
    for j in range(joints.shape[0]):
        a0, a1, b0, b1, b2 = joints[j, 0], joints[j, 1], joints[j, 2], joints[j, 3], joints[j, 4]
        pair, (p, q) = _pair(duals, 4 * j, (1.0, a0 * x + a1 * dx), (1.0, a0 * y + a1 * dy), flat, mu)
        total, most = total + (p + q), max(most, p, q)
        sums = _with(sums, pair, a0, a1, 0.0, 0.0)
        before, after = b0 * x + b1 * dx + b2 * ddx, b0 * y + b1 * dy + b2 * ddy
        pair, (p, q) = _pair(duals, 4 * j + 2, (r, before), (s, after), bent, mu)
        total, most = total + (p + q), max(most, p, q)
        sums = _with(sums, pair, b0, b1, b2, slope)
    return sums, (total, most)


@compiled(error_model="numpy")
def _spread(sums, row, i, band, barrier):
    """Add the sums at a place to matrix (3, m) and gradient (m,) of the coefficients from i on."""
    for k in range(3):
        x, dx, ddx = row[0, k], row[1, k], row[2, k]
        s0 = sums[0] * x + sums[1] * dx + sums[2] * ddx
        s1 = sums[1] * x + sums[3] * dx + sums[4] * ddx
        s2 = sums[2] * x + sums[4] * dx + sums[5] * ddx
        for n in range(k + 1):
            band[k - n, i + n] += s0 * row[0, n] + s1 * row[1, n] + s2 * row[2, n]
        barrier[i + k] += sums[6] * x + sums[7] * dx + sums[8] * ddx


@compiled(error_model="numpy")
def _time(rows, weights, c, i, band, gradient):
    """Add the time of an interval, int x^(-1/2) ds, with gradient and matrix; return it."""
    total = 0.0
    for g in range(weights.size):
        x = _at(rows[g], c, i)
        time = weights[g] / np.sqrt(x)
        total += time
        for k in range(3):
            gradient[i + k] -= 0.5 * time / x * rows[g, k]
            for n in range(k + 1):
                band[k - n, i + n] += 0.75 * time / (x * x) * rows[g, k] * rows[g, n]
    return total


@compiled(error_model="numpy")
def _assemble(problem, duals, was, c, step, mu, band, gradient, barrier):
    """Update all duals after a step from coefficients `was` to `c`, and sum up matrix and gradients.

    Return the time, the sum of all complementarities and the greatest.
    """
    rows, samples, weights, joints, caps = problem
    tally, total = (0.0, 0.0), 0.0
    for k in range(c.size):
        band[0, k], band[1, k], band[2, k], gradient[k], barrier[k] = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(weights.shape[0]):
        for t in range(3):
            b = rows[i, t]
            before = _at(b[0], was, i), _at(b[1], was, i), _at(b[2], was, i)
            now = _at(b[0], c, i), _at(b[1], c, i), _at(b[2], c, i)
            sums, tally = _place(joints[i, t], duals[i, t], caps[i, t], before, now, step, mu, tally)
            _spread(sums, b, i, band, barrier)
        total += _time(samples[i], weights[i], c, i, band, gradient)
    for k in (0, 1, c.size - 2, c.size - 1):  # not free
        band[0, k], gradient[k], barrier[k] = 1.0, 0.0, 0.0
    return total, tally[0], tally[1]


@compiled(error_model="numpy")
def _factor(band):
    """Replace a matrix by its factors L D L^T, diagonal and two bands below it."""
    for i in range(band.shape[1]):
        first, second = band[1, i] / band[0, i], band[2, i] / band[0, i]
        if i + 1 < band.shape[1]:
            band[0, i + 1] -= first * band[1, i]
            band[1, i + 1] -= first * band[2, i]
        if i + 2 < band.shape[1]:
            band[0, i + 2] -= second * band[2, i]
        band[1, i], band[2, i] = first, second


@compiled(error_model="numpy")
def _solved(band, right, out):
    """Fill `out` with the solution for a right side, by the factors."""
    last = right.size - 1
    for i in range(last + 1):
        out[i] = right[i]
        if i > 0:
            out[i] -= band[1, i - 1] * out[i - 1]
        if i > 1:
            out[i] -= band[2, i - 2] * out[i - 2]
    for i in range(last, -1, -1):
        out[i] /= band[0, i]
        if i < last:
            out[i] -= band[1, i] * out[i + 1]
        if i + 1 < last:
            out[i] -= band[2, i] * out[i + 2]


@compiled(error_model="numpy")
def _nearer(z, room, change, mu, far):
    """Note the relative loss of a row's room and of its dual in a whole step; few are divided."""
    if -change > (1.0 - 1e-9) * far[0] * room:
        far[0] = max(far[0], -change / room)
    after, before = mu - z * change, z * room
    if after < (1.0 + 1e-9 - far[1]) * before:
        far[1] = max(far[1], 1.0 - after / before)


@compiled(error_model="numpy")
def _reach(joints, z, cap, now, move, mu, far):
    """Note how far the rows at one place let x, x', x'' `now` go along `move`."""
    x, dx, ddx = now
    y, dy, ddy = move
    r = 1.0 / np.sqrt(x)
    bent = -0.5 * r / x * y
    far[2] = max(far[2], -y / x)
    _nearer(z[4 * joints.shape[0]], cap - x, -y, mu, far)
    for j in range(joints.shape[0]):
        a0, a1, b0, b1, b2 = joints[j, 0], joints[j, 1], joints[j, 2], joints[j, 3], joints[j, 4]
        a, u = a0 * x + a1 * dx, a0 * y + a1 * dy
        b, v = b0 * x + b1 * dx + b2 * ddx, b0 * y + b1 * dy + b2 * ddy
        _nearer(z[4 * j], 1.0 - a, -u, mu, far)
        _nearer(z[4 * j + 1], 1.0 + a, u, mu, far)
        _nearer(z[4 * j + 2], r - b, bent - v, mu, far)
        _nearer(z[4 * j + 3], r + b, bent + v, mu, far)


@compiled(error_model="numpy")
def _shares(problem, duals, c, move, mu):
    """Shares of a whole step that coefficients and duals may go."""
    rows, samples, _, joints, caps = problem
    far = np.zeros(3)
    for i in range(samples.shape[0]):
        for t in range(3):
            b = rows[i, t]
            now = _at(b[0], c, i), _at(b[1], c, i), _at(b[2], c, i)
            along = _at(b[0], move, i), _at(b[1], move, i), _at(b[2], move, i)
            _reach(joints[i, t], duals[i, t], caps[i, t], now, along, mu, far)
        for g in range(samples.shape[1]):
            far[2] = max(far[2], -_at(samples[i, g], move, i) / _at(samples[i, g], c, i))
    primal = min(1.0, ALMOST / max(far[0], ALMOST), DOWN / max(far[2], DOWN))
    return primal, min(1.0, ALMOST / max(far[1], ALMOST))


@compiled(error_model="numpy")
def _decrement(gradient, barrier, out, mu):
    """Squared Newton decrement, from solutions `out` for both gradients."""
    total = 0.0
    for k in range(gradient.size):
        total += (gradient[k] - mu * barrier[k]) * (out[0, k] - mu * out[1, k])
    return total


@compiled(error_model="numpy")
def _step(out, mu, move):
    """Fill the Newton step of the coefficients."""
    for k in range(move.size):
        move[k] = mu * out[1, k] - out[0, k]


@compiled(error_model="numpy")
def _go(c, move, share, was):
    """Go a share of a step, from what then `was`."""
    for k in range(c.size):
        was[k] = c[k]
        c[k] += share * move[k]


@compiled(error_model="numpy")
def interior(problem, c, mu, gap):
    """Improve coefficients c (m,) that hold every row; return the steps, -1 where a number is not finite.

    After `STEPS` the rows still hold: the law is slower than it could be.

    Parameters
    ----------
    problem : tuple
        Rows (N, 3, 3, 3), samples (N, g, 3) and weights (N, g) of a `SquaredFeed`; numbers a, b of the joints
        at its places (N, 3, n, 5); greatest x there (N, 3).
    c : array, (m,)
        Coefficients, changed in place.
    mu : float
        Complementarity of each row at the start, s.
    gap : float
        Sum of all complementarities over the time at the end.
    """
    intervals, places, joints, _ = problem[3].shape
    duals, step = np.zeros((intervals, places, 4 * joints + 1)), (1.0, 1.0)
    band, was, out = np.empty((3, c.size)), c.copy(), np.empty((2, c.size))
    gradient, barrier, move = np.empty(c.size), np.empty(c.size), np.empty(c.size)
    for number in range(STEPS):
        time, total, most = _assemble(problem, duals, was, c, step, mu, band, gradient, barrier)
        _factor(band)
        _solved(band, gradient, out[0])
        _solved(band, barrier, out[1])
        decrement = _decrement(gradient, barrier, out, mu)
        if not np.isfinite(decrement):
            return -1
        if decrement <= REACHED * mu * duals.size and most <= LARGE * mu:
            if total <= gap * time:
                return number
            mu *= LOWER
        _step(out, mu, move)
        primal, dual = _shares(problem, duals, c, move, mu)
        _go(c, move, primal, was)
        step = (dual, 1.0 / primal)
    return STEPS
