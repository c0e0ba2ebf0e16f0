# mypy: allow-untyped-decorators, allow-untyped-defs, allow-untyped-calls
"""Best points from nowhere: the least places of a lattice, down a barrier, to the conditions of a best point."""

import numpy as np
from numba import njit

from sdpgrind.locus._kkt_kernels import _OPTIONS, GOOD, curvature, evaluate, gradient_row, newton, sizes, solve
from sdpgrind.locus._tape_kernels import run, work_size

FIRST, SHRINK, LAST = 0.1, 0.03, 2e-12
"""Of the barrier: its weight goes down from 0.1 of the room around the start to 2e-12."""
LONGEST = 0.15
"""Step: a longer one may leave the valley."""
FLAT = 1e-8
"""Curvature that is none."""


@njit(**_OPTIONS)
def lattice_minima(first, n, m, hidden, lattice, ticks):
    """Indices of feasible points of a lattice that are no worse than all their neighbours, along controls and across."""
    cost = _costs(first, n, m, hidden, lattice)
    chosen = np.zeros(cost.size, dtype=np.bool_)
    for k in range(cost.size):
        chosen[k] = cost[k] < np.inf and not _has_better_neighbour(cost, k, n, ticks)
    return np.flatnonzero(chosen)


@njit(**_OPTIONS)
def lattice_best(first, n, m, hidden, t, places, lattice):
    """For each place of the t-th hidden state, index and cost of the cheapest feasible point of a lattice; inf: none."""
    found, costs, all_hidden = np.zeros(places.size, dtype=np.int64), np.empty(places.size), hidden.copy()
    for k in range(places.size):
        all_hidden[t] = places[k]
        cost = _costs(first, n, m, all_hidden, lattice)
        found[k] = np.argmin(cost)
        costs[k] = cost[found[k]]
    return found, costs


@njit(**_OPTIONS)
def _costs(first, n, m, hidden, lattice):
    """At all points of a lattice; inf where one is not feasible."""
    given, out, work = np.empty(n + hidden.size), np.empty(1 + m), np.empty(work_size(first))
    given[n:] = hidden
    cost = np.full(lattice.shape[0], np.inf)
    for k in range(cost.size):
        given[:n] = lattice[k]
        run(first, given, work, out)
        feasible = np.isfinite(out[0])
        for j in range(m):
            feasible = feasible and out[1 + j] < 0.0
        if feasible:
            cost[k] = out[0]
    return cost


@njit(**_OPTIONS)
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


@njit(**_OPTIONS)
def _merit(first, n, m, given, weight, work, out):
    """Cost with the barrier; inf outside."""
    run(first, given, work, out)
    total = out[0]
    for i in range(n):
        if not 0.0 < given[i] < 1.0:
            return np.inf
        total -= weight * (np.log(given[i]) + np.log(1.0 - given[i]))
    for j in range(m):
        if not out[1 + j] < 0.0:
            return np.inf
        total -= weight * np.log(-out[1 + j])
    return total if np.isfinite(total) else np.inf


@njit(**_OPTIONS)
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
                hessian[i, k] += force * (d[f * (1 + n) + (j * n + i) * n + k] + d[f + j * n + i] * d[f + j * n + k] / -d[j])


@njit(**_OPTIONS)
def _downhill(hessian, gradient, step):
    """Newton's step, or one as if the curvature were greater where it does not lead down."""
    n = gradient.size
    extra = 0.0
    for _ in range(40):
        a = hessian.copy()
        for i in range(n):
            a[i, i] += extra
        positive = True
        for size in range(1, n + 1):
            positive = positive and solve(a[:size, :size].copy(), np.zeros(size)) > 0.0
        if positive:
            step[:] = -gradient
            solve(a, step)
            return
        extra = max(1e-3, 4.0 * extra)
    step[:] = -gradient


@njit(**_OPTIONS)
def descend(kkt, first, n, m, h, hidden, t, start):
    """From a feasible place of the controls down to near a best point; gives the places and the last weight of the barrier."""
    work, d = np.empty(work_size(kkt)), np.empty(sizes(kkt, n, m, h))
    work_first, out, given, trial = np.empty(work_size(first)), np.empty(1 + m), np.empty(n + h), np.empty(n + h)
    given[:n], given[n:] = start, hidden
    trial[n:] = hidden
    hessian, gradient, step, point = np.empty((n, n)), np.empty(n), np.empty(n), np.zeros(n + m + 2)
    weight = FIRST * _room(first, n, m, given, work_first, out)
    while True:
        for _ in range(30):
            point[:n], point[n + m + 1] = given[:n], hidden[t]
            evaluate(kkt, n, h, point, hidden, t, work, d)
            _barrier_system(d, given, n, m, weight, hessian, gradient)
            _downhill(hessian, gradient, step)
            step *= min(1.0, LONGEST / max(np.max(np.abs(step)), 1e-300))
            before, slope = _merit(first, n, m, given, weight, work_first, out), np.sum(step * gradient)
            length = 1.0
            for _ in range(50):
                trial[:n] = given[:n] + length * step
                if _merit(first, n, m, trial, weight, work_first, out) <= before + 1e-4 * length * slope:
                    break
                length *= 0.5
            else:
                break
            given[:n] = trial[:n]
            if length == 1.0 and -slope < 1e-3 * weight:
                break
        if weight <= LAST:
            return given[:n].copy(), weight
        weight = max(weight * SHRINK, LAST)


@njit(**_OPTIONS)
def _room(first, n, m, given, work, out):
    """Least distance to a bound or a limit, at most 1: a barrier of more weight would push a start out of its valley."""
    run(first, given, work, out)
    least = 1.0
    for i in range(n):
        least = min(least, given[i], 1.0 - given[i])
    for j in range(m):
        least = min(least, -out[1 + j])
    return max(least, 1e-6)


@njit(**_OPTIONS)
def _guess(d, q, weight, n, m, held, point):
    """Set and multipliers where the barrier ended."""
    near = np.sqrt(weight)
    f = 1 + m
    for i in range(n):
        held[i] = -1 if q[i] < near else (1 if 1.0 - q[i] < near else 0)
        point[i] = q[i] if held[i] == 0 else (0.0 if held[i] < 0 else 1.0)
    point[n] = 1.0
    for j in range(1, f):
        held[n + j - 1] = 1 if -d[j] < near else 0
        point[n + j] = weight / -d[j] if held[n + j - 1] == 1 else 0.0
    point[n : n + f] /= np.sqrt(np.sum(point[n : n + f] ** 2))


@njit(**_OPTIONS)
def _mended(d, point, held, n, m, h, t):
    """Drop what pulls the wrong way, add what is violated; says whether anything was wrong."""
    row, worst, index = np.empty(point.size), -1e-9, -1
    for i in range(n):
        slope = gradient_row(d, point, i, n, m, h, t, row)
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


@njit(**_OPTIONS)
def best_point(kkt, first, n, m, h, hidden, t, start, point, held):
    """A best point below a feasible start, into `point` and `held`.

    Gives the curvature there: positive for a least cost, 0 where there is none (many points are as good), -inf if none was found.
    """
    q, weight = descend(kkt, first, n, m, h, hidden, t, start)
    work, d = np.empty(work_size(kkt)), np.empty(sizes(kkt, n, m, h))
    size = n + m + 2
    point[:n], point[size - 1] = q, hidden[t]
    evaluate(kkt, n, h, point, hidden, t, work, d)
    _guess(d, q, weight, n, m, held, point)
    row = np.zeros(size)
    row[size - 1] = 1.0
    flat = abs(curvature(d, point, held, n, m)) <= FLAT
    for _ in range(2 * (n + m) + 2):
        anchor = point.copy()
        left = newton(kkt, n, m, h, hidden, t, held, anchor, row, 12, point, work, d)[1]
        if not left <= GOOD:
            break
        if not _mended(d, point, held, n, m, h, t):
            found = curvature(d, point, held, n, m)
            return found if found > FLAT else (0.0 if found > -FLAT else -np.inf)
    return 0.0 if flat else -np.inf
