"""Compiled kernels of the shift transition and of the backward step.

Symbols: `weight[group, row, k]` is the probability weight of moving down `first_lag + k` cells; `gone` the
probability of leaving the grid for a given value-to-go (into a stop: `stopped`); `above` the excess weight of
a full hat at the top node; `charge` the charges in the path and beyond the edges. `value[target, node]` is
the value-to-go, target = (mode, nodes of other axes). `rough[group, row]` marks narrow laws, whose
expectations have a kink at every node and are not interpolated.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import REORDER, compiled

UNFUSED = REORDER - {"contract"}  # chosen: sums corrected term by term round each product before subtraction
TIE_ABS, TIE_REL = 1e-9, 1e-7  # chosen: cost difference of a tie, $ and relative; smaller ones are rounding
# measured: error of the cubic was 0.01 to 0.74 of its difference from the parabola. Of 200 random problems of
# shifts with few levels the error of the plan was above the largest estimate in 69, up to 2.5 times; with 2.2
# it was in 4, up to 1.2 times, and the plans of P1 and P4 to 1e-5 $ took 1.5 and 1.8 times as long
CUBIC = 0.8
UNSEEN = 0.5  # chosen: share of a level's depth below its neighbours that a kink may hide; less misses some
# derived: a kink half-way between two levels changes the bend by half its own, K/2, and lies 3/16 K h below
# the parabola: 3/8 of the change; h is the step of the levels. measured: 1.8 to 5.8 times the error in 100
# random problems of sampled moves
KINK = 0.4


@compiled(fastmath=REORDER)
def weigh(curve, end, first, h, weight, reach):
    """Fill weight[group, row, k], of lags from `first` on, from the second differences of curve at them.

    Lags beyond end[group, row, 0] weigh nothing. `reach` gets the first and last lag of a weight, if any.
    """
    for group in range(weight.shape[0]):
        for row in range(weight.shape[1]):
            line, out = curve[group, row], weight[group, row]
            count = int(min(max(np.floor(end[group, row, 0] / h) + 1.0 - first, 0.0), float(out.size)))
            for k in range(count):
                out[k] = (line[k + 2] - 2.0 * line[k + 1] + line[k]) / h
            begin = 0
            while begin < count and out[begin] == 0.0:
                begin += 1
            while count > begin and out[count - 1] == 0.0:
                count -= 1
            if begin < count:
                reach[group, row, 0], reach[group, row, 1] = first + begin, first + count - 1


@compiled(fastmath=REORDER, forceinline=True)
def _expect(group, row, node, tables, value, flipped, level):
    """E value(next) + charges of one row at one node; `flipped`: value from the top down, 0 at node 0."""
    weight, first_lag, reach, gone, stopped, above, charge, target, part, _ = tables
    nodes = value.shape[1]
    begin = max(reach[group, row, 0], node - (nodes - 1))  # lags to the targets 1..nodes-1
    count = max(0, min(reach[group, row, 1], node - 1) + 1 - begin)
    shift = nodes - 1 - node + begin
    a = weight[group, row, begin - first_lag : begin - first_lag + count]
    total = 0.0
    for corner in range(target.shape[2]):
        share = part[group, row, corner]
        if share == 0.0:
            continue
        to = target[group, row, corner]
        bottom, inner = value[to, 0], 0.0
        b = flipped[to, shift : shift + count]  # slices from 0 on vectorise
        for k in range(count):
            inner += a[k] * b[k]
        if above.shape[2] > 0:
            inner -= above[group, row, node] * (value[to, nodes - 1] - bottom)
        total += share * (inner + bottom)
        if gone.shape[2] > 0 and bottom != 0.0:
            total -= share * bottom * gone[group, row, node]
        if stopped.shape[2] > 0 and level[to] != bottom:
            total += share * (level[to] - bottom) * stopped[group, row, node]
    return total + charge[group, row, node]


@compiled(fastmath=UNFUSED)
def _scan(group, rows, tables, value, flipped, level, dense, use_dense, out):
    """Fill out[k, node] = E of the coarse rows; with `use_dense`, `dense[k, node]` holds their inner sums."""
    _, _, _, gone, stopped, above, charge, target, _, _ = tables
    nodes = value.shape[1]
    for k in range(rows.size):
        row = rows[k]
        if not use_dense:
            for node in range(nodes):
                out[k, node] = _expect(group, row, node, tables, value, flipped, level)
            continue
        to = target[group, row, 0]
        bottom = value[to, 0]
        for node in range(nodes):
            out[k, node] = dense[k, node] + charge[group, row, node] + bottom
        if gone.shape[2] > 0 and bottom != 0.0:
            for node in range(nodes):
                out[k, node] -= bottom * gone[group, row, node]
        if stopped.shape[2] > 0 and level[to] != bottom:
            further = level[to] - bottom
            for node in range(nodes):
                out[k, node] += further * stopped[group, row, node]
        if above.shape[2] > 0:
            rise = value[to, nodes - 1] - bottom
            for node in range(nodes):
                out[k, node] -= rise * above[group, row, node]


@compiled(fastmath=REORDER)
def _tie(value):
    return TIE_ABS + TIE_REL * abs(value)


@compiled(fastmath=REORDER)
def _vertex(levels, a, qa, qb, qc, e, qe):
    """Minimum of the cubic through the levels a, a + 1, a + 2 (the middle one the lowest) and e.

    Return control, value, and its estimated error: a share of the difference between cubic and parabola
    through the first three. Without a fourth level (`qe` not finite), or a minimum of the cubic, the parabola
    serves; its whole gain over the best level counts as error.
    """
    xa, xb, xc = levels[a], levels[a + 1], levels[a + 2]
    left, right = (qb - qa) / (xb - xa), (qc - qb) / (xc - xb)
    bend = (right - left) / (xc - xa)
    if not (bend > 0.0 and left <= 0.0 and right >= 0.0):
        return xb, qb, 0.0
    u = 0.5 * (xa + xb) - left / (2 * bend)
    flat = qa + left * (u - xa) + bend * (u - xa) * (u - xb)
    if not np.isfinite(qe):
        return u, flat, qb - flat
    xe = levels[e]
    twist = ((qe - qa - left * (xe - xa)) / ((xe - xa) * (xe - xb)) - bend) / (xe - xc)
    x = u
    for _ in range(3):
        slope = (
            left
            + bend * (2 * x - xa - xb)
            + twist * ((x - xa) * (x - xb) + (x - xa) * (x - xc) + (x - xb) * (x - xc))
        )
        curve = 2 * bend + 2 * twist * (3 * x - xa - xb - xc)
        if not curve > 0.0:
            return u, flat, qb - flat
        x = min(max(x - slope / curve, xa), xc)
    value = qa + left * (x - xa) + bend * (x - xa) * (x - xb) + twist * (x - xa) * (x - xb) * (x - xc)
    if abs(value - flat) > qb - flat:  # a kink, which no curve follows
        return xb, qb, qb - flat
    return x, value, CUBIC * abs(value - flat)


@compiled(fastmath=REORDER)
def _next(a, b, c, qa, qb, qc, halve):
    """Next level inside the bracket a < b < c: vertex of the parabola over the levels' numbers, or half."""
    if b - a <= 0 or (halve and c - b >= b - a):
        return b + 1 if b - a <= 0 else (b + c) // 2 if c - b > 1 else b - 1
    if c - b <= 0 or halve:
        return b - 1 if c - b <= 0 else (a + b + 1) // 2 if b - a > 1 else b + 1
    left, right = (qb - qa) / (b - a), (qc - qb) / (c - b)
    bend = (right - left) / (c - a)
    x = b
    if bend > 0.0 and bend < np.inf:
        x = int(np.rint(0.5 * (a + b) - left / (2.0 * bend)))
    if x == b:
        x = b + 1 if c - b > b - a else b - 1
    return min(max(x, a + 1), c - 1)


@compiled(fastmath=REORDER, forceinline=True)  # a call copies all tables' shapes, 0.1 us
def _descend(
    group, base, node, f, low, high, stride, q, before, after, tables, value, flipped, level, levels
):
    """Find the minimum around level `f` (value `q`, neighbours `before`, `after`) in the regime [low, high].

    A bracket a < b < c of levels closes until they are neighbours; at an end of the regime a or c equals b.
    Return control, value, and its estimated error.
    """
    a, b, c = max(f - stride, low), f, min(f + stride, high)
    qa, qb, qc = before, q, after
    tries = 0
    while b - a > 1 or c - b > 1:
        x = _next(a, b, c, qa, qb, qc, tries > 4)
        qx = _expect(group, base + x, node, tables, value, flipped, level)
        if qx < qb:
            if x < b:
                c, qc = b, qb
            else:
                a, qa = b, qb
            b, qb = x, qx
        elif x < b:
            a, qa = x, qx
        else:
            c, qc = x, qx
        tries += 1
    if a == b or c == b or not (np.isfinite(qa) and np.isfinite(qb) and np.isfinite(qc)):
        return levels[b], qb, 0.0
    e = c + 1 if c < high else a - 1
    qe = _expect(group, base + e, node, tables, value, flipped, level) if e >= low else np.inf
    u, best, wrong = _vertex(levels, a, qa, qb, qc, e, qe)
    if tables[9][group, base + b]:
        return levels[b], qb, UNSEEN * min(qa - qb, qc - qb)
    return u, best, wrong


@compiled(fastmath=REORDER)
def _lows(line, before, after):
    """First and last node at which `line` is lower than its neighbours; none: any with last < first."""
    first, last = line.size, -1
    for node in range(line.size):  # without a branch, so that it vectorises
        low = (line[node] < before[node]) & (line[node] <= after[node])
        first, last = min(first, node if low else line.size), max(last, node if low else -1)
    return first, last


@compiled(fastmath=REORDER)
def _search(
    group, base, levels, regimes, stride, refine, coarse_q, tables, value, flipped, level, out, state
):
    """Best row of one move at every node, from every local minimum of the scan in every regime.

    `out`: (least value, control, entry of the lists) by node. `state`: [largest estimated error so far]. Ties
    go to the lowest control. Loops run along the nodes, as memory does.
    """
    out_q, out_u, out_a = out
    count, nodes = levels.size, value.shape[1]
    scanned = (count - 1) // stride + 1
    best, none = np.empty(nodes), np.empty(nodes)
    best[:], none[:], out_q[:], out_u[:], out_a[:] = np.inf, np.inf, np.inf, levels[0], 0
    for k in range(coarse_q.shape[0]):
        for node in range(nodes):
            out_q[node] = min(out_q[node], coarse_q[k, node])
    for a in range(coarse_q.shape[0] // scanned):
        for regime in range(regimes.size - 1):
            low, high = regimes[regime], regimes[regime + 1]
            begin, end = a * scanned + low // stride, a * scanned + high // stride
            for k in range(begin, end + 1):
                line = coarse_q[k]
                before = coarse_q[k - 1] if k > begin else none
                after = coarse_q[k + 1] if k < end else none
                f = (k - a * scanned) * stride
                first, last = _lows(line, before, after)
                for node in range(first, last + 1):
                    q = line[node]
                    if not (q < before[node] and q <= after[node]):
                        continue
                    u, wrong = levels[f], 0.0
                    if refine and high > low and _promising(q, before[node], after[node], out_q[node]):
                        u, q, wrong = _descend(
                            group, base + a * count, node, f, low, high, stride, q, before[node], after[node],
                            tables, value, flipped, level, levels,
                        )  # fmt: skip
                    if q < best[node] - _tie(best[node]) or best[node] == np.inf:
                        best[node], out_u[node], out_a[node] = q, u, a
                        state[0] = max(state[0], wrong)
                    out_q[node] = min(out_q[node], q)


@compiled(fastmath=REORDER)
def _first_least(q, levels, out):
    """Least row at every node, without search between levels; ties go to the first."""
    out_q, out_u, out_a = out
    count, nodes = levels.size, out_q.size
    out_q[:] = np.inf
    for row in range(q.shape[0]):
        line = q[row]
        for node in range(nodes):
            out_q[node] = min(out_q[node], line[node])
    limit, first = np.empty(nodes), np.empty(nodes)
    for node in range(nodes):
        limit[node], first[node] = out_q[node] + _tie(out_q[node]), 0.0
    for row in range(q.shape[0] - 1, -1, -1):
        line, number = q[row], float(row)
        for node in range(nodes):
            first[node] = number if line[node] <= limit[node] else first[node]
    for node in range(nodes):
        row = int(first[node])
        out_u[node], out_a[node] = levels[row % count], row // count


@compiled(fastmath=REORDER)
def push(begin, end, plan, tables, value, flipped, level, dense, use_dense, complete, coarse_q, found, state):
    """Fill `found` = (least expectation, control, entry)[move, group, node], moves begin to end of a bundle.

    `dense` holds the inner sums of the scanned rows (`use_dense`), or their expectations (`complete`).
    `plan`: row, level, regime and scan offsets of each move, levels, regimes, strides, refinement, scan rows.
    """
    out_q, out_u, out_a = found
    row_at, level_at, regime_at, scan_at, levels, regimes, strides, refine, rows = plan
    for move in range(begin, end):
        scanned, own = rows[scan_at[move] : scan_at[move + 1]], levels[level_at[move] : level_at[move + 1]]
        sums = dense[scan_at[move] : scan_at[move + 1]]
        part = sums if complete else coarse_q[: scanned.size]
        for group in range(out_q.shape[1]):
            out = (out_q[move, group], out_u[move, group], out_a[move, group])
            if not complete:
                _scan(group, scanned, tables, value, flipped, level, sums, use_dense, part)
            if not refine[move] and strides[move] == 1:
                _first_least(part, own, out)
            else:
                _search(
                    group, row_at[move], own, regimes[regime_at[move] : regime_at[move + 1]],
                    strides[move], refine[move],
                    part, tables, value, flipped, level, out, state,
                )  # fmt: skip


@compiled(fastmath=REORDER)
def _promising(q, before, after, minimum):
    """Whether a scanned level may have less than `minimum` near it: twice the depth that convexity allows."""
    hidden = 0.0
    if before < np.inf:
        hidden = max(hidden, before - q)
    if after < np.inf:
        hidden = max(hidden, after - q)
    return q - 2.0 * hidden < minimum


@compiled(fastmath=REORDER)
def _uneven(q, k, begin, end, node):
    """Largest change of the second difference of q from row k to the next one on either side."""
    bend, largest = q[k - 1, node] - 2.0 * q[k, node] + q[k + 1, node], 0.0
    if k + 2 <= end and q[k + 2, node] < np.inf:
        largest = abs(q[k, node] - 2.0 * q[k + 1, node] + q[k + 2, node] - bend)
    if k - 2 >= begin and q[k - 2, node] < np.inf:
        largest = max(largest, abs(q[k, node] - 2.0 * q[k - 1, node] + q[k - 2, node] - bend))
    return largest


@compiled(fastmath=REORDER)
def least(q, levels, regimes, refine, out_q, out_u, out_a, state):
    """Best row at every node of known q[row, node]: the level, or the parabola through its neighbours."""
    count = levels.size
    for node in range(q.shape[1]):
        best, u_best, a_best, minimum = np.inf, levels[0], 0, np.inf
        for a in range(q.shape[0] // count):
            for regime in range(regimes.size - 1):
                begin, end = a * count + regimes[regime], a * count + regimes[regime + 1]
                for k in range(begin, end + 1):
                    value, u, wrong = q[k, node], levels[k - a * count], 0.0
                    if (
                        refine
                        and begin < k < end
                        and value < q[k - 1, node]
                        and value <= q[k + 1, node]
                        and q[k - 1, node] < np.inf
                        and q[k + 1, node] < np.inf
                    ):
                        e = k + 2 if k + 1 < end else k - 2
                        fourth = q[e, node] if begin <= e <= end else np.inf
                        first = k - 1 - a * count
                        u, value, wrong = _vertex(
                            levels, first, q[k - 1, node], value, q[k + 1, node], e - a * count, fourth
                        )
                        wrong = max(wrong, KINK * _uneven(q, k, begin, end, node))
                    if value < best - _tie(best) or (best == np.inf and value < np.inf):
                        best, u_best, a_best = value, u, a
                        state[0] = max(state[0], wrong)
                    minimum = min(minimum, value)
        out_q[node], out_u[node], out_a[node] = minimum, u_best, a_best
