"""What a whole turn tells of form and noise apart: lobes of few undulations go to form, the next ones show the noise. Compiled.

Lobes of 2 and more undulations do not move the centre over whole turns, yet they look like noise that is correlated. So each turn
is fitted with the circle, the lobes of 2 to 5 upr and four pairs of waves more, from 6 upr on; form that was named is left out of
these. Their squares are the noise at some 7 upr; no form of the first kind is in them. The centre is moved by noise at 1 upr.
That is more by a factor K^2 if noise is correlated: of AR(1), spectrum 1/(x + w^2), with x from what differences of successive
readings say of it; at most, where noise walks at random, some 100. The factor is reckoned from 5 times the noise at 7 upr, as its
8 squares a turn may be few by chance. Rows are summed over blocks of some degrees and only these go into the normal equations.
"""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._fit.solve_kernels import _back, _triangle
from sdpgrind.base.compiled import compiled

_BLOCK = np.pi / 30  # rad: six degrees hold less than a sixth of an undulation of 9 upr
_TURN = 2.0 * np.pi * (1.0 - 1e-6)
_FLAT = 1.02  # as waves at the middle of a block are more than their mean over it, up to 5 upr
_MARGIN = 10.0
_MIDDLE = 7.4  # upr: inverse root of the mean of 1/n^2 over 6 to 9
_WALK = 2.0  # noise that walks at random has so much more at 1 upr than 1/n^2 says: begin and end of the turn differ


@compiled(error_model="numpy")
def _square(state, begin):
    """One of the arrays of normal equations."""
    return state[begin : begin + at.SIDE * at.SIDE].reshape((at.SIDE, at.SIDE))


@compiled(error_model="numpy")
def _in_first_turn(state):
    """Whether no whole turn has been seen; of readings so coarse that none tells form from noise, what they cover counts."""
    return state[at.TURNS] == 0.0 and state[at.COVERED] < _TURN


@compiled(error_model="numpy")
def _gather(state, h0, h1, h2, target, way):
    """Add a row, not yet weighed, to its block; `way` is what had been travelled by then."""
    if state[at.BLOCK_COUNT] > 0.0 and way - state[at.BLOCK_BEGIN] >= _BLOCK:
        _end_block(state)
    if way - state[at.TURN_BEGIN] >= _TURN:
        _end_turn(state)
        state[at.TURN_BEGIN] = way
    if state[at.BLOCK_COUNT] == 0.0:
        state[at.BLOCK_BEGIN] = way
        if state[at.TURN_COUNT] == 0.0:
            state[at.TURN_BEGIN] = way
    state[at.BLOCK_COUNT] += 1.0
    state[at.BLOCK_SUM] += h0
    state[at.BLOCK_SUM + 1] += h1
    state[at.BLOCK_SUM + 2] += h2
    state[at.BLOCK_SUM + 3] += target


@compiled(error_model="numpy")
def _end_block(state):
    """Take the block into the normal equations of its turn."""
    _add_block(state, _square(state, at.TURN))
    state[at.TURN_COUNT] += state[at.BLOCK_COUNT]
    state[at.BLOCK_COUNT] = 0.0
    state[at.BLOCK_SUM : at.BLOCK_SUM + 4] = 0.0


@compiled(error_model="numpy")
def _add_block(state, array):
    """Add the block of now to normal equations: its mean row, and waves at its middle, by the root of its readings."""
    total, vector = state[at.BLOCK_SUM : at.BLOCK_SUM + 4], state[at.VECTOR : at.VECTOR + at.SIDE]
    weight = 1.0 / np.sqrt(state[at.BLOCK_COUNT])
    for i in range(3):
        vector[i] = weight * total[i]
    vector[at.SIDE - 1] = weight * total[3]
    x, y = total[1] / total[0], total[2] / total[0]
    if state[at.LIMACON] == 0.0:
        x, y = state[at.REFERENCE] * x - state[at.CENTER_X], state[at.REFERENCE] * y - state[at.CENTER_Y]
    _write_waves(state, x, y, vector)
    for i in range(at.SIDE):
        first = vector[i]
        for j in range(i // 4 * 4, at.SIDE):  # from the diagonal on, in fours: whole registers
            array[i, j] += first * vector[j]


@compiled(error_model="numpy")
def _write_waves(state, x, y, vector):
    """Cosines and sines of 2 to 5 upr and of the four after these, in the direction (x, y), times the first of the vector."""
    away = np.sqrt(x * x + y * y)
    c, s = x / away, y / away
    cosine, sine, upr, column = c * vector[0], s * vector[0], 1, 3
    for n in range(at.WAVES):
        while upr < int(state[at.WAVES_AT + n]):
            cosine, sine = cosine * c - sine * s, sine * c + cosine * s
            upr += 1
        vector[column], vector[column + 1] = cosine, sine
        column += 2


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _end_turn(state):
    """Keep what a turn says of form and noise, if its readings lie all around."""
    if state[at.BLOCK_COUNT] > 0.0:
        _end_block(state)
    turn, total, last = _square(state, at.TURN), _square(state, at.TOTAL), at.SIDE - 1
    left = np.exp(state[at.LOG_FORGETTING] * 2.0 * np.pi)
    for i in range(at.SIDE):
        for j in range(at.SIDE):
            total[i, j] = total[i, j] * left + turn[i, j]
    if _triangle(turn, last):
        step, low, waves = state[at.PATH] / state[at.MOVES], 0.0, 0.0
        for i in range(at.CIRCLE_AND_FORM, last):
            low += turn[i, last] ** 2
        for i in range(3, at.CIRCLE_AND_FORM):
            waves += turn[i, last] ** 2 * (2.0 - 2.0 * np.cos(step * (2 + (i - 3) // 2)))
        state[at.LOW_SQUARES] = left * state[at.LOW_SQUARES] + low
        state[at.FORM_SQUARES] = left * state[at.FORM_SQUARES] + waves
        state[at.TOLD_COUNT] = left * state[at.TOLD_COUNT] + state[at.TURN_COUNT]
        state[at.TURNS] = left * state[at.TURNS] + 1.0
    turn[:] = 0.0
    state[at.TURN_COUNT] = 0.0


@compiled(error_model="numpy")
def _long_noise(state, differences):
    """Sd of the noise that moves the centre, as of independent readings; `differences` is half their mean square."""
    low = state[at.LOW_SQUARES] / (at.ABOVE * state[at.TURNS])
    each = state[at.PATH] / state[at.MOVES]
    quick = max(differences - 0.5 * state[at.FORM_SQUARES] / state[at.TOLD_COUNT], 0.0)
    first = each * each
    middle = _MIDDLE**2 * first
    x = max(2.0 * quick / (_MARGIN * low) - middle, 0.0) if low > 0.0 else 0.0
    return np.sqrt(low * (x + _WALK * middle) / (x + first))


@compiled(error_model="numpy")
def _moved_by_form(state):
    """How far lobes of 2 to 5 upr, as large as they are found, move the centre of all readings, over the ratio, mm."""
    array, size, last = np.empty((at.SIDE, at.SIDE)), at.CIRCLE_AND_FORM, at.SIDE - 1
    for n in range(at.SIDE * at.SIDE):
        array[n // at.SIDE, n % at.SIDE] = state[at.TOTAL + n] + state[at.TURN + n]
    if state[at.BLOCK_COUNT] > 0.0:
        _add_block(state, array)
    if not _triangle(array, size):
        return np.inf
    with_form, without = np.empty(size), np.empty(3)
    _back(array, last, with_form)
    _back(array, last, without)
    return _FLAT * np.hypot(with_form[1] - without[1], with_form[2] - without[2])
