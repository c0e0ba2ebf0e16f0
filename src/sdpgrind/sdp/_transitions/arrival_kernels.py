"""Value where a move arrives, on floats: charges of the edges passed, then the table interpolated."""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

HOLD, STOP, NUMBER, REFUSE = range(4)
"""Kinds of an edge."""
CONSTANT, LINEAR, QUADRATIC = range(3)
"""Kinds of a charge beyond the edge of a stop."""
LEAVES = 1e-9  # chosen: share of an axis by which a coordinate must leave an edge to be refused


class EdgeTables(NamedTuple):
    """Axes of a grid and what happens beyond their edges.

    `axes` (n, 3): low and high end, spacing of the nodes (of the logarithm where `logs`). `kinds` (n, 2):
    kind below and above; `extra`: charge ($) of a NUMBER. `stop` (2, 3): kind, amount and tolerance of the
    stop's charge below and above 0, wherever the edges are.
    """

    axes: Any
    logs: Any
    shape: Any
    kinds: Any
    extra: Any
    stop: Any


@compiled(error_model="numpy", inline="always")
def _refused(y, k, edges):
    """Whether a coordinate left an edge that must not be left."""
    low, high = edges.axes[k, 0], edges.axes[k, 1]
    enough = LEAVES * (high - low)
    below, above = edges.kinds[k, 0] == REFUSE, edges.kinds[k, 1] == REFUSE
    return (below and y < low and low - y > enough) or (above and y > high and y - high > enough)


@compiled(error_model="numpy", inline="always")
def _stop_charge(y, sides):
    """Charge ($) of the stop for ending at a coordinate; its target is 0."""
    charge, distance = sides[0] if y < 0.0 else sides[1], abs(y)
    z = distance - charge[2]
    if charge[0] == CONSTANT:
        return charge[1] if distance > 0.0 and z >= 0.0 else 0.0
    if z <= 0.0:
        return 0.0
    return charge[1] * (z if charge[0] == LINEAR else z * z)


@compiled(error_model="numpy", inline="always")
def _left(y, k, edges, paid, beyond):
    """Whether the process ends at a coordinate, and what is `paid` ($) then."""
    for side in range(2):
        end, kind = edges.axes[k, side], edges.kinds[k, side]
        out = y < end if side == 0 else y > end
        if kind == STOP and out:
            return True, paid + _stop_charge(y, edges.stop) + beyond
        if kind == NUMBER and (out or y == end):
            return True, paid + edges.extra[k, side]
    return False, paid


@compiled(error_model="numpy", inline="always")
def _place(y, k, edges):
    """Lower node of a coordinate's cell, and the position in it."""
    low, log = edges.axes[k, 0], edges.logs[k]
    at = 0.0
    if y > low or not log:
        at = ((np.log(y) - np.log(low)) if log else (y - low)) / edges.axes[k, 2]
    at = min(max(at, 0.0), edges.shape[k] - 1.0)
    node = min(int(at), edges.shape[k] - 2)
    return node, at - node


@compiled(error_model="numpy", inline="always")
def _interpolated(table, axes, shape, node, part, total):
    """Add the table interpolated in a cell to `total`."""
    for corner in range(1 << axes):
        at, weight = 0, 1.0
        for k in range(axes):
            up = (corner >> k) & 1
            at = at * shape[k] + node[k] + up
            weight *= part[k] if up else 1.0 - part[k]
        if weight > 0.0:
            total += weight * table[at]
    return total


@compiled(error_model="numpy", forceinline=True)
def _arrived(reached, edges, ahead, beyond, paid, node, part):
    """Return what is `paid` ($) and the value behind a state, and the coordinate that left a refused edge.

    Parameters
    ----------
    reached : array, (n,)
        The state.
    edges : EdgeTables
        Axes and their edges.
    ahead : array
        Value-to-go ($) at the nodes.
    beyond : float
        Further charge ($) where the process stops.
    paid : float
        Charge ($) of the step.
    node, part : array, (n,)
        Room for the cell.

    Returns
    -------
    float
        Sum, $.
    float
        NaN: no edge was refused; infinite: a coordinate is NaN.
    """
    worst, ended = np.nan, False
    for k in range(len(edges.shape)):
        y = reached[k]
        if np.isnan(y):
            worst, y = np.inf, edges.axes[k, 0]
        if _refused(y, k, edges):
            worst = y
        if not ended:
            ended, paid = _left(y, k, edges, paid, beyond)
        node[k], part[k] = _place(y, k, edges)
    return paid if ended else _interpolated(ahead, len(edges.shape), edges.shape, node, part, paid), worst


@compiled(error_model="numpy")
def arrive(reached, paid, weight, edges, value, target, level, penalty, begin, worst, q):
    """q[row, node] = E (value(next) + charges) of the pairs from `begin` on; 0 where the penalty is infinite.

    Pairs and what is `reached` and `paid` as `step_kernels` fills them. Return the coordinate that left a
    refused edge, the last one seen (`worst`: none did), infinite where it was no number.
    """
    nodes, axes = q.shape[1], reached.shape[2]
    low, part = np.empty(axes, dtype=np.int64), np.empty(axes)
    for i in range(min(reached.shape[0], q.size - begin)):
        row, node = (begin + i) // nodes, (begin + i) % nodes
        q[row, node] = 0.0
        if penalty[row, node] == np.inf:
            continue
        ahead, beyond = value[target[row]], level[target[row]]
        total = 0.0
        for k in range(weight.size):
            here, refused = _arrived(reached[i, k], edges, ahead, beyond, paid[i, k], low, part)
            worst = worst if np.isnan(refused) else refused
            total += weight[k] * here
        q[row, node] = total
    return worst
