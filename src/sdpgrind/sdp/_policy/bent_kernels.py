"""Compiled look-up of a policy of one axis with a stop whose charge is bent within cells, as exports have it.

In such a cell the charge of the stop is exact, beside the lowest line of a move: what `Solution.act` does for
many states.
"""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.sdp._policy.exported_kernels import _filled
from sdpgrind.sdp._policy.single_kernels import FOUND, OUTSIDE, _late, _located
from sdpgrind.sdp._policy.small_kernels import GAP, VALUE, _act_small, _decoded, _height, _numbered, _told


class Side(NamedTuple):
    """Charge ($) on one side: factor ((z - tolerance)+)^power of the distance z; power 0: a constant."""

    factor: float
    tolerance: float
    power: int


class BentStop(NamedTuple):
    """Charge ($) of the first stop, and the cells of the one axis in which it is bent.

    `cells[row, mode, cell]`: whether it is; the coordinate is ``low + spacing * index``; `under` and `over`:
    sides of the target 0; to them come ``extra[mode]`` and ``late[row]``.
    """

    cells: Any
    low: float
    spacing: float
    under: Side
    over: Side
    extra: Any
    late: Any


@compiled(error_model="numpy")
def _side(side, z):
    """Charge ($) at a distance >= 0 on one side."""
    if side.power == 0:
        return side.factor if z > 0.0 and z >= side.tolerance else 0.0
    charged = max(z - side.tolerance, 0.0)
    return side.factor * (charged * charged if side.power == 2 else charged)


@compiled(error_model="numpy")
def _stopping(bent, row, mode, index):
    """Charge ($) of stopping in a cell where it is bent; NaN: elsewhere."""
    cell = max(0, min(int(np.floor(index)), bent.cells.shape[2] - 1))
    if not cell < index < cell + 1 or bent.cells[row, mode, cell] == 0:
        return np.nan
    x = bent.low + bent.spacing * index
    charge = 0.0
    if bent.low >= 0.0 or x > 0.0:  # the first is known to an export
        charge = _side(bent.under, x)
    elif x < 0.0:
        charge = _side(bent.over, -x)
    return charge + bent.extra[mode] + bent.late[row]


@compiled(error_model="numpy")
def _moving(table, row, mode, index):
    """Lowest line of a move around a point (-1: none), its height ($; infinite), and the position."""
    cell = max(0, min(int(np.floor(index)), table.shape[0] - 2))
    part = index - cell
    line, low = -1, np.inf
    number = _numbered(table.first, table.cells, row * table.code.shape[1] + mode, cell)
    if number >= 0:
        for k in range(int(table.start[number]), int(table.start[number + 1])):
            here = _height(table, k, part)
            if table.line_code[k] >= 0 and here < low:
                line, low = k, here
    return line, low, part


@compiled(error_model="numpy")
def _act_bent(table, bent, row, mode, index, low):
    """Code and control at a position; the control of a stop is NaN."""
    stop = _stopping(bent, row, mode, index[0, 0])
    if np.isnan(stop):
        return _act_small(table, row, mode, index, low)
    line, height, part = _moving(table, row, mode, index[0, 0])
    if stop <= height:
        return -1, np.nan
    code = int(table.line_code[line])
    left = _decoded(table.coding, code, table.line_control[line, 0])
    return code, (1 - part) * left + part * _decoded(table.coding, code, table.line_control[line, 1])


@compiled(error_model="numpy")
def _told_bent(table, bent, tables, k, row, mode, index, low):
    """Gap or value ($) at a position."""
    stop = _stopping(bent, row, mode, index[0, 0])
    if np.isnan(stop):
        return _told(table, tables, k, row, mode, index, low)
    height = _moving(table, row, mode, index[0, 0])[1]
    if tables.kind[k] == VALUE:
        return min(stop, height)
    return abs(height - stop) if height < np.inf else _told(table, tables, k, row, mode, index, low)


@compiled(error_model="numpy")
def action_bent_at(state, table, bent, lists, level, stops, mode, time, x, y, z, out):
    """`action_at` of a policy of one linear axis with a `BentStop`."""
    if not 0.0 <= mode < table.code.shape[1] or mode != np.floor(mode):  # guard of its range
        return -1
    index, low = np.empty((table.shape.size, 1)), np.empty(table.shape.size, np.int64)
    row, found = _located(table.frame, table.shape, time, x, y, z, (x, y, z), index)
    if found > OUTSIDE:  # guard
        return -1
    code, control = -1, np.nan
    if found == FOUND:
        code, control = _act_bent(table, bent, row, int(mode), index, low)
    return _filled(table, lists, level, stops, code, control, out)


@compiled(error_model="numpy")
def action_told_bent_at(state, table, told, bent, lists, level, stops, mode, time, x, y, z, out):
    """`action_bent_at`, then what `told` (`ToldTable`) tells, $, as `tell_small_at` does."""
    status = action_bent_at(state, table, bent, lists, level, stops, mode, time, x, y, z, out)
    if status >= 0:  # guard
        index, low = np.empty((table.shape.size, 1)), np.empty(table.shape.size, np.int64)
        row, found = _located(table.frame, table.shape, time, x, y, z, (x, y, z), index)
        for k in range(told.kind.size):
            place = lists.shape[1] + k
            out[place] = 0.0 if told.kind[k] == GAP else np.nan
            if found == FOUND and not (told.kind[k] == VALUE and _late(table.frame[0], time)):
                out[place] = _told_bent(table, bent, told, k, row, int(mode), index, low)
    return status
