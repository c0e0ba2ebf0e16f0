"""Compiled look-up in small tables: codes of actions, multiples of a scale, cells found by bisection.

What `single_kernels` finds in full tables; with numbers that are not rounded the same bits.
"""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.sdp._policy.look_up_kernels import _cell, _lowest
from sdpgrind.sdp._policy.single_kernels import FOUND, _evens, _late, _located

GAP, VALUE = range(2)
"""What is told beside the action: how much worse the best other one is, and the value-to-go, $."""


class SmallTable(NamedTuple):
    """Policy for `act_small_at`; whole numbers are as narrow as they fit.

    `code[row, mode, node]`: stops -1, -2, ..., then the entries of the lists of each move in turn; the move
    of a code is `move[code]`. A control is ``coding[code, 0] + coding[code, 1] * control``. The cells with
    lines are sorted, ``first[group]:first[group + 1]`` in `cells` those of the group row * modes + mode;
    number k has the lines ``start[k]:start[k + 1]``. Costs ($) of a line at both ends: ``cost[place]`` with
    ``cost_coding[stops + code]``, or ``wide[-1 - place]`` where `place[line]` < 0; `widens`: whether any is.
    """

    frame: Any
    shape: Any
    code: Any
    control: Any
    coding: Any
    move: Any
    first: Any
    cells: Any
    start: Any
    line_code: Any
    line_control: Any
    place: Any
    cost: Any
    wide: Any
    cost_coding: Any
    widens: bool


class ToldTable(NamedTuple):
    """Tables told beside the action: ``told[k * rows + row, mode, node]`` of `kind[k]`.

    A number is ``coding[k, 0] + coding[k, 1] * told``, infinite where told is ``coding[k, 2]``; `endless`:
    whether any is.
    """

    kind: Any
    told: Any
    coding: Any
    endless: bool


@compiled(error_model="numpy")
def _numbered(first, cells, group, cell):
    """Number of a cell in the sorted list of its group, by bisection; -1: it is not there."""
    low, high = int(first[group]), int(first[group + 1])
    end = high
    while low < high:  # at most 64
        middle = (low + high) >> 1
        if cells[middle] < cell:
            low = middle + 1
        else:
            high = middle
    return low if low < end and cells[low] == cell else -1


@compiled(error_model="numpy")
def _crossed(table, row, mode, index):
    """Number of the cell with lines around a point of one axis (-1: none), and the position in it."""
    cell = max(0, min(int(np.floor(index)), table.shape[0] - 2))
    part = min(max(0.0, index - cell), 1.0)
    if not 0.0 < part < 1.0:
        return -1, part
    return _numbered(table.first, table.cells, row * table.code.shape[1] + mode, cell), part


@compiled(error_model="numpy")
def _decoded(coding, number, stored):
    return coding[number, 0] + coding[number, 1] * stored


@compiled(error_model="numpy")
def _height(table, line, part):
    """Cost ($) of a line at a position in its cell."""
    place = int(table.place[line])
    if table.widens and place < 0:
        left, right = np.float64(table.wide[-1 - place, 0]), np.float64(table.wide[-1 - place, 1])
        return (1 - part) * left + part * right
    number = table.line_code[line] + table.cost_coding.shape[0] - table.coding.shape[0]
    left = _decoded(table.cost_coding, number, table.cost[place, 0])
    return (1 - part) * left + part * _decoded(table.cost_coding, number, table.cost[place, 1])


@compiled(error_model="numpy")
def _lowest_line(table, number, part):
    """First of the lowest lines of a cell, and its height."""
    line, low = int(table.start[number]), np.inf
    for k in range(int(table.start[number]), int(table.start[number + 1])):
        here = _height(table, k, part)
        if here < low:
            line, low = k, here
    return line, low


@compiled(error_model="numpy")
def _move_of(table, code):
    return int(code) if code < 0 else int(table.move[code])


@compiled(error_model="numpy")
def _apart(table, number, part, line):
    """How much higher the lowest line of another move is than `line`; infinite: there is none."""
    low, chosen = np.inf, _move_of(table, table.line_code[line])
    for k in range(int(table.start[number]), int(table.start[number + 1])):
        if _move_of(table, table.line_code[k]) != chosen:
            low = min(low, _height(table, k, part))
    return low - _height(table, line, part)


@compiled(error_model="numpy")
def _act_small(table, row, mode, index, low):
    """Code and control at a position; the control of a stop is NaN."""
    _lowest(table.shape, index, 0, low)
    same, heaviest, code, first, chosen, u = True, -1.0, 0, 0, -1, 0.0
    for corner in range(1 << table.shape.size):
        node, weight = _cell(table.shape, index, 0, corner, low)
        if weight <= 0.0:
            continue
        here = int(table.code[row, mode, node])
        first = here if chosen < 0 else first
        if here != first:
            same = False
        if weight > heaviest:
            heaviest, chosen, code = weight, node, here
        if here >= 0:
            u += weight * _decoded(table.coding, here, table.control[row, mode, node])
    if code < 0:
        u = np.nan
    elif not same:
        u = _decoded(table.coding, code, table.control[row, mode, chosen])
    if table.shape.size == 1:
        number, part = _crossed(table, row, mode, index[0, 0])
        if number >= 0:
            line, _ = _lowest_line(table, number, part)
            code, u = int(table.line_code[line]), np.nan
            if code >= 0:
                left = _decoded(table.coding, code, table.line_control[line, 0])
                u = (1 - part) * left + part * _decoded(table.coding, code, table.line_control[line, 1])
    return code, u


@compiled(error_model="numpy")
def _act_small_at(table, mode, time, x, y, z, evens, index, low):
    row, state = _located(table.frame, table.shape, time, x, y, z, evens, index)
    code, u = -1, np.nan
    if state == FOUND:
        code, u = _act_small(table, row, mode, index, low)
    return state, code, u


@compiled(error_model="numpy")
def act_small_at(table, mode, time, x, y, z):
    """Return how the state is found (see `act_at`), the code of the action, and its control.

    `table`: `SmallTable`; the state as in `act_at`, on axes of which none is logarithmic.
    """
    index, low = np.empty((table.shape.size, 1)), np.empty(table.shape.size, np.int64)
    return _act_small_at(table, mode, time, x, y, z, (x, y, z), index, low)


@compiled(error_model="numpy")
def act_small_log_at(table, mode, time, x, y, z):
    """`act_small_at` where axes are logarithmic."""
    index, low = np.empty((table.shape.size, 1)), np.empty(table.shape.size, np.int64)
    evens = _evens(table.frame, table.shape, x, y, z)
    return _act_small_at(table, mode, time, x, y, z, evens, index, low)


@compiled(error_model="numpy")
def _told_at_node(tables, k, row, mode, node):
    stored = np.float64(tables.told[k * (tables.told.shape[0] // tables.kind.size) + row, mode, node])
    if tables.endless and stored == tables.coding[k, 2]:
        return np.inf
    return _decoded(tables.coding, k, stored)


@compiled(error_model="numpy")
def _told(table, tables, k, row, mode, index, low):
    """Interpolated number of one table; in a cell with lines what these say."""
    _lowest(table.shape, index, 0, low)
    total = 0.0
    for corner in range(1 << table.shape.size):
        node, weight = _cell(table.shape, index, 0, corner, low)
        if weight > 0.0:
            total += weight * _told_at_node(tables, k, row, mode, node)
    if table.shape.size == 1:
        number, part = _crossed(table, row, mode, index[0, 0])
        if number >= 0:
            line, height = _lowest_line(table, number, part)
            other = _apart(table, number, part, line)
            if tables.kind[k] == VALUE:
                total = height
            elif other < np.inf:
                total = other
    return total


@compiled(error_model="numpy")
def _tell_at(table, tables, mode, time, x, y, z, evens, index, low, out):
    row, state = _located(table.frame, table.shape, time, x, y, z, evens, index)
    for k in range(tables.kind.size):
        out[k] = 0.0 if tables.kind[k] == GAP else np.nan
        if state == FOUND and not (tables.kind[k] == VALUE and _late(table.frame[0], time)):
            out[k] = _told(table, tables, k, row, mode, index, low)


@compiled(error_model="numpy")
def tell_small_at(table, tables, mode, time, x, y, z, out):
    """Fill `out` by what `tables` (`ToldTable`) tell of a state, $; `act_small_at` for the arguments.

    Beyond an edge at which the process ends there is no gap, and the value, which is not in the table, is
    NaN; so it is of a late state whose slice serves others, too.
    """
    index, low = np.empty((table.shape.size, 1)), np.empty(table.shape.size, np.int64)
    _tell_at(table, tables, mode, time, x, y, z, (x, y, z), index, low, out)


@compiled(error_model="numpy")
def tell_small_log_at(table, tables, mode, time, x, y, z, out):
    """`tell_small_at` where axes are logarithmic."""
    index, low = np.empty((table.shape.size, 1)), np.empty(table.shape.size, np.int64)
    evens = _evens(table.frame, table.shape, x, y, z)
    _tell_at(table, tables, mode, time, x, y, z, evens, index, low, out)
