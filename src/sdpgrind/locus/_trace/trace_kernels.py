"""Follow a branch of optima by pseudo-arclength continuation through changes of the active set."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
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
from sdpgrind.locus._trace.row_kernels import _ahead, _copied, _dot, _farthest, _hermite

NONE, LOW, HIGH, RELEASE, DROP, ADD, RANGE, INFEASIBLE, FOLD, BRANCH, LOST, FULL = range(12)
"""Events at a node. Up to ADD the set changes; from RANGE on the branch ends."""
_NOTHING, _FIRST = np.int64(NONE), np.int64(0)  # literal integers would compile their callees a second time
# chosen: first, longest, shortest step of arclength; longer ones skip events, shorter ones are rounding
FIRST, LONGEST, SHORTEST = 0.02, 0.06, 1e-9
NEAREST = 1e-6  # chosen: step near a crossing of branches at which an inexact event is accepted
SLACKEN = 1e-10  # chosen: rounding of signs
COSINE = 0.966  # derived: of 15 degrees, largest angle between neighbouring tangents
STEPS = 5  # chosen: Newton steps of a corrector; slower convergence shortens the step


@compiled(error_model="numpy")
def _signs(model, limits, d, point, tangent, determinant, held, found):
    """Fill values that must stay >= 0: of controls, constraints, range, feasibility, fold, branch."""
    (_, n, m, h, _, t), (low, high, rising) = model, limits
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
    """Return the rate of the changed quantity along the tangent; negative: out of the feasible region."""
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


@compiled(error_model="numpy")
def _corrected(model, held, start, length, direction, most, guess, point, tangent, work, d):
    """Predict the point at a length along a direction, correct it by Newton's method, and fill its tangent.

    Returns the steps taken, the residual, and the determinant of the bordered Jacobian.
    """
    kkt, n, m, h, hidden, t = model
    _ahead(start, length, direction, guess)
    _copied(guess, point)
    taken, left = _newton(kkt, n, m, h, hidden, t, held, guess, direction, most, point, work, d)
    return taken, left, _tangent_at(d, point, held, n, m, h, t, direction, tangent)


@compiled(inline="always")
def _locate(
    model, limits, held, orientation, start, direction, k, left, right, span, point, tangent, work, d, found
):
    """Return the length at which sign k fails, by the Illinois rule."""
    a, b, fa, fb = 0.0, span, left, right
    s, side, guess = span, 0, np.empty(point.size)
    for _ in range(80):
        s = (a * fb - b * fa) / (fb - fa) if fb != fa else 0.5 * (a + b)
        if not a < s < b:
            s = 0.5 * (a + b)
        determinant = _corrected(
            model, held, start, s, direction, np.int64(8), guess, point, tangent, work, d
        )[2]
        _signs(model, limits, d, point, tangent, orientation * determinant, held, found)
        if abs(found[k]) <= 1e-15 or b - a <= 1e-15:
            break
        if found[k] > 0.0:
            a, fa = s, found[k]
            fb, side = (0.5 * fb, 1) if side == 1 else (fb, 1)
        else:
            b, fb = s, found[k]
            fa, side = (0.5 * fa, -1) if side == -1 else (fa, -1)
    return s


@compiled(inline="always")
def _first_failed(model, limits, held, orientation, old, along, signs, old_signs, point, tangent, work, d):
    """Return the sign that fails first between two points (-1: none), and the length there."""
    failed, earliest, span = -1, np.inf, _advanced(old, point, along)
    beyond, ahead = np.empty(point.size), np.empty(signs.size)
    for k in range(signs.size):
        if signs[k] < -SLACKEN * (1.0 if k < signs.size - 1 else 0.0):
            if old_signs[k] <= 0.0:
                where = 0.0
            else:
                where = _locate(
                    model, limits, held, orientation, old, along, k, old_signs[k], signs[k], span,
                    beyond, tangent, work, d, ahead,
                )  # fmt: skip
            if where < earliest:
                failed, earliest = k, where
    return failed, earliest


@compiled(error_model="numpy")
def _record(nodes, count, point, tangent, held, kind, index):
    """Write a node and return the count."""
    points, tangents, sets, events = nodes
    _copied(point, points[count])
    _copied(tangent, tangents[count])
    _copied(held, sets[count])
    events[count, 0], events[count, 1] = kind, index
    return count + 1


@compiled(inline="always")
def _begun(model, limits, nodes, count, determinant, d, point, tangent, held, signs):
    """Fill the signs at the first node of a run and write it; return the orientation and the count."""
    orientation = 1.0 if determinant > 0.0 else -1.0
    _signs(model, limits, d, point, tangent, orientation * determinant, held, signs)
    return orientation, _record(nodes, count, point, tangent, held, _NOTHING, _FIRST)


@compiled(inline="always")
def _met(model, held, failed, old, length, along, step, guess, point, tangent, work, d):
    """Go to the event of a failed sign at a length; return its kind, index, and whether it is on the branch.

    Elsewhere the point stays at `old`.
    """
    kkt, n, m, h, hidden, t = model
    left = _corrected(model, held, old, length, along, np.int64(8), guess, point, tangent, work, d)[1]
    kind, index = _event_of(failed, held, n, m)
    met = not (left > GOOD or _farthest(point, guess) > step) and _dot(tangent, along) >= COSINE
    if not met:
        _copied(old, point)
        _copied(along, tangent)
        _evaluate(kkt, n, h, point, hidden, t, work, d)
    return kind, index, met


@compiled(inline="always")
def _advanced(old, point, along):
    """Return the length from one point to another along a direction."""
    total = 0.0
    for k in range(along.size):
        total += (point[k] - old[k]) * along[k]
    return total


@compiled(inline="always")
def _exact(kind, failed, point, n, m, low, high):
    """Return the event, INFEASIBLE at a vanished weight of the cost; put a point exactly on the range."""
    if kind == FOLD and point[n] < 1e-6:
        return INFEASIBLE
    if kind == RANGE:  # all branches end at one place
        point[point.size - 1] = low if failed == 2 * n + m else high
    return kind


@compiled(inline="always")
def _passed(model, kind, index, d, point, held, along, rising, tangent):
    """Change the set by an event and turn the tangent.

    Returns the end of the branch (NONE: it continues) and the determinant of the bordered Jacobian.
    """
    _, n, m, h, _, t = model
    was = held[index] if index < n else 0
    _switch(kind, index, held, n)
    bent, exchanged = _curvature(d, point, held, n, m), False
    if bent == -np.inf and kind in (LOW, HIGH, ADD):
        exchanged = _exchange(d, point, held, n + index if kind == ADD else index, n, m, h, t) >= 0
        if not exchanged:
            return INFEASIBLE, 0.0
        bent = _curvature(d, point, held, n, m)
    if bent <= 0.0:
        return FOLD, 0.0
    along[:] = 0.0
    along[point.size - 1] = rising
    determinant = _tangent_at(d, point, held, n, m, h, t, along, tangent)
    turned = not exchanged and _away(kind, index, was, d, point, tangent, n, m, h, t) < 0.0
    return (FOLD if determinant == 0.0 or turned else NONE), determinant


@compiled(error_model="numpy")
def follow(kkt, n, m, h, hidden, t, first, first_held, rising, low, high, points, tangents, sets, events):
    """Follow the branch through `first` in the direction of rising (1) or falling (-1) hidden state.

    Fills `points`, `tangents` (k, n + m + 2), `sets` (k, n + m), `events` (k, 2) of kind and index; a change
    of the set gives a node per set. Returns the number of nodes; the last event ends the branch.
    """
    size, model, limits = n + m + 2, (kkt, n, m, h, hidden, t), (low, high, rising)
    nodes = (points, tangents, sets, events)
    work, d = np.empty(work_size(kkt)), np.empty(_sizes(n, m, h))
    point, tangent, held = first.copy(), np.zeros(size), first_held.copy()
    old, along, guess = np.empty(size), np.zeros(size), np.empty(size)
    signs, old_signs = np.empty(2 * n + m + 5), np.empty(2 * n + m + 5)
    along[size - 1] = rising
    _evaluate(kkt, n, h, point, hidden, t, work, d)
    determinant = _tangent_at(d, point, held, n, m, h, t, along, tangent)
    orientation, count = _begun(model, limits, nodes, _FIRST, determinant, d, point, tangent, held, old_signs)
    step, suspected = FIRST, LOST
    while count < points.shape[0] - 2:
        _copied(point, old)
        _copied(tangent, along)
        taken, left, determinant = _corrected(
            model, held, old, step, along, np.int64(STEPS), guess, point, tangent, work, d
        )
        leaps = left > GOOD or _farthest(point, guess) > step
        if leaps or determinant == 0.0 or _dot(tangent, along) < COSINE:
            step *= 0.4
            _copied(old, point)
            _copied(along, tangent)
            if step < SHORTEST:
                return _record(nodes, count, point, tangent, held, np.int64(suspected), _FIRST)
            continue
        _signs(model, limits, d, point, tangent, orientation * determinant, held, signs)
        failed, earliest = _first_failed(
            model, limits, held, orientation, old, along, signs, old_signs, point, tangent, work, d
        )
        if failed < 0:
            _copied(signs, old_signs)
            count = _record(nodes, count, point, tangent, held, _NOTHING, _FIRST)
            step = min(LONGEST, step * (2.0 if taken <= 3 else 1.2))
            continue
        kind, index, met = _met(
            model, held, failed, old, earliest, along, step, guess, point, tangent, work, d
        )
        if not met and step > NEAREST:  # near a crossing Newton's method may reach another branch
            step *= 0.4
            suspected = kind if kind in (FOLD, BRANCH) else LOST
            continue
        kind = _exact(kind, failed, point, n, m, low, high)
        count = _record(nodes, count, point, tangent, held, np.int64(kind), np.int64(index))
        if kind >= RANGE:
            return count
        end, determinant = _passed(model, kind, index, d, point, held, along, rising, tangent)
        if end != NONE:
            events[count - 1, 0] = end
            return count
        orientation, count = _begun(
            model, limits, nodes, count, determinant, d, point, tangent, held, old_signs
        )
        step = FIRST
    return _record(nodes, count, point, tangent, held, np.int64(FULL), _FIRST)


@compiled(error_model="numpy")
def settle_at(kkt, n, m, h, hidden, t, held, point, most):
    """Solve the conditions at the point's own hidden state, in place; return the residual."""
    work, d = np.empty(work_size(kkt)), np.empty(_sizes(n, m, h))
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
        a, b, c, e = _hermite(u, span)
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
    work, d = np.empty(work_size(kkt)), np.empty(_sizes(n, m, h))
    _evaluate(kkt, n, h, point, hidden, t, work, d)
    _tangent_at(d, point, held, n, m, h, t, along, tangent)
