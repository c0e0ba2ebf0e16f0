"""Test for a small move of the part: the latest readings as a whole against those before.

A move d of the centre at constant radius changes the values (q, x, y) by D d. With the present value b, an
older triangle R, q0 (of the readings before a window), A = R'R and N the information of all readings, the
information on d with all values free is I = D'(A - A N^-1 A) D and its score e = D'(A b - R'q0); e'I^-1 e, of
two degrees of freedom, is the sum of squares that the move explains. It is compared with the noise of the
readings and, after a turn, with the results of earlier looks, which include form, drift and slow noise. Over
less than a turn form and move cannot be separated unless the form is given: what exceeds white noise then
makes the readings doubtful until the next look or the whole turn.
"""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.form_kernels import _in_first_turn
from centering.circle._estimator.noise_kernels import _arrays, _copy, _differences, _freedom_of, _inflation_of
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.identify.kernels import back_substitute

_RARE = 13.815510557964274  # chosen: -log(1e-6), false alarms of a look without a move
_DOUBTFUL = 4.605170185988092  # chosen: -log(0.01); a doubt costs little, as the next look may end it
_ARC = 0.1  # chosen: rad; least arc before the window
_TOLD = 1e-6  # chosen: least information on one direction of the move, relative to the other
_ROUNDED = 1e-9  # chosen: least information on a move, relative to the readings before; less is rounding
_MANY_LOOKS = 8.0  # chosen: looks from which on their mean is used as a variance
_TURN = 2.0 * np.pi * (1.0 - 1e-6)
_QUIET = 1e-11  # chosen: least noise, relative to the largest reading, above rounding


@compiled(error_model="numpy")
def _keep(state, array):
    """Store the triangle and its sums every 30 readings; the older of two precedes the ring buffer."""
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
    """Stored triangle of a window, place of its sums, and the weight that forgetting leaves to both."""
    kept = at.KEPT + at.KEPT_SIZE * window
    begin = 3 + 3 * window
    left = np.exp(state[at.LOG_FORGETTING] * (state[at.TRAVEL] - state[kept + at.KEPT_WAY]))
    return _arrays(state)[begin : begin + 3], kept, left


@compiled(error_model="numpy")
def _write_score(triangle, left, value, info, score):
    """Write the information A of a stored triangle, and A b - R'q0."""
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
    """Subtract A N^-1 A from A, in place: the information lost to the free values."""
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
    """Move (x, y) between a stored triangle and the present one, and the sum of squares it explains."""
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
    """Move (x, y) and explained squares from the score (x, y) and the information ((a, b), (b, c))."""
    half = np.hypot(0.5 * (a - c), b)
    more = 0.5 * (a + c) + half
    less = 0.5 * (a + c) - half
    if more <= _ROUNDED * largest:  # guard
        return 0.0, 0.0, 0.0
    first, second = (more - c, b) if a >= c else (b, more - a)
    length = np.hypot(first, second)
    first, second = (first / length, second / length) if length > 0.0 else (1.0, 0.0)  # guard
    along, across = first * x + second * y, first * y - second * x
    one = along / more
    other = across / less if less > _TOLD * more + _ROUNDED * largest else 0.0  # guard
    return one * first - other * second, one * second + other * first, one * along + other * across


@compiled(error_model="numpy")
def _explained_by_move(state, array, value, window):
    """Sum of squares explained by a move within a window; -1 where too little was seen before the window."""
    triangle, kept, left = _older(state, window)
    if state[kept + at.KEPT_COVERED] < max(state[at.GATE_FROM], _ARC) or state[kept] <= 3.0:
        return -1.0
    return _found_move(state, array, value, triangle, left)[2]


@compiled(error_model="numpy")
def _is_move(state, found, window, lagged, rounding):
    """Whether the sum of squares explained in a window exceeds noise, form and drift."""
    _, kept, left = _older(state, window)
    looks, size = at.LOOKS + at.LOOK_SIZE * window, max(state[at.WEIGHT] - left * state[kept], 0.0)
    if state[looks] >= _MANY_LOOKS and state[kept + at.KEPT_COVERED] >= _TURN:
        variance, freedom = _noise_of_looks(state, looks, found)
    else:
        variance, freedom = _noise_of_residuals(state, found, lagged, rounding)
    root = max(np.sqrt(found) - state[at.FORM_GATE] * state[at.RATIO] * np.sqrt(size), 0.0)
    return _is_rare(root * root, variance, freedom, _RARE)


@compiled(error_model="numpy")
def _is_doubtful(state, found):
    """Whether an explained sum of squares exceeds white noise."""
    freedom = state[at.WEIGHT] - 5.0
    return _is_rare(found, _variance(state, state[at.SQUARES] - found, freedom), freedom, _DOUBTFUL)


@compiled(error_model="numpy")
def _is_rare(found, variance, freedom, rare):
    """Whether a sum of squares of two degrees of freedom exceeds the F quantile."""
    return freedom >= 1.0 and found > variance * freedom * np.expm1(2.0 * rare / freedom)


@compiled(error_model="numpy")
def _variance(state, squares, freedom):
    """Variance of a reading, at least the least one."""
    least = max(state[at.NOISE], _QUIET * state[at.LARGEST]) * state[at.RATIO]
    return max(squares / freedom, least * least)


@compiled(error_model="numpy")
def _noise_of_looks(state, looks, found):
    """Variance and degrees of freedom of a look without a move, from the looks before."""
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
def _noise_of_residuals(state, found, lagged, rounding):
    """Variance and degrees of freedom before a turn, from correlated residuals; 0, 0 without a given form."""
    if not _form_is_given(state):
        return 0.0, 0.0
    squares, weight = state[at.SQUARES] - found, state[at.WEIGHT] - 2.0
    inflation = _inflation_of(state, squares, weight, lagged, rounding)
    return _variance(state, squares, weight - 3.0) * inflation * inflation, _freedom_of(weight, inflation)


@compiled(error_model="numpy")
def _remember(state, looks, found):
    """Store the result of a look; it is used two looks later, as it may be the start of a move."""
    if state[looks + 3] > 0.0:
        state[looks] += 1.0
        state[looks + 1] += state[looks + 3]
    state[looks + 3], state[looks + 2] = state[looks + 2], found


@compiled(error_model="numpy")
def _has_moved(state, array):
    """Whether the part moved within the latest 30 or, at every other call, 60 readings; writes DOUBT."""
    value = np.empty(3)
    back_substitute(array, 3, value)
    lagged, rounding = _differences(state, value)
    doubt, state[at.DOUBT] = not _form_is_given(state) and _in_first_turn(state), 0.0
    both = int(state[at.SEEN]) // at.RING % 2 == 0
    for window in range(2 if both or doubt else 1):
        found = _explained_by_move(state, array, value, window)
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
    """Move (x, y) within the latest 60 readings (30 where no more exist); write the value before it."""
    triangle, _, left = _older(state, 1 if state[at.KEPT + at.KEPT_SIZE] > 3.0 else 0)
    array, now = _arrays(state)[:3], np.empty(3)
    back_substitute(array, 3, now)
    back_substitute(triangle, 3, value)
    x, y, _ = _found_move(state, array, now, triangle, left)
    return x, y
