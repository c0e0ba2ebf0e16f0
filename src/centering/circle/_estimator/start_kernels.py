"""Screening of the first 30 readings together, about a circle that most of them agree with."""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.kernels import (
    PIVOT,
    _count,
    _curve,
    _least_noise,
    _note,
    _rotate_unless_outlier,
    _slant,
    _write_row,
    _write_row_at,
)
from centering.circle._estimator.noise_kernels import _arrays, _copy
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.compiling.uncounted import uncounted
from sdpgrind.identify.kernels import back_substitute, rotate

_CLOSER = 1.5  # chosen: factor by which a circle through neighbours must fit better than one through thirds
_CORE = 2.5  # chosen: standard deviations about the agreed circle within which readings are taken first
_SHORT = 720.0  # derived: arc^4 over (s/R)^2, rad^4, where noise s in the rows informs on R as they do
_LONG = 0.5  # chosen: rad; over this arc outliers are refused at any noise


@compiled(error_model="numpy")
def _ring(state):
    """Ring buffer as rows: angle, reading, flag of refusal, angle travelled, number."""
    return state[at.RING_AT : at.RING_AT + at.RING * at.CELL].reshape((at.RING, at.CELL))


@compiled(error_model="numpy")
def _zero(array, begin, end):
    """Set the entries from `begin` to before `end` to 0."""
    for i in range(begin, end):
        array[i] = 0.0


@compiled(error_model="numpy")
def clear(state):
    """Forget every reading; keep settings and prior knowledge."""
    _zero(state, at.SEEN, at.RADIUS)
    _zero(state, at.RING_AT, at.TAIL)
    rows = _arrays(state)
    for i in range(3, 9):
        _zero(rows[i], 0, rows.shape[1])
    state[at.GATE_FROM] = np.inf
    _clear_fit(state)


@compiled(error_model="numpy")
def _empty(array):
    """Write the triangle of no readings."""
    for i in range(3):
        _zero(array[i], 0, array.shape[1])
        array[i, i] = PIVOT


@compiled(error_model="numpy")
def _clear_fit(state):
    """Forget the rows; keep the position of the spindle."""
    state[at.USED] = state[at.LAGGED] = state[at.CENTER_X] = state[at.CENTER_Y] = 0.0
    state[at.RATIO] = 1.0
    _zero(state, at.SUM, at.SUM + at.SUMS)
    _zero(state, at.BLOCK_BEGIN, at.RADIUS)
    _empty(_arrays(state)[:3])


@compiled(error_model="numpy")
def _replay(state, core):
    """Fit the accepted readings of the ring buffer, those in `core` first; the others unless outliers."""
    x, y = state[at.CENTER_X], state[at.CENTER_Y]
    _clear_fit(state)
    state[at.CENTER_X], state[at.CENTER_Y] = x, y  # weigh the first rows by the previous fit
    cells = _ring(state)
    for late in range(2):
        for i in range(int(state[at.SEEN])):
            if cells[i, 2] != 0.0 or (core[i] == 0.0) != (late == 1):
                continue
            if late == 1 and _is_far(state, cells[i]):
                cells[i, 2] = 1.0
                state[at.BAD] += 1.0
            else:
                _fold(state, cells[i])


@compiled(error_model="numpy")
def _fold(state, cell):
    """Take the row of a reading in the ring buffer."""
    rows = _arrays(state)
    array, row = rows[:3], rows[15]
    _write_row(state, cell[0], cell[1], row)
    weight = np.exp(state[at.LOG_FORGETTING] * (state[at.TRAVEL] - cell[3]))
    _note(state, row, weight, cell[3])
    root = np.sqrt(weight)
    for k in range(row.shape[0]):
        row[k] *= root
    rotate(array, row)
    _count(state, array, row[3], weight)


@compiled(error_model="numpy")
def _is_far(state, cell):
    """Whether a reading in the ring buffer is an outlier of the triangle; it is not taken."""
    rows = _arrays(state)
    _write_row(state, cell[0], cell[1], rows[15])
    _copy(rows, rows[9:12])
    return _rotate_unless_outlier(state, rows[9:12], rows[15]) == np.inf


@compiled(error_model="numpy")
def _end_start(state):
    """Screen the first readings once the arc exceeds GATE_FROM: rows of a spindle at rest fit any reading."""
    state = uncounted(state)
    cells, room = _ring(state), np.empty(at.RING)
    state[at.GATE_FROM] = 0.0
    if state[at.LIMACON] == 0.0:
        for i in range(1, at.RING):
            room[i - 1] = abs(cells[i, 1] - cells[i - 1, 1])
        noise = max(_median(room, at.RING - 1) / 0.954, state[at.NOISE])
        state[at.GATE_FROM] = min(np.sqrt(np.sqrt(_SHORT) * noise / state[at.REFERENCE]), _LONG)
    if state[at.COVERED] >= state[at.GATE_FROM]:
        _screen(state, room)


@compiled(error_model="numpy")
def _median(values, size):
    """Median of the first values, which are sorted in place."""
    for i in range(1, size):
        value, j = values[i], i
        while j > 0 and values[j - 1] > value:  # at most at.RING
            values[j] = values[j - 1]
            j -= 1
        values[j] = value
    return 0.5 * (values[(size - 1) // 2] + values[size // 2])


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _screen(state, room):
    """Refuse the outliers of the first readings, about a circle that most of them agree with."""
    error, core = np.empty(at.RING), np.empty(at.RING)
    middle = _agreed_errors(state, error, room)
    least = _least_noise(state) / state[at.RATIO]
    scale = max(1.4826 * (1.0 + 5.0 / (at.RING - 3)) * middle, least)
    for again in range(2):  # a loop, as two calls would be compiled twice
        for i in range(at.RING):
            core[i] = 1.0 if again == 1 or error[i] <= _CORE * scale + state[at.FORM_GATE] else 0.0
        _replay(state, core)


@compiled(error_model="numpy")
def _triple(n):
    """Places in the ring buffer of three readings: one of each third, or neighbours."""
    if n < 60:
        first, turn = n % 10, n // 10
        return first, 10 + (3 * first + turn) % 10, 20 + (7 * first + 2 * turn) % 10
    first, second, third = 13 * n, 3 + n % 9, 7 + n % 9 + (n // 9) % 5
    return first % at.RING, (first + second) % at.RING, (first + third) % at.RING


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _agreed_errors(state, best, room):
    """Write the errors (mm) of the readings about the circle of least median through three; return that.

    60 triples take one reading of each third; 60 more lie 3 to 15 readings apart, so that some miss any 14
    dusty neighbours. Those must fit much better: over a short arc form looks like a circle.
    """
    least, middle, error, value = np.inf, 0.0, np.empty(at.RING), np.empty(3)
    places, centred, array = np.empty((at.RING, 3)), np.empty((at.RING, 4)), np.empty((4, 4))
    center_x, center_y = state[at.CENTER_X], state[at.CENTER_Y]
    _write_places(state, places, centred)
    for n in range(120):
        _write_circle(centred, _triple(n), array, value)
        state[at.CENTER_X], state[at.CENTER_Y] = value[1], value[2]
        times = 1.0 if n < 60 else _CLOSER
        if not _write_errors(state, places, value, error, least / times):
            continue
        for i in range(at.RING):
            room[i] = error[i]
        median = _median(room, at.RING)
        if times * median < least:
            least, middle = times * median, median
            for i in range(at.RING):
                best[i] = error[i]
            center_x, center_y = value[1], value[2]
    state[at.CENTER_X], state[at.CENTER_Y] = center_x, center_y
    return middle


@compiled(error_model="numpy")
def _write_places(state, out, centred):
    """Write cosine and sine of each angle in the ring buffer and the reading, and rows about the axis."""
    cells, row = _ring(state), _arrays(state)[15]
    state[at.CENTER_X] = state[at.CENTER_Y] = 0.0
    for i in range(at.RING):
        out[i, 0], out[i, 1], out[i, 2] = np.cos(cells[i, 0]), np.sin(cells[i, 0]), cells[i, 1]
        _write_row_at(state, out[i, 0], out[i, 1], out[i, 2], row)
        for k in range(4):
            centred[i, k] = row[k]


@compiled(error_model="numpy")
def _write_circle(centred, three, array, value):
    """Write the circle through three readings; `array`: room for its triangle and a row."""
    _empty(array[:3])
    for n in range(3):
        for k in range(4):
            array[3, k] = centred[three[n], k]
        rotate(array[:3], array[3])
    back_substitute(array[:3], 3, value)


@compiled(error_model="numpy")
def _write_errors(state, places, value, error, least):
    """Write the errors (mm) about the circle of a value; return whether the median is < `least`."""
    far, row, plain = 0, _arrays(state)[15], state[at.LIMACON] == 0.0 and state[at.KNOWN] == 0.0
    tip, start, per_start = state[at.TIP], state[at.REFERENCE], state[at.PER_REFERENCE]
    q, x, y = value[0], value[1], value[2]
    for i in range(at.RING):
        c, s, reading = places[i, 0], places[i, 1], places[i, 2]
        if plain:
            (_, _, distance, _, steep) = _slant(c, s, reading + tip, x, y)
            ratio, (h0, h1, h2, t) = _curve(c, s, reading + tip, distance, steep, start, per_start)
            state[at.RATIO], error[i] = ratio, abs(t - h0 * q - h1 * x - h2 * y) / ratio
        else:
            _write_row_at(state, c, s, reading, row)
            error[i] = abs(row[3] - row[0] * q - row[1] * x - row[2] * y) / state[at.RATIO]
        far += error[i] >= least
        if 2 * far > at.RING:  # the median is not
            return False
    return True
