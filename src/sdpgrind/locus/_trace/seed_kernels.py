"""Optima without a start: lattice minima, a barrier method, then Newton on the optimality conditions."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.locus._problem.tape_kernels import run, run_many, work_size
from sdpgrind.locus._trace.kkt_kernels import (
    GOOD,
    _curvature,
    _evaluate,
    _gradient_row,
    _newton,
    _sizes,
    _solve,
)
from sdpgrind.locus._trace.row_kernels import _copied, _dot, _made_unit

# chosen: barrier weight, first over the distance of the start from its limits, factor per round, last
FIRST, SHRINK, LAST = 0.1, 0.03, 2e-12
LONGEST = 0.15  # chosen: step in scaled controls; a longer one may leave the valley
LOW, NEAR = 1e-4, 0.05  # chosen: first barrier weight to try Newton's method, and its longest accepted way
FLAT = 1e-8  # chosen: curvature that counts as 0
AIM = 1e-8  # chosen: scaled slack of a feasible start; it leaves room for a barrier
EDGE = 1e-4  # chosen: least scaled distance of that start from bounds
STARTS, STEPS = 5, 60  # chosen: lattice points tried for it, and steps from each


@compiled(error_model="numpy")
def lattice_minima(first, n, m, hidden, lattice, ticks):
    """Return the indices of feasible lattice points no worse than all neighbours, diagonals included."""
    cost = _costs(first, n, m, hidden, lattice)
    chosen, count = np.empty(cost.size, dtype=np.int64), 0
    for k in range(cost.size):
        if cost[k] < np.inf and not _has_better_neighbour(cost, k, n, ticks):
            chosen[count] = k
            count += 1
    return chosen[:count]


@compiled(error_model="numpy")
def lattice_best(first, n, m, hidden, t, places, lattice):
    """Return index and cost of the cheapest feasible lattice point at each place of the t-th hidden state."""
    found, costs, all_hidden = np.zeros(places.size, dtype=np.int64), np.empty(places.size), hidden.copy()
    for k in range(places.size):
        all_hidden[t] = places[k]
        cost = _costs(first, n, m, all_hidden, lattice)
        found[k] = np.argmin(cost)
        costs[k] = cost[found[k]]
    return found, costs


@compiled(error_model="numpy")
def _costs(first, n, m, hidden, lattice):
    """Return the costs of all lattice points; inf: infeasible."""
    given, out = np.empty((len(lattice), n + hidden.size)), np.empty((len(lattice), 1 + m))
    for k in range(len(lattice)):
        _copied(lattice[k], given[k])
        _copied(hidden, given[k, n:])
    run_many(first, given, out)
    cost = np.empty(len(lattice))
    for k in range(cost.size):
        feasible = np.isfinite(out[k, 0])
        for j in range(m):
            feasible = feasible and out[k, 1 + j] < 0.0
        cost[k] = out[k, 0] if feasible else np.inf
    return cost


@compiled(inline="always")
def _has_better_neighbour(cost, k, n, ticks):
    for step in range(3**n):
        other, inside, stride, code, rest = k, True, 1, step, k
        for _ in range(n):
            place, move = rest % ticks, code % 3 - 1
            inside = inside and 0 <= place + move < ticks
            other += move * stride
            stride, code, rest = stride * ticks, code // 3, rest // ticks
        if inside and (cost[other] < cost[k] or (cost[other] == cost[k] and other < k)):
            return True
    return False


@compiled(error_model="numpy")
def _merit(first, n, m, given, weight, work, out):
    """Return cost plus barrier; inf outside."""
    inside = 1.0
    for i in range(n):
        if not 0.0 < given[i] < 1.0:
            return np.inf
        inside *= given[i] * (1.0 - given[i])
    run(first, given, work, out)
    for j in range(m):
        if not out[1 + j] < 0.0:
            return np.inf
        inside *= -out[1 + j]
    total = out[0] - weight * np.log(inside)
    return total if np.isfinite(total) else np.inf


@compiled(inline="always")
def _barrier_system(d, q, n, m, weight, hessian, gradient):
    f = 1 + m
    for i in range(n):
        gradient[i] = d[f + i] - weight / q[i] + weight / (1.0 - q[i])
        for k in range(n):
            hessian[i, k] = d[f * (1 + n) + i * n + k]
        hessian[i, i] += weight / q[i] ** 2 + weight / (1.0 - q[i]) ** 2
    for j in range(1, f):
        force = weight / -d[j]
        for i in range(n):
            gradient[i] += force * d[f + j * n + i]
            for k in range(n):
                hessian[i, k] += force * (
                    d[f * (1 + n) + (j * n + i) * n + k] + d[f + j * n + i] * d[f + j * n + k] / -d[j]
                )


@compiled(inline="always")
def _downhill(hessian, gradient, factor, step):
    """Fill the Newton step, with the diagonal increased until the Hessian is positive definite."""
    extra = 0.0
    for i in range(step.size):
        step[i] = -gradient[i]
    for _ in range(40):
        if _factored(hessian, extra, factor):
            _solved(factor, step)
            return
        extra = max(1e-3, 4.0 * extra)


@compiled(inline="always")
def _factored(a, extra, factor):
    """Fill the Cholesky factor of a + extra I; return whether it is positive definite."""
    for i in range(a.shape[0]):
        for k in range(i + 1):
            left = a[i, k]
            if i == k:
                left += extra
            for c in range(k):
                left -= factor[i, c] * factor[k, c]
            if i > k:
                factor[i, k] = left / factor[k, k]
            elif left > 0.0:
                factor[i, i] = np.sqrt(left)
            else:
                return False
    return True


@compiled(inline="always")
def _solved(factor, b):
    """Solve with a Cholesky factor, in place."""
    n = b.size
    for i in range(n):
        for c in range(i):
            b[i] -= factor[i, c] * b[c]
        b[i] /= factor[i, i]
    for i in range(n - 1, -1, -1):
        for c in range(i + 1, n):
            b[i] -= factor[c, i] * b[c]
        b[i] /= factor[i, i]


@compiled(error_model="numpy")
def _centre(kkt, first, n, m, h, hidden, t, weight, close, given, point, work, d, work_first, out):
    """Minimise cost plus barrier of this weight from `given`, in place."""
    hessian, factor, gradient, step = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty(n)
    trial = given.copy()
    before = _merit(first, n, m, given, weight, work_first, out)
    for _ in range(30):
        _copied(given[:n], point)
        _evaluate(kkt, n, h, point, hidden, t, work, d)
        _barrier_system(d, given, n, m, weight, hessian, gradient)
        _downhill(hessian, gradient, factor, step)
        longest = 1e-300
        for i in range(n):
            longest = max(longest, abs(step[i]))
        for i in range(n):
            step[i] *= min(1.0, LONGEST / longest)
        slope, length, after = _dot(step, gradient), 1.0, np.inf
        for _ in range(50):
            for i in range(n):
                trial[i] = given[i] + length * step[i]
            after = _merit(first, n, m, trial, weight, work_first, out)
            if after <= before + 1e-4 * length * slope:
                break
            length *= 0.5
        else:
            return
        _copied(trial[:n], given)
        before = after
        if length == 1.0 and -slope < close * weight:
            return


@compiled(inline="always")
def _guess(d, q, weight, n, m, held, point):
    """Estimate set and multipliers at the end of the barrier method."""
    near = np.sqrt(weight)
    f = 1 + m
    for i in range(n):
        held[i] = -1 if q[i] < near else (1 if 1.0 - q[i] < near else 0)
        point[i] = q[i] if held[i] == 0 else (0.0 if held[i] < 0 else 1.0)
    point[n] = 1.0
    for j in range(1, f):
        held[n + j - 1] = 1 if -d[j] < near else 0
        point[n + j] = weight / -d[j] if held[n + j - 1] == 1 else 0.0
    _made_unit(point[n : n + f])


@compiled(inline="always")
def _mended(d, point, held, n, m, h, t):
    """Correct the worst member of a set with wrong multiplier or violation; return whether there was one."""
    row, worst, index = np.empty(point.size), -1e-9, -1
    for i in range(n):
        slope = _gradient_row(d, point, i, n, m, h, t, row)
        value = min(point[i], 1.0 - point[i]) if held[i] == 0 else -held[i] * slope
        if value < worst:
            worst, index = value, i
    for j in range(m):
        value = point[n + 1 + j] if held[n + j] == 1 else -d[1 + j]
        if value < worst:
            worst, index = value, n + j
    if index < 0:
        return False
    if index < n:
        held[index] = 0 if held[index] != 0 else (-1 if point[index] < 0.5 else 1)
    else:
        held[index] = 1 - held[index]
    return True


@compiled(error_model="numpy")
def best_points(kkt, first, n, m, h, hidden, t, starts):
    """Return points (k, n + m + 2), sets (k, n + m), curvatures (k,) of `_best_point` for feasible starts."""
    count = len(starts)
    points, sets, curvatures = (
        np.zeros((count, n + m + 2)),
        np.zeros((count, n + m), dtype=np.int64),
        np.empty(count),
    )
    for k in range(count):
        curvatures[k] = _best_point(kkt, first, n, m, h, hidden, t, starts[k], points[k], sets[k])
    return points, sets, curvatures


@compiled(inline="always")
def _best_point(kkt, first, n, m, h, hidden, t, start, point, held):
    """Fill `point` and `held` with an optimum below a feasible start; return its curvature.

    Positive: an isolated optimum; 0: several points are optimal; -inf: failed. From barrier weight `LOW` on
    Newton's method is tried; a far solution or one with a nearly vanishing multiplier is rejected.
    """
    work, d, row = np.empty(work_size(kkt)), np.empty(_sizes(n, m, h)), np.zeros(n + m + 2)
    work_first, out, given = np.empty(work_size(first)), np.empty(1 + m), np.empty(n + h)
    _copied(start, given)
    _copied(hidden, given[n:])
    row[n + m + 1] = 1.0
    point[n + m + 1], flat = hidden[t], False
    weight = FIRST * _room(first, n, m, given, work_first, out)
    while True:
        last = weight <= LAST
        close = 1e-3 if last else 0.1
        _centre(kkt, first, n, m, h, hidden, t, weight, close, given, point, work, d, work_first, out)
        if weight <= LOW or last:
            _copied(given[:n], point)
            _evaluate(kkt, n, h, point, hidden, t, work, d)
            _guess(d, given, weight, n, m, held, point)
            flat = abs(_curvature(d, point, held, n, m)) <= FLAT
            found = _crossed(kkt, n, m, h, hidden, t, row, point, held, work, d)
            moved = 0.0
            for i in range(n):
                moved = max(moved, abs(point[i] - given[i]))
            if found > FLAT and (
                last or (moved <= NEAR and _pulled(d, point, held, n, m, h, t) > 0.1 * np.sqrt(weight))
            ):
                return found
            if last:
                _copied(given[:n], point)  # centre of all optima
                return 0.0 if found > -FLAT or (flat and found == -np.inf) else -np.inf
        weight = max(weight * SHRINK, LAST)


@compiled(inline="always")
def _pulled(d, point, held, n, m, h, t):
    """Return the least multiplier of the active set; near 0 several points may be optimal."""
    row, least = np.empty(point.size), np.inf
    for i in range(n):
        if held[i] != 0:
            least = min(least, -held[i] * _gradient_row(d, point, i, n, m, h, t, row))
    for j in range(m):
        if held[n + j] == 1:
            least = min(least, point[n + 1 + j])
    return least


@compiled(inline="always")
def _room(first, n, m, given, work, out):
    """Return the least distance to a bound or limit, in [1e-6, 1]; it bounds the barrier weight."""
    run(first, given, work, out)
    least = 1.0
    for i in range(n):
        least = min(least, given[i], 1.0 - given[i])
    for j in range(m):
        least = min(least, -out[1 + j])
    return max(least, 1e-6)


@compiled(error_model="numpy")
def _crossed(kkt, n, m, h, hidden, t, row, point, held, work, d):
    """Solve the conditions from a guess, correcting the set; return the curvature, -inf: failed."""
    for _ in range(2 * (n + m) + 2):
        left = _newton(kkt, n, m, h, hidden, t, held, point.copy(), row, np.int64(12), point, work, d)[1]
        if not left <= GOOD:
            return -np.inf
        if not _mended(d, point, held, n, m, h, t):
            return _curvature(d, point, held, n, m)
    return -np.inf


@compiled(error_model="numpy")
def reach(kkt, n, m, h, hidden, t, lattice):
    """Return a feasible place (n,) found from the least infeasible lattice points; NaN: none."""
    work, d, point = np.empty(work_size(kkt)), np.empty(_sizes(n, m, h)), np.zeros(n + m + 2)
    point[n + m + 1] = hidden[t]
    worst = np.empty(lattice.shape[0])
    for k in range(worst.size):
        _copied(lattice[k], point)
        _evaluate(kkt, n, h, point, hidden, t, work, d)
        worst[k] = _excess(d, m)
    for _ in range(min(STARTS, worst.size)):
        k = _least_untried(worst)
        worst[k] = np.nan
        _copied(lattice[k], point)
        if _gone_inside(kkt, n, m, h, hidden, t, point, work, d):
            return point[:n].copy()
    return np.full(n, np.nan)


@compiled(error_model="numpy")
def _least_untried(worst):
    """Return the index of the least value, the first of equals; NaN: tried. Sorting compiles for 1.5 s."""
    least = -1
    for k in range(worst.size):
        if not np.isnan(worst[k]) and (least < 0 or worst[k] < worst[least]):
            least = k
    return least


@compiled(error_model="numpy")
def _excess(d, m):
    """Return the sum of squared violations; inf without a value."""
    total = 0.0
    for j in range(1, m + 1):
        total += max(d[j] + AIM, 0.0) ** 2
    return total if np.isfinite(total) and np.isfinite(d[0]) else np.inf


@compiled(error_model="numpy")
def _gone_inside(kkt, n, m, h, hidden, t, point, work, d):
    """Minimise the violations by Levenberg's method, in place; return whether none remains."""
    damping, before = 1e-3, np.inf
    a, b, old = np.empty((n, n)), np.empty(n), point.copy()
    for _ in range(STEPS):
        _evaluate(kkt, n, h, point, hidden, t, work, d)
        now = _excess(d, m)
        if now == 0.0:
            return True
        if now < before:
            before, damping = now, 0.3 * damping
            _copied(point, old)
        else:
            _copied(old, point)
            damping *= 4.0
            _evaluate(kkt, n, h, point, hidden, t, work, d)
        a[:], b[:] = 0.0, 0.0
        for i in range(n):
            a[i, i] = damping
        for j in range(1, m + 1):
            over = max(d[j] + AIM, 0.0)
            slope = d[1 + m + j * n : 1 + m + (j + 1) * n]
            for i in range(n if over > 0.0 else 0):
                for k in range(n):
                    a[i, k] += slope[i] * slope[k]
                b[i] -= over * slope[i]
        _solve(a, b)
        for i in range(n):
            point[i] = min(max(point[i] + b[i], EDGE), 1.0 - EDGE)
    return False
