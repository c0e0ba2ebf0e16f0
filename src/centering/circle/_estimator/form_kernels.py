"""Separation of form from noise over whole turns: low undulations are form, the next ones show the noise.

Lobes of 2 or more upr do not move the centre over whole turns, yet they look like correlated noise. Each turn
is fitted with the circle, lobes of 2 to 5 upr and four more pairs of waves from 6 upr on (without the named
form). The squares of these four give the noise at about 7 upr; the centre is moved by noise at 1 upr. For
AR(1) noise of spectrum 1/(x + w^2) the latter is larger by a factor, with x from the differences of
successive readings; at most about 100, for a random walk. The factor uses `_MARGIN` times the noise at 7 upr,
as its 8 squares a turn may be small by chance. Rows are averaged over blocks of a few degrees before they
enter the normal equations.
"""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._fit.cholesky_kernels import _cholesky
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.identify.kernels import back_substitute

_BLOCK = np.pi / 30  # chosen: rad; six degrees are less than a sixth of an undulation of 9 upr
_TURN = 2.0 * np.pi * (1.0 - 1e-6)
_FLAT = 1.02  # derived: wave at the middle of a block over its mean in the block, up to 5 upr
_MARGIN = 10.0  # chosen: factor on the noise at 7 upr, whose few squares may be small by chance
_MIDDLE = 7.4  # derived: upr; inverse root of the mean of 1/n^2 over 6 to 9
_WALK = 2.0  # derived: excess of a random walk at 1 upr over 1/n^2, as start and end of the turn differ


@compiled(error_model="numpy")
def _square(state, begin):
    """View of one of the arrays of normal equations."""
    return state[begin : begin + at.SIDE * at.SIDE].reshape((at.SIDE, at.SIDE))


@compiled(error_model="numpy")
def _in_first_turn(state):
    """Whether no whole turn has been seen; for readings too coarse to separate form, by the arc covered."""
    return state[at.TURNS] == 0.0 and state[at.COVERED] < _TURN


@compiled(error_model="numpy")
def _gather(state, h0, h1, h2, target, way):
    """Add an unweighted row to its block; `way` is the angle travelled."""
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
    """Add the block to the normal equations of its turn."""
    _add_block(state, _square(state, at.TURN))
    state[at.TURN_COUNT] += state[at.BLOCK_COUNT]
    state[at.BLOCK_COUNT] = 0.0
    state[at.BLOCK_SUM : at.BLOCK_SUM + 4] = 0.0


@compiled(error_model="numpy")
def _add_block(state, array):
    """Add the present block to normal equations: mean row and waves at its middle, times root count."""
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
        for j in range(i // 4 * 4, at.SIDE):  # from the diagonal on, in fours: full vector registers
            array[i, j] += first * vector[j]


@compiled(error_model="numpy")
def _write_waves(state, x, y, vector):
    """Write cosines and sines of the fitted waves in direction (x, y), times the vector's first entry."""
    away = np.sqrt(x * x + y * y)
    c, s = x / away, y / away
    cosine, sine, upr, column = c * vector[0], s * vector[0], 1, 3
    for n in range(at.WAVES):
        while upr < int(state[at.WAVES_AT + n]):  # at most int(state[at.WAVES_AT + n])
            cosine, sine = cosine * c - sine * s, sine * c + cosine * s
            upr += 1
        vector[column], vector[column + 1] = cosine, sine
        column += 2


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _end_turn(state):
    """Store the result of a turn on form and noise, if its readings lie all around."""
    if state[at.BLOCK_COUNT] > 0.0:
        _end_block(state)
    turn, total, last = _square(state, at.TURN), _square(state, at.TOTAL), at.SIDE - 1
    left = np.exp(state[at.LOG_FORGETTING] * 2.0 * np.pi)
    for i in range(at.SIDE):
        for j in range(at.SIDE):
            total[i, j] = total[i, j] * left + turn[i, j]
    if _cholesky(turn, last):
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
    """Noise that moves the centre (sd); `differences` is half the mean square of differences."""
    low = state[at.LOW_SQUARES] / (at.ABOVE * state[at.TURNS])
    each = state[at.PATH] / state[at.MOVES]
    quick = max(differences - 0.5 * state[at.FORM_SQUARES] / state[at.TOLD_COUNT], 0.0)
    first = each * each
    middle = _MIDDLE**2 * first
    x = max(2.0 * quick / (_MARGIN * low) - middle, 0.0) if low > 0.0 else 0.0  # guard
    return np.sqrt(low * (x + _WALK * middle) / (x + first))


@compiled(error_model="numpy")
def _moved_by_form(state):
    """Shift of the centre by lobes of 2 to 5 upr at fitted amplitudes, over the ratio, mm."""
    array, size, last = np.empty((at.SIDE, at.SIDE)), at.CIRCLE_AND_FORM, at.SIDE - 1
    for n in range(at.SIDE * at.SIDE):
        array[n // at.SIDE, n % at.SIDE] = state[at.TOTAL + n] + state[at.TURN + n]
    if state[at.BLOCK_COUNT] > 0.0:
        _add_block(state, array)
    if not _cholesky(array, size):  # guard
        return np.inf
    with_form, without = np.empty(size), np.empty(3)
    back_substitute(array, last, with_form)
    back_substitute(array, last, without)
    return _FLAT * np.hypot(with_form[1] - without[1], with_form[2] - without[2])
