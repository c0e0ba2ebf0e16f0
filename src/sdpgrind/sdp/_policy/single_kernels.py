"""Compiled look-up of one state by coordinates of one to three axes: what `locate` and `act` do for many."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.sdp._policy.look_up_kernels import _act, _crossing, _interpolated, _least
from sdpgrind.sdp._problem.countdown import ROUNDING

AXES = 3  # chosen: axes of a table that is looked up so; more are rare, and read as arrays
FOUND, OUTSIDE, REFUSED, UNREAD = range(4)
"""Result: in the table; beyond an edge at which the process ends; no state of the table; not known here."""
CELL_UNREAD = -2  # number of a cell whose lines are not known; derived: other cells have -1 or more
STEP, COUNT, FIRST, LOWEST, HAS_BASE, ENDLESS = range(6)
"""Columns of the first row of `frame`: length of a stage, stages, those of the first slice and of the first
of its own."""
ORIGIN, SPACING, LOG, LOW, HIGH, BELOW, ABOVE = range(7)
"""Columns of its other rows, the axes: low end and cell (of the logarithm where LOG), ends, and what is done
beyond them."""
HOLD, REFUSE, STOP, CHARGED = range(4)
"""What is done beyond an end of an axis; CHARGED: at the end, too."""
CONTROL, ACT, ENTRY = 2, 4, 5  # derived: columns of `lines` behind the cost at both ends; two of control


@compiled(error_model="numpy")
def _row_of(stages, time):
    """Slice of a stage coordinate; -1: none. NaN has none."""
    if stages[ENDLESS] != 0.0:
        return 0
    stage = time / stages[STEP]
    below, lowest = np.floor(stage + ROUNDING), stages[LOWEST]
    if not (stage <= stages[COUNT] + ROUNDING and (below >= lowest or stages[HAS_BASE] != 0.0)):  # guard
        return -1
    if lowest <= below < 0.0 and abs(stage - below) > ROUNDING:
        return -1
    return int(max(below - stages[FIRST], 0.0))


@compiled(error_model="numpy")
def _late(stages, time):
    """Whether the slice of a stage coordinate serves others, too, and lacks their late charge."""
    return stages[ENDLESS] == 0.0 and np.floor(time / stages[STEP] + ROUNDING) < stages[LOWEST]


@compiled(error_model="numpy")
def _even(axis, x):
    """Coordinate in which the nodes are even; a cell below them where it has no logarithm."""
    if axis[LOG] == 0.0:
        return x
    return np.log(x) if x > 0.0 else axis[ORIGIN] - axis[SPACING]


@compiled(error_model="numpy")
def _evens(frame, shape, x, y, z):
    second = _even(frame[2], y) if shape.size > 1 else y
    third = _even(frame[3], z) if shape.size > 2 else z
    return _even(frame[1], x), second, third


@compiled(error_model="numpy")
def _position(axis, nodes, x, even):
    """Position on an axis (cells), and whether it is found, outside or refused."""
    if not np.isfinite(x):  # guard
        return 0.0, REFUSED
    index = (even - axis[ORIGIN]) / axis[SPACING]
    below, above = axis[BELOW], axis[ABOVE]
    if (below == REFUSE and index < -ROUNDING) or (above == REFUSE and index > nodes - 1 + ROUNDING):  # guard
        return index, REFUSED
    if (below >= STOP and x < axis[LOW]) or (above >= STOP and x > axis[HIGH]):
        return index, OUTSIDE
    if (below == CHARGED and x == axis[LOW]) or (above == CHARGED and x == axis[HIGH]):
        return index, OUTSIDE
    return index, FOUND


@compiled(error_model="numpy")
def _located(frame, shape, time, x, y, z, evens, index):
    """Fill `index` (axes, 1) by the position; return the slice, and how the state is found."""
    row, state = _row_of(frame[0], time), FOUND
    for k in range(shape.size):
        raw = x if k == 0 else (y if k == 1 else z)
        index[k, 0], here = _position(frame[1 + k], shape[k], raw, evens[k])
        state = max(state, here)
    return row, REFUSED if row < 0 else state  # guard


@compiled(error_model="numpy")
def _place(frame, shape, at, mode, time, x, y, z, evens, index):
    """`_located`, and UNREAD in a cell whose lines are not known."""
    row, state = _located(frame, shape, time, x, y, z, evens, index)
    if state == FOUND and at.shape[2] > 0:
        number, _, _ = _crossing(at, row, mode, index[0, 0], shape[0])
        state = UNREAD if number == CELL_UNREAD else FOUND  # guard: exports know all lines
    return row, state


@compiled(error_model="numpy")
def act_at(frame, shape, best, entry, control, gap, at, start, lines, mode, time, x, y, z):
    """Return how the state is found, move (stops < 0), entry of the lists, control and gap ($).

    Parameters
    ----------
    frame : array, (1 + n, 7)
        Stages, as `STEP` ... name them, and axes, as `ORIGIN` ... do.
    shape : array, (n,)
        Nodes of each axis.
    best, entry, control, gap : array
        Tables [row, mode, node].
    at, start, lines : array
        Lines of the cells in which the action changes: `Kinks`, and (m, 6) as `CONTROL` ... name them. A
        number of `CELL_UNREAD`: they are not known.
    mode : int
        Number of the mode.
    time : float
        Stage coordinate.
    x, y, z : float
        Coordinates, in the units of the axes; those beyond the last axis do not count.
    """
    # room is made here: a kernel that makes none counts no references
    index, low = np.empty((shape.size, 1)), np.empty(shape.size, np.int64)
    evens = _evens(frame, shape, x, y, z)
    tables = (best, entry, control, gap)
    return _act_at(frame, shape, tables, at, start, lines, mode, time, x, y, z, evens, index, low)


@compiled(error_model="numpy")
def act_linear_at(frame, shape, best, entry, control, gap, at, start, lines, mode, time, x, y, z):
    """`act_at` for axes of which none is logarithmic: no function of the C library is reached."""
    index, low = np.empty((shape.size, 1)), np.empty(shape.size, np.int64)
    tables = (best, entry, control, gap)
    return _act_at(frame, shape, tables, at, start, lines, mode, time, x, y, z, (x, y, z), index, low)


@compiled(error_model="numpy")
def _act_at(frame, shape, tables, at, start, lines, mode, time, x, y, z, evens, index, low):
    row, state = _place(frame, shape, at, mode, time, x, y, z, evens, index)
    move, listed, u, g = -1, 0, np.nan, 0.0
    if state == FOUND:
        kinks = (at, start, lines, lines[:, CONTROL:], lines[:, ACT], lines[:, ENTRY])
        move, listed, u, g = _act(tables, kinks, row, mode, shape, index, 0, low)
    return state, move, listed, u, g


@compiled(error_model="numpy")
def value_at(frame, shape, value, at, start, lines, mode, time, x, y, z):
    """Return how a state is found, as `act_at` does, and its value-to-go ($); REFUSED where it is late."""
    index, low = np.empty((shape.size, 1)), np.empty(shape.size, np.int64)
    evens = _evens(frame, shape, x, y, z)
    return _value_at(frame, shape, value, at, start, lines, mode, time, x, y, z, evens, index, low)


@compiled(error_model="numpy")
def _value_at(frame, shape, value, at, start, lines, mode, time, x, y, z, evens, index, low):
    row, state = _place(frame, shape, at, mode, time, x, y, z, evens, index)
    if state == FOUND and _late(frame[0], time):
        state = REFUSED
    if state != FOUND:
        return state, np.nan
    found = _interpolated(value, row, mode, shape, index, 0, low)
    if at.shape[2] > 0:
        number, _, part = _crossing(at, row, mode, index[0, 0], shape[0])
        if number >= 0:
            found = _least(start[number], start[number + 1], lines, part)[1]
    return state, found
