"""Follow a branch of optima by pseudo-arclength continuation through changes of the active set."""

import numpy as np

from sdpgrind.base.compiled import compiled
from sdpgrind.locus._problem.tape_kernels import work_size
from sdpgrind.locus._trace.exchange_kernels import _exchange
from sdpgrind.locus._trace.kkt_kernels import (
    GOOD,
    _constraint_row,
    _curvature,
    _evaluate,
    _gradient_row,
    _newton,
    _sizes,
    _tangent_at,
)
from sdpgrind.locus._trace.row_kernels import _ahead, _copied, _dot, _farthest

NONE, LOW, HIGH, RELEASE, DROP, ADD, RANGE, INFEASIBLE, FOLD, BRANCH, LOST, FULL = range(12)
"""Events at a node. Up to ADD the set changes; from RANGE on the branch ends."""
_NOTHING, _FIRST = np.int64(NONE), np.int64(0)  # literal integers would compile their callees a second time
LONGEST, SHORTEST = (
    0.06,
    1e-9,
)  # chosen: steps of arclength; longer ones skip events, shorter ones are rounding
NEAREST = 1e-6  # chosen: step near a crossing of branches at which an inexact event is accepted
SLACKEN = 1e-10  # chosen: rounding of signs
COSINE = 0.966  # derived: of 15 degrees, largest angle between neighbouring tangents
STEPS = 5  # chosen: Newton steps of a corrector; slower convergence shortens the step


@compiled(error_model="numpy")
def _signs(d, point, tangent, determinant, held, low, high, rising, n, m, h, t, found):
    """Fill what must stay >= 0: two per control, one per constraint, range, feasibility, fold, branch."""
    row = np.empty(point.size)
    for i in range(n):
        if held[i] == 0:
            found[2 * i], found[2 * i + 1] = point[i], 1.0 - point[i]
        else:
            slope = _gradient_row(d, point, i, n, m, h, t, row)
            found[2 * i] = slope if held[i] < 0 else -slope
            found[2 * i + 1] = 1.0
    for j in range(m):
        found[2 * n + j] = point[n + 1 + j] if held[n + j] == 1 else -d[1 + j]
    k = 2 * n + m
    place = point[point.size - 1]
    found[k], found[k + 1] = place - low, high - place
    found[k + 2], found[k + 3], found[k + 4] = point[n], rising * tangent[point.size - 1], determinant


@compiled(inline="always")
def _event_of(k, held, n, m):
    """Return kind and index of the event of the k-th sign."""
    if k < 2 * n:
        i = k // 2
        if held[i] != 0:
            return RELEASE, i
        return (LOW if k % 2 == 0 else HIGH), i
    if k < 2 * n + m:
        j = k - 2 * n
        return (DROP if held[n + j] == 1 else ADD), j
    return (RANGE, RANGE, INFEASIBLE, FOLD, BRANCH)[k - 2 * n - m], k - 2 * n - m


@compiled(inline="always")
def _switch(kind, index, held, n):
    """Change the set by an event."""
    if kind == LOW:
        held[index] = -1
    elif kind == HIGH:
        held[index] = 1
    elif kind == RELEASE:
        held[index] = 0
    elif kind == DROP:
        held[n + index] = 0
    elif kind == ADD:
        held[n + index] = 1


@compiled(inline="always")
def _away(kind, index, was, d, point, tangent, n, m, h, t):
    """Return the rate along the tangent of what an event changed; negative: out of the feasible region."""
    row = np.empty(point.size)
    if kind == RELEASE:
        return -was * tangent[index]
    if kind in (LOW, HIGH):
        _gradient_row(d, point, index, n, m, h, t, row)
        return (1.0 if kind == LOW else -1.0) * _dot(row, tangent)
    if kind == DROP:
        _constraint_row(d, index + 1, n, m, h, t, row)
        return -_dot(row, tangent)
    return tangent[n + 1 + index]


@compiled(inline="always")
def _locate(
    kkt, n, m, h, hidden, t, held, low, high, rising, orientation, start, direction, k, left, right, span,
    point, tangent, work, d, found,
):  # fmt: skip
    """Find the length at which sign k fails, by the Illinois rule; fill point and tangent there."""
    a, b, fa, fb = 0.0, span, left, right
    s, side, guess = span, 0, np.empty(point.size)
    for _ in range(80):
        s = (a * fb - b * fa) / (fb - fa) if fb != fa else 0.5 * (a + b)
        if not a < s < b:
            s = 0.5 * (a + b)
        _ahead(start, s, direction, guess)
        _copied(guess, point)
        _newton(kkt, n, m, h, hidden, t, held, guess, direction, np.int64(8), point, work, d)
        determinant = _tangent_at(d, point, held, n, m, h, t, direction, tangent)
        _signs(d, point, tangent, orientation * determinant, held, low, high, rising, n, m, h, t, found)
        if abs(found[k]) <= 1e-15 or b - a <= 1e-15:
            break
        if found[k] > 0.0:
            a, fa = s, found[k]
            fb, side = (0.5 * fb, 1) if side == 1 else (fb, 1)
        else:
            b, fb = s, found[k]
            fa, side = (0.5 * fa, -1) if side == -1 else (fa, -1)
    return s


@compiled(error_model="numpy")
def _record(points, tangents, sets, events, count, point, tangent, held, kind, index):
    """Write a node and return the count."""
    _copied(point, points[count])
    _copied(tangent, tangents[count])
    _copied(held, sets[count])
    events[count, 0], events[count, 1] = kind, index
    return count + 1


@compiled(inline="always")
def _advanced(old, point, along):
    """Return the length from one point to another along a direction."""
    total = 0.0
    for k in range(along.size):
        total += (point[k] - old[k]) * along[k]
    return total


@compiled(error_model="numpy")
def follow(kkt, n, m, h, hidden, t, first, first_held, rising, low, high, points, tangents, sets, events):
    """Follow the branch through `first` in the direction of rising (1) or falling (-1) hidden state.

    Fills `points`, `tangents` (k, n + m + 2), `sets` (k, n + m), `events` (k, 2) of kind and index; a change
    of the set gives a node per set. Returns the number of nodes; the last event ends the branch.
    """
    size = n + m + 2
    work, d = np.empty(work_size(kkt)), np.empty(_sizes(kkt, n, m, h))
    point, tangent, held = first.copy(), np.zeros(size), first_held.copy()
    old, along, guess = np.empty(size), np.zeros(size), np.empty(size)
    old_signs, found, ahead = np.empty(2 * n + m + 5), np.empty(2 * n + m + 5), np.empty(2 * n + m + 5)
    along[size - 1] = rising
    _evaluate(kkt, n, h, point, hidden, t, work, d)
    determinant = _tangent_at(d, point, held, n, m, h, t, along, tangent)
    orientation = 1.0 if determinant > 0.0 else -1.0
    _signs(d, point, tangent, orientation * determinant, held, low, high, rising, n, m, h, t, old_signs)
    count = _record(points, tangents, sets, events, _FIRST, point, tangent, held, _NOTHING, _FIRST)
    step, suspected = 0.02, LOST
    while count < points.shape[0] - 2:
        _copied(point, old)
        _copied(tangent, along)
        _ahead(old, step, along, guess)
        _copied(guess, point)
        taken, left = _newton(kkt, n, m, h, hidden, t, held, guess, along, np.int64(STEPS), point, work, d)
        if left <= GOOD:
            determinant = _tangent_at(d, point, held, n, m, h, t, along, tangent)
        if (
            left > GOOD
            or determinant == 0.0
            or _dot(tangent, along) < COSINE
            or _farthest(point, guess) > step
        ):
            step *= 0.4
            _copied(old, point)
            _copied(along, tangent)
            if step < SHORTEST:
                return _record(
                    points, tangents, sets, events, count, point, tangent, held, np.int64(suspected), _FIRST
                )
            continue
        _signs(d, point, tangent, orientation * determinant, held, low, high, rising, n, m, h, t, found)
        failed, earliest, span = -1, np.inf, _advanced(old, point, along)
        for k in range(found.size):
            if found[k] < -SLACKEN * (1.0 if k < found.size - 1 else 0.0):
                if old_signs[k] <= 0.0:
                    where = 0.0
                else:
                    where = _locate(
                        kkt, n, m, h, hidden, t, held, low, high, rising, orientation, old, along, k, old_signs[k], found[k],
                        span, guess, tangent, work, d, ahead,
                    )  # fmt: skip
                if where < earliest:
                    failed, earliest = k, where
        if failed < 0:
            _copied(found, old_signs)
            count = _record(points, tangents, sets, events, count, point, tangent, held, _NOTHING, _FIRST)
            step = min(LONGEST, step * (2.0 if taken <= 3 else 1.2))
            continue
        _ahead(old, earliest, along, guess)
        _copied(guess, point)
        left = _newton(kkt, n, m, h, hidden, t, held, guess, along, np.int64(8), point, work, d)[1]
        determinant = _tangent_at(d, point, held, n, m, h, t, along, tangent)
        kind, index = _event_of(failed, held, n, m)
        if left > GOOD or _farthest(point, guess) > step or not _dot(tangent, along) >= COSINE:
            _copied(old, point)
            _copied(along, tangent)
            # Newton's method may reach another branch near a crossing; a smaller step does not
            if step > NEAREST:
                step *= 0.4
                suspected = kind if kind in (FOLD, BRANCH) else LOST
                continue
            _evaluate(kkt, n, h, point, hidden, t, work, d)
        if kind == FOLD and point[n] < 1e-6:
            kind = INFEASIBLE
        if kind == RANGE:  # exact: all branches end at one place
            point[size - 1] = low if failed == 2 * n + m else high
        count = _record(
            points, tangents, sets, events, count, point, tangent, held, np.int64(kind), np.int64(index)
        )
        if kind >= RANGE:
            return count
        was = held[index] if index < n else 0
        _switch(kind, index, held, n)
        bent, exchanged = _curvature(d, point, held, n, m), False
        if bent == -np.inf and kind in (LOW, HIGH, ADD):
            exchanged = _exchange(d, point, held, n + index if kind == ADD else index, n, m, h, t) >= 0
            if not exchanged:
                events[count - 1, 0] = INFEASIBLE
                return count
            bent = _curvature(d, point, held, n, m)
        if bent <= 0.0:
            events[count - 1, 0] = FOLD
            return count
        along[:] = 0.0
        along[size - 1] = rising
        determinant = _tangent_at(d, point, held, n, m, h, t, along, tangent)
        if determinant == 0.0 or (
            not exchanged and _away(kind, index, was, d, point, tangent, n, m, h, t) < 0.0
        ):
            events[count - 1, 0] = FOLD
            return count
        orientation = 1.0 if determinant > 0.0 else -1.0
        _signs(d, point, tangent, orientation * determinant, held, low, high, rising, n, m, h, t, old_signs)
        count = _record(points, tangents, sets, events, count, point, tangent, held, _NOTHING, _FIRST)
        step = 0.02
    return _record(points, tangents, sets, events, count, point, tangent, held, np.int64(FULL), _FIRST)


@compiled(error_model="numpy")
def settle_at(kkt, n, m, h, hidden, t, held, point, most):
    """Solve the conditions at the point's own hidden state, in place; return the residual."""
    work, d = np.empty(work_size(kkt)), np.empty(_sizes(kkt, n, m, h))
    anchor, row = point.copy(), np.zeros(point.size)
    row[point.size - 1] = 1.0
    return _newton(kkt, n, m, h, hidden, t, held, anchor, row, most, point, work, d)[1]


@compiled(error_model="numpy")
def reach(kkt, n, m, h, hidden, t, held, nodes, place, point):
    """Fill the point of a run at a place, from a linear guess; return the residual."""
    last = nodes.shape[1] - 1
    k = 1
    while k < nodes.shape[0] - 1 and nodes[k, last] < place:
        k += 1
    span = nodes[k, last] - nodes[k - 1, last]
    share = (place - nodes[k - 1, last]) / span if span > 0.0 else 0.0
    for i in range(last):
        point[i] = nodes[k - 1, i] + share * (nodes[k, i] - nodes[k - 1, i])
    point[last] = place
    return settle_at(kkt, n, m, h, hidden, t, held, point, np.int64(12))


@compiled(error_model="numpy")
def between(left, right, along_left, along_right, place, point):
    """Fill the point at a place of the cubic between two nodes; return the distance of the nodes."""
    last = left.size - 1
    total = 0.0
    for k in range(left.size):
        total += (right[k] - left[k]) ** 2
    span, low, high = np.sqrt(total), 0.0, 1.0
    for _ in range(54):
        u = 0.5 * (low + high)
        a, b, c, e = (
            (1 + 2 * u) * (1 - u) ** 2,
            u * (1 - u) ** 2 * span,
            u * u * (3 - 2 * u),
            u * u * (u - 1) * span,
        )
        if a * left[last] + b * along_left[last] + c * right[last] + e * along_right[last] < place:
            low = u
        else:
            high = u
    for k in range(last):
        point[k] = a * left[k] + b * along_left[k] + c * right[k] + e * along_right[k]
    point[last] = place
    return span


@compiled(error_model="numpy")
def tangent_of(kkt, n, m, h, hidden, t, held, point, along, tangent):
    """Fill the unit tangent at a point of the curve, on the side of `along`."""
    work, d = np.empty(work_size(kkt)), np.empty(_sizes(kkt, n, m, h))
    _evaluate(kkt, n, h, point, hidden, t, work, d)
    _tangent_at(d, point, held, n, m, h, t, along, tangent)
