"""Compiled look-ups in policy tables [row, mode, node], multilinear in any number of axes."""

from typing import Any

import numpy as np
from numba import njit

_OPTIONS: Any = {"cache": True, "nogil": True}


@njit(inline="always", **_OPTIONS)
def _cell(shape, index, point, corner, low):
    """Flat node and weight of a corner (bits of `corner`) of the cell around index[:, point]; `low` is its lowest node."""
    node, weight = 0, 1.0
    for axis in range(shape.size):
        part = min(max(index[axis, point] - low[axis], 0.0), 1.0)
        up = (corner >> axis) & 1
        node = node * shape[axis] + low[axis] + up
        weight *= part if up else 1.0 - part
    return node, weight


@njit(inline="always", **_OPTIONS)
def _lowest(shape, index, point, low):
    for axis in range(shape.size):
        low[axis] = max(0, min(int(np.floor(index[axis, point])), shape[axis] - 2))


@njit(**_OPTIONS)
def interpolate(table, row, mode, shape, index, out):
    """out[p] = table interpolated at index[:, p] (cells) in slice (row[p], mode[p])."""
    low = np.empty(shape.size, dtype=np.int64)
    for point in range(out.size):
        _lowest(shape, index, point, low)
        total = 0.0
        for corner in range(1 << shape.size):
            node, weight = _cell(shape, index, point, corner, low)
            if weight > 0.0:
                total += weight * table[row[point], mode[point], node]
        out[point] = total


@njit(**_OPTIONS)
def below_kinks(table, switch, left, right, row, mode, index, out):
    """On one axis, set out[p] to the lesser of two lines where the actions change places inside a cell.

    Each line is what one node's action costs over the cell; its value at the other node is `left` (`right`) above the
    table's. Between nodes the minimum of the two has a kink that a straight line would cut.
    """
    for point in range(out.size):
        r, m = row[point], mode[point]
        cell = max(0, min(int(np.floor(index[0, point])), table.shape[2] - 2))
        if not np.isnan(switch[r, m, cell]):
            part = min(max(index[0, point] - cell, 0.0), 1.0)
            a, b = table[r, m, cell], table[r, m, cell + 1]
            first, second = a + part * (b + left[r, m, cell] - a), (1 - part) * (a + right[r, m, cell]) + part * b
            out[point] = min(first, second)


@njit(**_OPTIONS)
def act(table, switch, start, row, mode, shape, index, out):
    """Action at every point: interpolated inside one move; where a cell's corners differ, that of the right side.

    `table` = (best, entry, control, gap)[row, mode, node]. On one axis `switch[row, mode, cell]` says at which part of the
    cell the actions change places, and `start` what the control is at the end where one stops; on more, the corner of the
    greatest weight decides.
    """
    best, entry, control, gap = table
    out_best, out_entry, out_control, out_gap = out
    low = np.empty(shape.size, dtype=np.int64)
    for point in range(out_best.size):
        _lowest(shape, index, point, low)
        r, m = row[point], mode[point]
        same, heaviest, at, first = True, -1.0, 0, -1
        u, g = 0.0, 0.0
        for corner in range(1 << shape.size):
            node, weight = _cell(shape, index, point, corner, low)
            if weight <= 0.0:
                continue
            if first < 0:
                first = node
            same = same and best[r, m, node] == best[r, m, first] and entry[r, m, node] == entry[r, m, first]
            if weight > heaviest:
                heaviest, at = weight, node
            u += weight * control[r, m, node]
            g += weight * gap[r, m, node]
        if shape.size == 1 and switch.size > 0 and not np.isnan(switch[r, m, low[0]]):
            cell, part = low[0], min(max(index[0, point] - low[0], 0.0), 1.0)
            at = cell + (1 if part > switch[r, m, cell] else 0)
            u = control[r, m, at]
            if not np.isnan(start[r, m, cell]):  # towards the node where one stops
                near = part if at > cell else 1 - part
                u = near * u + (1 - near) * start[r, m, cell]
        elif not same:
            u = control[r, m, at]
        out_best[point], out_entry[point], out_control[point], out_gap[point] = best[r, m, at], entry[r, m, at], u, g
