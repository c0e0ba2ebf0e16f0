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
def act(table, switch, row, mode, shape, index, out):
    """Action at every point: interpolated inside one move; where a cell's corners differ, that of the right side.

    `table` = (best, move, entry, control, gap)[row, mode, node]. On one axis `switch[row, mode, cell]` says at which part of
    the cell the actions change places; on more, the corner of the greatest weight decides. Beside a node where one stops,
    the control is interpolated to what that node would do if it went on.
    """
    best, move, entry, control, gap = table
    out_best, out_entry, out_control, out_gap = out
    low = np.empty(shape.size, dtype=np.int64)
    for point in range(out_best.size):
        _lowest(shape, index, point, low)
        r, m = row[point], mode[point]
        same, alike, heaviest, at, first = True, True, -1.0, 0, -1
        u, g = 0.0, 0.0
        for corner in range(1 << shape.size):
            node, weight = _cell(shape, index, point, corner, low)
            if weight <= 0.0:
                continue
            if first < 0:
                first = node
            alike = alike and move[r, m, node] == move[r, m, first] and entry[r, m, node] == entry[r, m, first]
            same = same and best[r, m, node] == best[r, m, first] and entry[r, m, node] == entry[r, m, first]
            if weight > heaviest:
                heaviest, at = weight, node
            u += weight * control[r, m, node]
            g += weight * gap[r, m, node]
        if not same and shape.size == 1 and switch.size > 0:
            at = low[0] + (1 if index[0, point] - low[0] > switch[r, m, low[0]] else 0)
        out_best[point], out_entry[point], out_gap[point] = best[r, m, at], entry[r, m, at], g
        out_control[point] = u if alike else control[r, m, at]
