"""Compiled look-ups in policy tables [row, mode, node], multilinear in any number of axes."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy", inline="always")  # measured: a look-up of many states takes a third
def _cell(shape, index, point, corner, low):
    """Flat node and weight of a corner (bits of `corner`) of a point's cell; `low` is its lowest node."""
    node, weight = 0, 1.0
    for axis in range(shape.size):
        part = min(max(index[axis, point] - low[axis], 0.0), 1.0)
        up = (corner >> axis) & 1
        node = node * shape[axis] + low[axis] + up
        weight *= part if up else 1.0 - part
    return node, weight


@compiled(error_model="numpy", inline="always")
def _lowest(shape, index, point, low):
    """Lowest node of a point's cell; an index is never NaN, which has no integer."""
    for axis in range(shape.size):
        low[axis] = max(0, min(int(np.floor(index[axis, point])), shape[axis] - 2))


@compiled(error_model="numpy", inline="always")
def _interpolated(table, row, mode, shape, index, point, low):
    """Table interpolated at one point in a slice."""
    _lowest(shape, index, point, low)
    total = 0.0
    for corner in range(1 << shape.size):
        node, weight = _cell(shape, index, point, corner, low)
        if weight > 0.0:
            total += weight * table[row, mode, node]
    return total


@compiled(error_model="numpy")
def interpolate(table, row, mode, shape, index, out):
    """out[p] = table interpolated at index[:, p] (cells) in slice (row[p], mode[p])."""
    low = np.empty(shape.size, dtype=np.int64)
    for point in range(out.size):
        out[point] = _interpolated(table, row[point], mode[point], shape, index, point, low)


@compiled(error_model="numpy")
def _crossing(at, row, mode, index, nodes):
    """Number of the kink cell around a point (-1: none), the cell, and the position in it."""
    cell = max(0, min(int(np.floor(index)), nodes - 2))
    part = min(max(index - cell, 0.0), 1.0)
    return at[row, mode, cell] if 0.0 < part < 1.0 else -1, cell, part


@compiled(error_model="numpy")
def _least(first, last, cost, part):
    """Index of the first of the lowest lines, and its height."""
    line, low = first, np.inf
    for k in range(first, last):
        here = (1 - part) * cost[k, 0] + part * cost[k, 1]
        if here < low:
            line, low = k, here
    return line, low


@compiled(error_model="numpy")
def _next_least(first, last, cost, act, part, chosen):
    """Height of the lowest line of actions other than `chosen`."""
    low = np.inf
    for k in range(first, last):
        if act[k] != chosen:
            low = min(low, (1 - part) * cost[k, 0] + part * cost[k, 1])
    return low


@compiled(error_model="numpy")
def least_move(kinks, row, mode, index, out):
    """Set out[p] to the number of the lowest line of a move in the cell of each point, -1: none."""
    at, start, cost, _, act, _ = kinks
    for point in range(out.size):
        number, _, part = _crossing(at, row[point], mode[point], index[0, point], at.shape[2] + 1)
        low, out[point] = np.inf, -1
        if number >= 0:
            for k in range(start[number], start[number + 1]):
                here = (1 - part) * cost[k, 0] + part * cost[k, 1]
                if act[k] >= 0 and here < low:
                    low, out[point] = here, k


@compiled(error_model="numpy")
def least_line(at, start, cost, row, mode, index, out):
    """Set out[p] to the least line of cost where the action changes inside a cell of the one axis."""
    for point in range(out.size):
        number, _, part = _crossing(at, row[point], mode[point], index[0, point], at.shape[2] + 1)
        if number >= 0:
            out[point] = _least(start[number], start[number + 1], cost, part)[1]


@compiled(error_model="numpy", inline="always")
def _act(table, kinks, row, mode, shape, index, point, low):
    """Move (stops < 0), entry, control and gap at one point; see `act`."""
    best, entry, control, gap = table
    at, start, cost, line_control, line_act, line_entry = kinks
    _lowest(shape, index, point, low)
    same, heaviest, chosen, first = True, -1.0, 0, -1
    u, g = 0.0, 0.0
    for corner in range(1 << shape.size):
        node, weight = _cell(shape, index, point, corner, low)
        if weight <= 0.0:
            continue
        if first < 0:
            first = node
        if (
            best[row, mode, node] != best[row, mode, first]
            or entry[row, mode, node] != entry[row, mode, first]
        ):
            same = False
        if weight > heaviest:
            heaviest, chosen = weight, node
        u += weight * control[row, mode, node]
        g += weight * gap[row, mode, node]
    move, listed = np.int64(best[row, mode, chosen]), np.int64(entry[row, mode, chosen])
    u = u if same else control[row, mode, chosen]
    if shape.size == 1 and at.shape[2] > 0:
        number, _, part = _crossing(at, row, mode, index[0, point], shape[0])
        if number >= 0:
            k, height = _least(start[number], start[number + 1], cost, part)
            other = _next_least(start[number], start[number + 1], cost, line_act, part, line_act[k])
            g = other - height if other < np.inf else g
            move, listed = np.int64(line_act[k]), np.int64(line_entry[k])
            u = (1 - part) * line_control[k, 0] + part * line_control[k, 1]
    return move, listed, u, g


@compiled(error_model="numpy")
def _act_each(table, kinks, row, mode, shape, index, out, low):
    out_best, out_entry, out_control, out_gap = out
    for point in range(out_best.size):
        move, listed, u, g = _act(table, kinks, row[point], mode[point], shape, index, point, low)
        out_best[point], out_entry[point], out_control[point], out_gap[point] = move, listed, u, g


@compiled(error_model="numpy")
def act(table, kinks, row, mode, shape, index, out):
    """Action at every point: interpolated within one move, else that of the least line.

    `table` = (best, entry, control, gap)[row, mode, node]. Without lines (several axes) the corner of the
    greatest weight decides.
    """
    # room is made here: a kernel that makes none counts no references
    _act_each(table, kinks, row, mode, shape, index, out, np.empty(shape.size, np.int64))
