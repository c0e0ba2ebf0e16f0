"""Distance from a border in the metric of a surface, grad d . M^-1 . grad d = 1, on a grid by sweeps.

A node takes its distance through one of eight triangles around it. An obtuse triangle would need a node that
is farther from the border than the one in question, and distances would come too long whatever the grid. So
where steps of the grid span one, two shorter ones take their place: those of the lattice, reduced by Gauss.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# Around a node in two steps, in order: each with the next spans one of eight triangles.
_NEIGHBOURS = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)])
_STEPS = _NEIGHBOURS.astype(float)  # derived: numbers that need no conversion
_GRID = (1, 0, 0, 1)  # derived: steps of the grid itself, in nodes


@compiled
def sweep(E, F, G, d, most):
    """First order, into `d` (n, m), finite where given: sweeps from all four corners until convergence.

    E, F, G (n, m): metric for steps of the grid. Returns the number of rounds; `most` + 1: not converged.
    """
    n, m = d.shape
    changed = np.empty((n, m), np.int64)  # sweep in which a node last changed
    due = np.zeros((n, m), np.bool_)  # a neighbour on the grid has changed since
    least, skewed = _begun(E, F, G, d, changed, due)
    # Of the two nodes of a shorter step's triangle one may lie in an earlier row and one in a later one: no
    # sweep by rows visits both before the node between. One by columns does, where they are both to one side.
    orders = 8 if skewed else 4
    for rounds in range(1, most + 1):
        change = 0.0
        for order in range(orders):
            number = orders * (rounds - 1) + order + 1
            for first in range(n if order < 4 else m):
                for second in range(m if order < 4 else n):
                    i, j = _visited(first, second, n, m, order)
                    if not due[i, j] and _settled(E[i, j], F[i, j], G[i, j], changed, i, j, number - 1):
                        continue
                    due[i, j] = False
                    found = _least(E[i, j], F[i, j], G[i, j], d, i, j)[0]
                    if found < d[i, j]:
                        change = max(change, d[i, j] - found)
                        d[i, j], changed[i, j] = found, number
                        _call(due, i, j)
        if change <= least:
            return rounds
    return most + 1


@compiled
def _begun(E, F, G, d, changed, due):
    """Fill `changed` and `due` for the first sweep; return what change is none, whether steps are skewed."""
    along, across, skewed = 0.0, 0.0, False
    for i in range(d.shape[0]):
        for j in range(d.shape[1]):
            along, across = max(along, E[i, j]), max(across, G[i, j])
            skewed |= abs(F[i, j]) > min(E[i, j], G[i, j])
            changed[i, j] = 0 if d[i, j] < np.inf else -1
            if changed[i, j] == 0:
                _call(due, i, j)
    return 1e-9 * np.sqrt(min(along, across)), skewed


@compiled
def _visited(first, second, n, m, order):
    """Node of a sweep: by rows in orders 0 to 3, by columns in 4 to 7, each from another corner."""
    i, j = (first, second) if order < 4 else (second, first)
    return n - 1 - i if order & 1 else i, m - 1 - j if order & 2 else j


@compiled
def refine(E, F, G, d, known, order, fixed):
    """Second order: nodes of `d`, unless `fixed` (n m,), in `order` (n m,), from those of `known` (n, m).

    `known` is updated; where it starts with the fixed nodes alone, a node depends only on nodes before it.
    """
    for k in order:
        i, j = k // d.shape[1], k % d.shape[1]
        found, triangle, edge, metric, steps = _least(E[i, j], F[i, j], G[i, j], known, i, j)
        if found < np.inf and not fixed[k]:
            d[i, j] = _second(*metric, steps, known, i, j, found, triangle, edge)
        known[i, j] = d[i, j]


@compiled
def _call(due, i, j):
    """Mark the neighbours on the grid of a node that has changed."""
    for p in range(max(i - 1, 0), min(i + 2, due.shape[0])):
        for q in range(max(j - 1, 0), min(j + 2, due.shape[1])):
            due[p, q] |= p != i or q != j


@compiled
def _settled(e, f, g, changed, i, j, since):
    """Whether no node has changed `since` that shorter steps lead to, where those of the grid span an obtuse
    triangle.
    """
    if abs(f) <= min(e, g):
        return True
    steps = _acute(e, f, g)[1]
    for k in range(8):
        p, q = _node(steps, i, j, k, 1)
        if 0 <= p < changed.shape[0] and 0 <= q < changed.shape[1] and changed[p, q] >= since:
            return False
    return True


@compiled
def _least(e, f, g, d, i, j):
    """Least distance of a node, first order, with the triangle, whether an edge, their metric and steps.

    Near the border of the grid, where some of the shorter steps leave it, those of the grid are tried, too.
    """
    metric, steps = _acute(e, f, g)
    best, triangle, edge = _first(*metric, steps, d, i, j)
    a, b = abs(steps[0]) + abs(steps[2]), abs(steps[1]) + abs(steps[3])
    if (a > 1 or b > 1) and not (a <= i < d.shape[0] - a and b <= j < d.shape[1] - b):
        grid = _acute(1.0, 0.0, 1.0)[1]
        found, other, line = _first(e, f, g, grid, d, i, j)
        if found < best:
            return found, other, line, (e, f, g), grid
    return best, triangle, edge, metric, steps


@compiled
def _acute(e, f, g):
    """Metric for two steps that span no obtuse triangle around a node, and the steps (p0, p1, q0, q1)."""
    p0, p1, q0, q1 = _GRID
    while abs(f) > min(e, g):
        if e < g:
            times = round(f / e)
            q0, q1 = q0 - times * p0, q1 - times * p1
            g += times * (times * e - 2.0 * f)
            f -= times * e
        else:
            times = round(f / g)
            p0, p1 = p0 - times * q0, p1 - times * q1
            e += times * (times * g - 2.0 * f)
            f -= times * g
    return (e, f, g), (p0, p1, q0, q1)


@compiled
def _first(e, f, g, steps, d, i, j):
    """Least distance of a node through triangles or edges, first order; the triangle; whether an edge."""
    best, triangle, edge = np.inf, 0, False
    acute = abs(f) <= min(e, g)
    first = _at(d, steps, i, j, 0, 1)
    other = first
    for k in range(8):
        near, other = other, _at(d, steps, i, j, k + 1, 1) if k < 7 else first
        if near < best:
            a0, a1 = _STEPS[k]
            found = near + np.sqrt(e * a0 * a0 + 2.0 * f * a0 * a1 + g * a1 * a1)
            if found < best:
                best, triangle, edge = found, k, True
        farther = max(near, other)
        # no distance through an acute triangle is less than those of its nodes
        if farther < np.inf and not (acute and farther > best):
            found = _through(e, f, g, k, 1.0, near, 1.0, other)
            if found <= best:
                best, triangle, edge = found, k, False
    return best, triangle, edge


@compiled
def _second(e, f, g, steps, d, i, j, first, k, edge):
    """Distance through the best triangle or edge, second order where the neighbours behind allow it."""
    wa, ra = _behind(e, f, g, steps, d, i, j, k)
    if edge:
        a0, a1 = _STEPS[k]
        found = (np.sqrt(e * a0 * a0 + 2.0 * f * a0 * a1 + g * a1 * a1) + ra) / wa
    else:
        wb, rb = _behind(e, f, g, steps, d, i, j, (k + 1) & 7)
        found = _through(e, f, g, k, wa, ra, wb, rb)
    return found if found < np.inf else first


@compiled
def _behind(e, f, g, steps, d, i, j, k):
    """Weight w and rest r of the slope w d - r from a neighbour: three nodes where d2 fits, else two."""
    near, far = _at(d, steps, i, j, k, 1), _at(d, steps, i, j, k, 2)
    a0, a1 = _STEPS[k]
    rise = near - far
    if 0.0 <= rise <= 3.0 * np.sqrt(e * a0 * a0 + 2.0 * f * a0 * a1 + g * a1 * a1):
        return 1.5, 2.0 * near - 0.5 * far
    return 1.0, near


@compiled
def _at(d, steps, i, j, k, times):
    """Distance of the node `times` in direction k; inf: none, or unknown."""
    p, q = _node(steps, i, j, k, times)
    return d[p, q] if 0 <= p < d.shape[0] and 0 <= q < d.shape[1] else np.inf


@compiled
def _node(steps, i, j, k, times):
    """Node `times` in direction k."""
    a, b = times * _NEIGHBOURS[k, 0], times * _NEIGHBOURS[k, 1]
    return i + a * steps[0] + b * steps[2], j + a * steps[1] + b * steps[3]


@compiled
def _through(e, f, g, k, wa, ra, wb, rb):
    """Distance d whose slopes towards two neighbours fit a unit gradient from between them; else inf.

    With the steps x_a, x_b towards the node and slopes s = w d - r, the gradient p has p.x = s and p.M^-1.p =
    s.N^-1.s = 1, with N the products of the steps in the metric. N^-1 s are the components of the direction
    in the steps.
    """
    a0, a1 = _STEPS[k]
    b0, b1 = _STEPS[(k + 1) & 7]
    aa = e * a0 * a0 + 2.0 * f * a0 * a1 + g * a1 * a1
    ab = e * a0 * b0 + f * (a0 * b1 + a1 * b0) + g * a1 * b1
    bb = e * b0 * b0 + 2.0 * f * b0 * b1 + g * b1 * b1
    det = aa * bb - ab * ab
    if det <= 1e-14 * aa * bb:
        return np.inf  # at a pole
    square = bb * wa * wa - 2.0 * ab * wa * wb + aa * wb * wb
    mixed = bb * wa * ra - ab * (wa * rb + wb * ra) + aa * wb * rb
    rest = bb * ra * ra - 2.0 * ab * ra * rb + aa * rb * rb - det
    inside = mixed * mixed - square * rest
    if inside < 0.0:
        return np.inf
    found = (mixed + np.sqrt(inside)) / square
    sa, sb = wa * found - ra, wb * found - rb
    if bb * sa - ab * sb < 0.0 or aa * sb - ab * sa < 0.0:
        return np.inf
    return found
