"""Compiled kernels of the backward step: the best of stops and moves, and a whole small problem in one call.

Symbols as in `kernels`.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import REORDER, compiled
from sdpgrind.sdp._solve.kernels import _tie, push


@compiled(fastmath=REORDER)
def choose(stop_q, found, shared, out):
    """One backward step: value[mode, node] = min over stops and moves; return whether all are finite.

    Ties go to stops, then to the first move. `stop_q[stop, mode, node]`; `found` = (value, control,
    entry)[move, mode, node], mode 0 for all modes where `shared[move]`; `out` = (value, best, move, control,
    entry, gap)[mode, node], where `best` counts stops as -1, -2, ... and moves as 0, 1, ..., and `move` is
    the best of the moves (-1: none), also where a stop is better.
    """
    move_q, move_u, move_a = found
    value, best, move, control, entry, gap = out
    stops, moves, finite = stop_q.shape[0], move_q.shape[0], True
    for mode in range(value.shape[0]):
        for node in range(value.shape[1]):
            low, low_move = np.inf, np.inf
            for k in range(stops):
                low = min(low, stop_q[k, mode, node])
            for k in range(moves):
                low_move = min(low_move, move_q[k, 0 if shared[k] else mode, node])
            low = min(low, low_move)
            chosen, second, going = -stops - 1, np.inf, -1
            for k in range(stops):
                q = stop_q[k, mode, node]
                if chosen == -stops - 1 and q <= low + _tie(low) and q < np.inf:
                    chosen = -1 - k
                else:
                    second = min(second, q)
            for k in range(moves):
                q = move_q[k, 0 if shared[k] else mode, node]
                if going < 0 and q <= low_move + _tie(low_move) and q < np.inf:
                    going = k
                if chosen == -stops - 1 and going == k and q <= low + _tie(low):
                    chosen = k
                else:
                    second = min(second, q)
            value[mode, node], best[mode, node], gap[mode, node] = low, chosen, second - low
            finite = finite and np.isfinite(low)
            move[mode, node], control[mode, node], entry[mode, node] = going, np.nan, 0
            if going >= 0:
                control[mode, node] = move_u[going, 0 if shared[going] else mode, node]
                entry[mode, node] = move_a[going, 0 if shared[going] else mode, node]
    return finite


@compiled(fastmath=REORDER)
def _complete(sums, low, high, scan_tables, bottom, top, level):
    """Turn inner sums of the scanned rows low to high into expectations, as `_scan` does row by row."""
    charge, gone, stopped, above = scan_tables
    for row in range(low, high):
        for node in range(sums.shape[1]):
            sums[row, node] += charge[row, node] + bottom
        if gone.shape[1] > 0 and bottom != 0.0:
            for node in range(sums.shape[1]):
                sums[row, node] -= bottom * gone[row, node]
        if stopped.shape[1] > 0 and level != bottom:
            for node in range(sums.shape[1]):
                sums[row, node] += (level - bottom) * stopped[row, node]
        if above.shape[1] > 0:
            for node in range(sums.shape[1]):
                sums[row, node] -= (top - bottom) * above[row, node]


@compiled(fastmath=REORDER)
def _wanted(duration, left):
    """First and last (exclusive) of the moves that begin within the `left` remaining rows; none: 0, 0."""
    begin, end = 0, 0
    for move in range(duration.size - 1, -1, -1):
        if duration[move] < left:
            begin, end = move, max(end, move + 1)
    return begin, end


@compiled(fastmath=REORDER)
def sweep(
    late, duration, stop_q, level, base, ring, scan_weight, scan_tables, plan, tables, shared, table, state
):
    """Whole backward induction on one axis and one mode, as in `stages`.

    `ring[row, move, 0, node]` keeps all costs; `late[k]` is the late charge at the stage ``first + k`` less
    the longest duration. Return -1; or the row at which no stop and no move is allowed; or -2 if the
    probabilities of stopping beyond the edge are missing.
    """
    ring_q, ring_u, ring_a = ring
    value, best, move_table, control, entry, gap = table
    nodes, lags = value.shape[2], scan_weight.shape[1]
    first_lag, before = tables[1], late.size - value.shape[0]
    matrix, dense = np.zeros((lags, nodes)), np.empty((scan_weight.shape[0], nodes))
    unused = np.empty((0, nodes))
    flipped, here, stop_here = np.empty((1, nodes)), np.empty(1), np.empty(stop_q.shape)
    shape = (duration.size, 1, nodes)
    found = (np.empty(shape), np.empty(shape), np.empty(shape, dtype=np.int32))
    for row in range(value.shape[0]):
        for move in range(duration.size):
            if row < duration[move] and base[0].size > 0:
                for node in range(nodes):
                    ring_q[row, move, 0, node] = base[0][move, 0, node] + late[row + before - duration[move]]
                    ring_u[row, move, 0, node] = base[1][move, 0, node]
                    ring_a[row, move, 0, node] = base[2][move, 0, node]
        here[0] = level[0] + late[row + before]
        for stop in range(stop_q.shape[0]):
            for node in range(nodes):
                stop_here[stop, 0, node] = stop_q[stop, 0, node] + late[row + before]
        kept = (ring_q[row], ring_u[row], ring_a[row])
        out = (value[row], best[row], move_table[row], control[row], entry[row], gap[row])
        if not choose(stop_here, kept, shared, out):
            return row
        v = value[row]
        if tables[4].shape[2] == 0 and here[0] != v[0, 0]:
            return -2
        for node in range(nodes):
            flipped[0, nodes - 1 - node] = v[0, node] - v[0, 0]
        for lag in range(lags):
            for node in range(max(0, lag + first_lag + 1), min(nodes, nodes + lag + first_lag)):
                matrix[lag, node] = v[0, node - lag - first_lag] - v[0, 0]
        begin, end = _wanted(duration, value.shape[0] - row)
        if end == 0:
            continue
        low, high = plan[3][begin], plan[3][end]
        np.dot(scan_weight[low:high], matrix, dense[low:high])
        _complete(dense, low, high, scan_tables, v[0, 0], v[0, nodes - 1], here[0])
        push(begin, end, plan, tables, v, flipped, here, dense, True, True, unused, found, state)
        for move in range(begin, end):
            to = row + duration[move]
            for node in range(nodes):
                ring_q[to, move, 0, node] = found[0][move, 0, node]
                ring_u[to, move, 0, node] = found[1][move, 0, node]
                ring_a[to, move, 0, node] = found[2][move, 0, node]
    return -1
