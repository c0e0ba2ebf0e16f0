"""Whether the part has moved by less than one reading can tell: the latest readings as a whole against those before. Compiled.

A move d of the centre at one radius changes the values (q, x, y) by D d. Of the triangle of now, with value b, and an older one
R, q0 (of the readings before a window of the latest), the information about d alone, all values being free, is
I = D'(A - A N^-1 A) D, A = R'R, N that of all readings, and its score e = D'(A b - R'q0): e'I^-1 e is what squares of residuals
lose by the move, of two degrees of freedom. It is set against the noise of the readings and, as form, drift and slow noise make
it more, after a turn against what such looks have found before. Over less than a turn form is not told from a move, unless it is
given: what is more than white noise then makes the readings doubtful until the next look or the whole turn.
"""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.noise_kernels import _arrays, _copy, _differences, _freedom_of, _inflation_of
from centering.circle._estimator.turn_kernels import _in_first_turn
from centering.circle._fit.solve_kernels import _back
from sdpgrind.base.compiled import compiled

_RARE = 13.815510557964274  # of a look, where nothing has moved, 1e-6; logarithm of its inverse
_DOUBTFUL = 4.605170185988092  # the same of 1e-2: a doubt costs little, as the next look may end it
_ARC = 0.1  # rad: least arc before the window
_TOLD = 1e-6  # least information about a direction of the move, in that about the other,
_ROUNDED = 1e-9  # and in that of the readings before
_MANY_LOOKS = 8.0  # from which on they tell
_TURN = 2.0 * np.pi * (1.0 - 1e-6)
_QUIET = 1e-11  # least noise, in largest readings


@compiled(error_model="numpy")
def _keep(state, array):
    """Every 30 readings keep the triangle and its sums; the older of two is of before any reading in the ring."""
    younger = _arrays(state)[3:6]
    _copy(younger, _arrays(state)[6:9])
    _copy(array, younger)
    for k in range(at.KEPT_SIZE):
        state[at.KEPT + at.KEPT_SIZE + k] = state[at.KEPT + k]
    for k in range(at.SUMS):
        state[at.KEPT + k] = state[at.SUM + k]
    state[at.KEPT + at.KEPT_WAY], state[at.KEPT + at.KEPT_COVERED] = state[at.TRAVEL], state[at.COVERED]


@compiled(error_model="numpy")
def _older(state, window):
    """The older triangle of a window, where the sums are that were kept with it, and the weight left to both."""
    kept = at.KEPT + at.KEPT_SIZE * window
    begin = 3 + 3 * window
    left = np.exp(state[at.LOG_FORGETTING] * (state[at.TRAVEL] - state[kept + at.KEPT_WAY]))
    return _arrays(state)[begin : begin + 3], kept, left


@compiled(error_model="numpy")
def _write_score(triangle, left, value, info, score):
    """Write the information A of an older triangle, and A b - R'q0."""
    for i in range(3):
        score[i] = 0.0
        for j in range(3):
            info[i, j] = 0.0
    for k in range(3):
        rest = -triangle[k, 3]
        for j in range(k, 3):
            rest += triangle[k, j] * value[j]
        for i in range(k, 3):
            score[i] += left * triangle[k, i] * rest
            for j in range(k, 3):
                info[i, j] += left * triangle[k, i] * triangle[k, j]


@compiled(error_model="numpy")
def _without_values(array, info, across):
    """Take off from an information A what all values being free costs: A N^-1 A, by substitution through the triangle of N."""
    for k in range(3):
        for j in range(3):
            rest = info[k, j]
            for i in range(k):
                rest -= array[i, k] * across[i, j]
            across[k, j] = rest / array[k, k]
    for i in range(3):
        for j in range(3):
            for k in range(3):
                info[i, j] -= across[k, i] * across[k, j]


@compiled(error_model="numpy")
def _found_move(state, array, value, triangle, left):
    """Move (x, y) between an older triangle and that of now, of the value given, and what it explains of the squares."""
    info, across, score = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    _write_score(triangle, left, value, info, score)
    largest = info[0, 0]
    _without_values(array, info, across)
    x, y = -value[1] * state[at.PER_REFERENCE], -value[2] * state[at.PER_REFERENCE]
    return _move(
        info[1, 1] + 2.0 * x * info[0, 1] + x * x * info[0, 0],
        info[1, 2] + x * info[0, 2] + y * info[0, 1] + x * y * info[0, 0],
        info[2, 2] + 2.0 * y * info[0, 2] + y * y * info[0, 0],
        score[1] + x * score[0],
        score[2] + y * score[0],
        largest,
    )


@compiled(error_model="numpy")
def _move(a, b, c, x, y, largest):
    """Move (x, y) by its score and the information ((a, b), (b, c)), as far as it is told, and the squares that it explains."""
    half = np.hypot(0.5 * (a - c), b)
    more = 0.5 * (a + c) + half
    less = 0.5 * (a + c) - half
    if more <= _ROUNDED * largest:
        return 0.0, 0.0, 0.0
    first, second = (more - c, b) if a >= c else (b, more - a)
    length = np.hypot(first, second)
    first, second = (first / length, second / length) if length > 0.0 else (1.0, 0.0)
    along, across = first * x + second * y, first * y - second * x
    one = along / more
    other = across / less if less > _TOLD * more + _ROUNDED * largest else 0.0
    return one * first - other * second, one * second + other * first, one * along + other * across


@compiled(error_model="numpy")
def _find(state, array, value, window):
    """What a move within a window explains of the squares; -1 where too little was seen before it."""
    triangle, kept, left = _older(state, window)
    if state[kept + at.KEPT_COVERED] < max(state[at.GATE_FROM], _ARC) or state[kept] <= 3.0:
        return -1.0
    return _found_move(state, array, value, triangle, left)[2]


@compiled(error_model="numpy")
def _is_move(state, found, window, lagged, rounding):
    """Whether what a window explains is more than noise, form and drift make of it."""
    _, kept, left = _older(state, window)
    looks, size = at.LOOKS + at.LOOK_SIZE * window, max(state[at.WEIGHT] - left * state[kept], 0.0)
    if state[looks] >= _MANY_LOOKS and state[kept + at.KEPT_COVERED] >= _TURN:
        variance, freedom = _as_before(state, looks, found)
    else:
        variance, freedom = _as_told(state, found, lagged, rounding)
    root = max(np.sqrt(found) - state[at.FORM_GATE] * state[at.RATIO] * np.sqrt(size), 0.0)
    return _is_rare(root * root, variance, freedom, _RARE)


@compiled(error_model="numpy")
def _is_doubtful(state, found):
    """Whether it is more than white noise makes of it."""
    freedom = state[at.WEIGHT] - 5.0
    return _is_rare(found, _variance(state, state[at.SQUARES] - found, freedom), freedom, _DOUBTFUL)


@compiled(error_model="numpy")
def _is_rare(found, variance, freedom, rare):
    """Whether squares of two degrees of freedom are more than F allows."""
    return freedom >= 1.0 and found > variance * freedom * np.expm1(2.0 * rare / freedom)


@compiled(error_model="numpy")
def _variance(state, squares, freedom):
    """Variance of a reading, not below the least."""
    least = max(state[at.NOISE], _QUIET * state[at.LARGEST]) * state[at.RATIO]
    return max(squares / freedom, least * least)


@compiled(error_model="numpy")
def _as_before(state, looks, found):
    """After a turn: variance of what looks find where nothing has moved, and its degrees of freedom, as those before have it."""
    freedom = state[at.WEIGHT] - 5.0
    variance = _variance(state, state[at.SQUARES] - found, freedom)
    before = 0.5 * state[looks + 1] / state[looks]
    if before > variance * (1.0 + 2.0 / np.sqrt(state[looks])):
        return before, 2.0 * state[looks]
    return max(variance, before), freedom


@compiled(error_model="numpy")
def _form_is_given(state):
    return state[at.FORMS] + state[at.KNOWN] > 0.0


@compiled(error_model="numpy")
def _as_told(state, found, lagged, rounding):
    """Before: the same as the residuals and their correlation have it, if form is given; else nothing is known (0 degrees)."""
    if not _form_is_given(state):
        return 0.0, 0.0
    squares, weight = state[at.SQUARES] - found, state[at.WEIGHT] - 2.0
    inflation = _inflation_of(state, squares, weight, lagged, rounding)
    return _variance(state, squares, weight - 3.0) * inflation * inflation, _freedom_of(weight, inflation)


@compiled(error_model="numpy")
def _remember(state, looks, found):
    """Keep what a look has found; it is compared with when the next two looks are over, as it may be the begin of a move."""
    if state[looks + 3] > 0.0:
        state[looks] += 1.0
        state[looks + 1] += state[looks + 3]
    state[looks + 3], state[looks + 2] = state[looks + 2], found


@compiled(error_model="numpy")
def _has_moved(state, array):
    """Look at the latest 30 readings, and every other time at the latest 60; write whether they are doubtful."""
    value = np.empty(3)
    _back(array, 3, value)
    lagged, rounding = _differences(state, value)
    doubt, state[at.DOUBT] = not _form_is_given(state) and _in_first_turn(state), 0.0
    both = int(state[at.SEEN]) // at.RING % 2 == 0
    for window in range(2 if both or doubt else 1):
        found = _find(state, array, value, window)
        if found < 0.0:
            continue
        if doubt:
            state[at.DOUBT] = max(state[at.DOUBT], 1.0 * _is_doubtful(state, found))
        elif _is_move(state, found, window, lagged, rounding):
            return True
        if window == 0 or both:
            _remember(state, at.LOOKS + at.LOOK_SIZE * window, found)
    return False


@compiled(error_model="numpy")
def _move_by(state, value):
    """Move within the latest 60 readings (of 30 where there are no more before); into `value` what was before it."""
    triangle, _, left = _older(state, 1 if state[at.KEPT + at.KEPT_SIZE] > 3.0 else 0)
    array, now = _arrays(state)[:3], np.empty(3)
    _back(array, 3, now)
    _back(triangle, 3, value)
    x, y, _ = _found_move(state, array, now, triangle, left)
    return x, y
