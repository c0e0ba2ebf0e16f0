"""The streaming estimator, compiled: a row per reading, rotated into a triangle; wild readings refused; a part that has moved."""

import numpy as np
from numba import njit

from centering._geometry import estimator_slots as at
from centering._geometry.estimator_noise_kernels import back, block, known_quantile
from centering._geometry.estimator_row_kernels import write_row
from centering._geometry.estimator_travel_kernels import (
    PIVOT,
    REFUSED,
    RESTARTED,
    SCREENED,
    TAKEN,
    cover,
    objection,
    travel,
    way_of,
)
from centering._geometry.estimator_turn_kernels import gather
from centering._geometry.validity_kernels import holds_axis, judge, valid_now
from sdpgrind.identify.kernels import rotate

_WILD = 5.0  # standard deviations from which on a reading is refused
_QUIET = 1e-11  # least noise of the gate, in largest readings
_SAME = 1e-12  # of the largest reading: rounding of sums
_CLOSER = 1.5  # times nearer that the readings must lie to a circle through neighbours
_FEW = 8  # readings before the centre is used to weigh
_CORE = 2.5  # standard deviations about the screened start within which readings are taken first
_SHORT = 720.0  # fourth power of an arc (rad) over which noise s in the rows tells as much of R as they do, over (s/R)^2
_LONG = 0.5  # rad: arc over which it does not in any case
_OWN_NOISE = 0.1  # largest root of what noise in the rows may add to the information of the radius, in that information


@njit(cache=True, nogil=True, error_model="numpy")
def _is_wild(state, array, row):
    """Whether a reading lies too far from what those before predict, at the noise that they show."""
    if state[at.COVERED] < state[at.GATE_FROM]:
        return False
    spread, error = 1.0, row[3]
    first = row[0] / array[0, 0]
    second = (row[1] - array[0, 1] * first) / array[1, 1]
    third = (row[2] - array[0, 2] * first - array[1, 2] * second) / array[2, 2]
    spread += first * first + second * second + third * third
    error = abs(error - first * array[0, 3] - second * array[1, 3] - third * array[2, 3])
    error -= state[at.FORM_GATE] * state[at.RATIO]
    freedom = state[at.WEIGHT] - 3.0
    if error <= 0.0 or freedom < 1.0:
        return False
    least = max(state[at.NOISE], _QUIET * state[at.LARGEST]) * state[at.RATIO]
    return error * error > _wild(freedom) ** 2 * max(state[at.SQUARES] / freedom, least * least) * spread


@njit(cache=True, nogil=True, error_model="numpy")
def _wild(freedom):
    """Student's quantile that is as rare as 5 standard deviations (Wallace); 5 from some 200 readings on."""
    if freedom > 200.0:
        return _WILD
    z = _WILD * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0)
    return np.sqrt(freedom * np.expm1(z * z / freedom))


@njit(cache=True, nogil=True, error_model="numpy")
def _fold(state, array, row, weight, way):
    """Rotate a row in; keep what it leaves, the difference to the row before, its block, and the centre."""
    gather(state, row, way)
    previous = at.PREVIOUS
    if state[at.LAGGED] != 0.0:
        for i in range(4):
            change = weight * (row[i] - state[previous + i])
            for j in range(i, 4):
                state[at.LAG + 4 * i + j] += change * (row[j] - state[previous + j])
    for i in range(4):
        state[previous + i] = row[i]
    state[at.LAGGED] = 1.0
    for i in range(5):
        state[at.BIAS + i] += weight * state[at.NEW_BIAS + i]
    if weight != 1.0:
        row *= np.sqrt(weight)
    rotate(array, row)
    state[at.SQUARES] += row[3] * row[3]
    state[at.WEIGHT] += weight
    state[at.USED] += 1.0
    if state[at.USED] >= _FEW:
        y = array[2, 3] / array[2, 2]
        state[at.CENTER_X], state[at.CENTER_Y] = (array[1, 3] - array[1, 2] * y) / array[1, 1], y


@njit(cache=True, nogil=True, error_model="numpy")
def ring(state):
    """The latest readings: angle, reading, whether refused, way travelled, number."""
    return state[at.RING_AT : at.RING_AT + at.RING * at.CELL].reshape((at.RING, at.CELL))


@njit(cache=True, nogil=True, error_model="numpy")
def clear(state):
    """Forget every reading but not what is known beforehand."""
    state[at.SEEN : at.RESTARTS] = 0.0
    state[at.WEIGHT : at.REFERENCE] = 0.0
    state[at.POSITION : at.RADIUS] = 0.0
    state[at.RING_AT : at.TAIL] = 0.0
    _clear_fit(state)
    block(state, 3, 6)[:] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _clear_fit(state):
    """Forget the rows, not where the spindle is."""
    state[at.USED] = state[at.WEIGHT] = state[at.SQUARES] = state[at.LAGGED] = 0.0
    state[at.CENTER_X] = state[at.CENTER_Y] = 0.0
    state[at.RATIO] = 1.0
    state[at.LAG : at.NEW_BIAS] = 0.0
    state[at.BLOCK_BEGIN : at.RADIUS] = 0.0
    array = block(state, 0, 3)
    array[:] = 0.0
    for i in range(3):
        array[i, i] = PIVOT


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(state, angle, reading):
    """Write a reading into the ring; whether the one that it replaces was refused no longer counts."""
    cell = at.RING_AT + at.CELL * (int(state[at.SEEN]) % at.RING)
    state[at.BAD] -= state[cell + 2]
    state[cell], state[cell + 1], state[cell + 2], state[cell + 3] = angle, reading, 0.0, state[at.TRAVEL]
    state[cell + 4] = state[at.INDEX]
    if state[at.SEEN] == 0.0:
        state[at.REFERENCE] = reading + state[at.TIP]
    else:
        _see_step(state, reading)
    state[at.LATEST] = reading
    state[at.LARGEST] = max(state[at.LARGEST], abs(reading + state[at.TIP]))
    return cell


@njit(cache=True, nogil=True, error_model="numpy")
def _see_step(state, reading):
    """Keep the least step from reading to reading, and how many readings repeat the one before."""
    step = abs(reading - state[at.LATEST])
    if step <= _SAME * state[at.LARGEST]:
        state[at.REPEATS] += 1.0
    elif state[at.QUANTUM] == 0.0 or step < state[at.QUANTUM]:
        state[at.QUANTUM] = step


@njit(cache=True, nogil=True, error_model="numpy")
def take(state, angle, reading):
    """Take a reading; what became of it, or (negative) why it cannot be taken: then nothing has changed."""
    return _take(state, block(state, 0, 3), block(state, 15, 1)[0], angle, reading)


@njit(cache=True, nogil=True, error_model="numpy")
def _take(state, array, row, angle, reading):
    """The same with the triangle and room for a row at hand."""
    code = objection(state, angle, reading)
    if code != TAKEN:
        return code
    travel(state, array, angle)
    if int(state[at.SEEN]) % at.RING == 0:
        _keep_triangle(state)
    cell = _remember(state, angle, reading)
    write_row(state, angle, reading, row)
    state[at.INDEX] += 1.0
    state[at.SEEN] += 1.0
    if state[at.SEEN] > at.RING and _is_wild(state, array, row):
        state[cell + 2] = 1.0
        state[at.BAD] += 1.0
        state[at.IN_A_ROW] += 1.0
        if 2.0 * state[at.BAD] <= at.RING:
            return REFUSED
        _restart(state)
        return RESTARTED
    state[at.IN_A_ROW] = 0.0
    _fold(state, array, row, 1.0, state[at.TRAVEL])
    if state[at.SEEN] == at.RING:
        _end_start(state)
        return SCREENED if state[at.BAD] > 0.0 else TAKEN
    return TAKEN


@njit(cache=True, nogil=True, error_model="numpy")
def _keep_triangle(state):
    """Every 30 readings keep the triangle; the older of two is of before any reading in the ring."""
    block(state, 6, 3)[:] = block(state, 3, 3)
    block(state, 3, 3)[:] = block(state, 0, 3)


@njit(cache=True, nogil=True, error_model="numpy")
def _replay(state, wanted):
    """Fit anew the readings of a ring that begins at its first cell, those that are wanted and not refused, in their order."""
    x, y = state[at.CENTER_X], state[at.CENTER_Y]
    _clear_fit(state)
    state[at.CENTER_X], state[at.CENTER_Y] = x, y  # the fit before weighs the first few
    cells, array, row = ring(state), block(state, 0, 3), block(state, 15, 1)[0]
    for i in range(int(state[at.SEEN])):
        if wanted[i] and cells[i, 2] == 0.0:
            write_row(state, cells[i, 0], cells[i, 1], row)
            weight = np.exp(state[at.LOG_FORGETTING] * (state[at.TRAVEL] - cells[i, 3]))
            _fold(state, array, row, weight, cells[i, 3])


@njit(cache=True, nogil=True, error_model="numpy")
def _end_start(state):
    """Screen the start, if it is turned so far that the rows tell more than the noise of the readings in them.

    The rows of a spindle that stands explain any reading: none can be refused before the arc GATE_FROM.
    """
    if state[at.LIMACON] == 0.0:
        readings = ring(state)[:, 1]
        noise = max(np.median(np.abs(readings[1:] - readings[:-1])) / 0.954, state[at.NOISE])
        state[at.GATE_FROM] = min(np.sqrt(np.sqrt(_SHORT) * noise / state[at.REFERENCE]), _LONG)
    if state[at.COVERED] >= state[at.GATE_FROM]:
        _screen(state)


@njit(cache=True, nogil=True, error_model="numpy")
def _screen(state):
    """At the end of the start: refuse its wild readings, about a circle that most of them agree on."""
    cells, array, row = ring(state), block(state, 0, 3), block(state, 15, 1)[0]
    error = _agreed_errors(state)
    least = max(state[at.NOISE], _QUIET * state[at.LARGEST])
    scale = max(1.4826 * (1.0 + 5.0 / (at.RING - 3)) * np.median(error), least)
    core = error <= _CORE * scale + state[at.FORM_GATE]
    _replay(state, core)
    for i in range(at.RING):
        if not core[i]:
            write_row(state, cells[i, 0], cells[i, 1], row)
            if _is_wild(state, array, row):
                cells[i, 2] = 1.0
                state[at.BAD] += 1.0
            else:
                _fold(state, array, row, 1.0, cells[i, 3])
    _replay(state, np.ones(at.RING, dtype=np.bool_))


@njit(cache=True, nogil=True, error_model="numpy")
def _triple(n):
    """Places in the ring of three readings: one of each third, or neighbours."""
    if n < 60:
        first, turn = n % 10, n // 10
        return first, 10 + (3 * first + turn) % 10, 20 + (7 * first + 2 * turn) % 10
    first, second, third = 13 * n, 3 + n % 9, 7 + n % 9 + (n // 9) % 5
    return first % at.RING, (first + second) % at.RING, (first + third) % at.RING


@njit(cache=True, nogil=True, error_model="numpy")
def _agreed_errors(state):
    """Errors (mm) of the readings about that circle through three of them whose median error is least.

    Of 60 triples each reading is of another third; those of 60 more are 3 to 15 readings apart, so that some miss any 14
    neighbours that are dusty. These are believed if they agree much better: form would else be told from a circle by them.
    """
    cells, least, best = ring(state), np.inf, np.zeros(at.RING)
    center_x, center_y = state[at.CENTER_X], state[at.CENTER_Y]
    value, error = np.empty(3), np.empty(at.RING)
    for n in range(120):
        _clear_fit(state)
        array, row = block(state, 0, 3), block(state, 15, 1)[0]
        for i in _triple(n):
            write_row(state, cells[i, 0], cells[i, 1], row)
            rotate(array, row)
        back(array, 3, value)
        state[at.CENTER_X], state[at.CENTER_Y] = value[1], value[2]
        for i in range(at.RING):
            write_row(state, cells[i, 0], cells[i, 1], row)
            error[i] = abs(row[3] - row[0] * value[0] - row[1] * value[1] - row[2] * value[2]) / state[at.RATIO]
        median = np.median(error)
        if median < least if n < 60 else _CLOSER * median < least:
            least = median if n < 60 else _CLOSER * median
            best[:] = error
            center_x, center_y = value[1], value[2]
    state[at.CENTER_X], state[at.CENTER_Y] = center_x, center_y
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _restart(state):
    """The part has moved: begin anew with the latest readings, from where most are refused on; what is known of R stays."""
    carry_radius(state, True)
    latest = _since_moved(state)
    way = state[at.TRAVEL]
    clear(state)
    state[at.TRAVEL] = way
    state[at.RESTARTS] += 1.0
    number = state[at.INDEX]
    for i in range(latest.shape[0]):
        state[at.INDEX] = latest[i, 4]
        _again(state, latest[i], latest[i - 1] if i > 0 else latest[i])
    state[at.INDEX] = number
    if state[at.SEEN] == at.RING:
        _end_start(state)
    else:
        _replay(state, np.ones(at.RING, dtype=np.bool_))


@njit(cache=True, nogil=True, error_model="numpy")
def _again(state, cell, before):
    """Go over a reading of the ring once more: what it covers and where it stands in the ring."""
    cover(state, way_of(state, cell[0] - before[0]))
    state[at.TRAVEL] = cell[3]
    _remember(state, cell[0], cell[1])
    state[at.SEEN] += 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _since_moved(state):
    """The latest readings from that one on since which refused ones outnumber the others by most; oldest first."""
    cells, newest = ring(state), int(state[at.SEEN]) - 1
    best, balance, length = -at.RING, 0, 1
    for k in range(at.RING):
        balance += 1 if cells[(newest - k) % at.RING, 2] != 0.0 else -1
        if balance >= best:
            best, length = balance, k + 1
    out = np.empty((length, at.CELL))
    for k in range(length):
        out[k] = cells[(newest - length + 1 + k) % at.RING]
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def carry_radius(state, moved):
    """Keep the radius and the noise as known beforehand; when the part has moved, those of some readings before."""
    if moved:
        if state[at.SEEN] <= 2.0 * at.RING:
            return
        block(state, 0, 3)[:] = block(state, 6, 3)
    judge(state)
    # the quantile is in it: what is told by few readings would else be used as if the noise were known
    reach = state[at.REACH] / known_quantile(state)
    sd = reach * np.sqrt(state[at.SHAPE]) * state[at.INFLATION] + state[at.FORM_BOUND]
    if state[at.FREEDOM] < 1.0 or not sd > 0.0 or not _tells_radius(state):
        return
    state[at.PRIOR_RADIUS], state[at.PRIOR_SD] = state[at.RADIUS] + state[at.TIP], sd
    state[at.PRIOR_NOISE], state[at.PRIOR_FREEDOM] = state[at.FIT_NOISE], min(state[at.FREEDOM], 10.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _tells_radius(state):
    """Whether a judged radius comes of the way turned: rows hold the readings, and those of a spindle that stands differ too.

    Noise s in m rows adds m (s/R)^2 to the information 1/shape of the radius. Differences of readings bound s from above.
    """
    if not holds_axis(state):
        return False
    radius = state[at.RADIUS] + state[at.TIP]
    noise = np.sqrt(0.5 * state[at.LAG + 15] * state[at.SHAPE]) * state[at.REFERENCE] / radius
    return state[at.LIMACON] != 0.0 or state[at.COVERED] >= np.pi or noise <= _OWN_NOISE * radius


@njit(cache=True, nogil=True, error_model="numpy")
def run(state, angle, reading, start, until_valid):
    """Take readings from one on, up to the first that is not simply taken or, if so wanted, makes the estimate sure enough.

    Returns how many there were by then, what became of the last, and whether it was wanted and made it so.
    """
    array, row = block(state, 0, 3), block(state, 15, 1)[0]
    for i in range(start, angle.shape[0]):
        code = _take(state, array, row, angle[i], reading[i])
        valid = until_valid and code >= TAKEN and valid_now(state)
        if code != TAKEN or valid:
            return i + 1, code, valid
    return angle.shape[0], TAKEN, False
