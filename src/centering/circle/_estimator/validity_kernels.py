"""Uncertainty of a fit: triangle of all readings with prior knowledge, covariance, band and tolerance.

The values of the triangle are (q, x, y): the centre, and q = (R^2 - d^2 - r0^2)/(2 r0), r0 the first reading
(all with the tip), in which the exact curve is linear; for the limacon q = R - r0.
"""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.form_kernels import _in_first_turn
from centering.circle._estimator.noise_kernels import (
    _arrays,
    _copy,
    _known_quantile,
    _quantile,
    _write_covariance,
    _write_noise,
)
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.compiling.uncounted import uncounted
from sdpgrind.identify.kernels import back_substitute, rotate

_FAR = 100.0  # chosen: prior standard deviation of the centre, in largest readings; it bounds the covariance
_NOTHING = 1e-6  # chosen: weight of this prior, relative to the least pivot, whose square is rounding
_QUIET = 1e-10  # chosen: least noise in the weight of a prior, relative to the largest reading
LEAST_RATIO, MOST_RATIO = 0.5, 20.0
"""Radius over the first reading; the noise of the triangle is that of a reading times this. Derived: offsets
up to 0.95 radii."""
_STEPS = 12  # chosen: Gauss-Newton steps with a radius prior, at most
_ENOUGH = 8.0  # chosen: readings from which on the bias is corrected; earlier the noise is too uncertain
_REPEATED = 0.25  # chosen: share of repeated readings from which on rounding counts as noise
_CLOSE = 1e-14  # chosen: step relative to the largest reading that is rounding
_TURN = 2.0 * np.pi


@compiled(error_model="numpy")
def _weighing_noise(state, ratio):
    """Noise that weighs prior knowledge: pooled with the fits before, at least the least noise."""
    freedom, before = max(state[at.WEIGHT] - 3.0, 0.0), state[at.PRIOR_FREEDOM]
    total = freedom + before
    squares = state[at.SQUARES] + before * (ratio * state[at.PRIOR_NOISE]) ** 2
    pooled = np.sqrt(squares / total) if total > 0.0 else 0.0
    return max(pooled, ratio * state[at.NOISE], ratio * _QUIET * state[at.LARGEST])


@compiled(error_model="numpy")
def _with_center(state, array, value, weighing):
    """Add a wide prior of the centre, unless its weight is rounding; it bounds any covariance."""
    row, weight = _arrays(state)[15], weighing / (_FAR * state[at.LARGEST])
    if weight <= _NOTHING * min(array[0, 0], array[1, 1], array[2, 2]):
        return
    for i in range(3):
        row[:] = 0.0
        row[i] = weight
        rotate(array, row)
    back_substitute(array, 3, value)


@compiled(error_model="numpy")
def _radius(state, value):
    """Radius with the tip, mm."""
    start = state[at.REFERENCE]
    if state[at.LIMACON] != 0.0:
        return start + value[0]
    square = start * start + 2.0 * start * value[0] + value[1] ** 2 + value[2] ** 2
    return np.sqrt(max(square, 1e-12 * start * start))


@compiled(error_model="numpy")
def _ratio_of(state, value):
    """Noise of the triangle over that of a reading."""
    if state[at.LIMACON] != 0.0:
        return 1.0
    radius = state[at.PRIOR_RADIUS] if state[at.PRIOR_SD] > 0.0 else _radius(state, value)
    return min(max(radius / state[at.REFERENCE], LEAST_RATIO), MOST_RATIO)


@compiled(error_model="numpy")
def _radius_row(state, value, row):
    """Write the derivatives of the radius by (q, x, y)."""
    if state[at.LIMACON] != 0.0:
        row[0], row[1], row[2] = 1.0, 0.0, 0.0
        return
    radius = _radius(state, value)
    row[0], row[1], row[2] = state[at.REFERENCE] / radius, value[1] / radius, value[2] / radius


@compiled(error_model="numpy")
def _with_radius(state, array, value, weighing, room):
    """Add the prior of the radius, one nonlinear row, by Gauss-Newton steps."""
    weight = weighing / state[at.PRIOR_SD]
    row, start = _arrays(state)[15], state[at.REFERENCE]
    if state[at.LIMACON] == 0.0:  # start at the known radius: two circles may fit a short arc
        value[0] = (state[at.PRIOR_RADIUS] ** 2 - start**2) / (2.0 * start)
        value[1] = value[2] = 0.0
    for _ in range(_STEPS):
        _copy(array, room)
        row[:] = 0.0
        _radius_row(state, value, row)
        row[3] = state[at.PRIOR_RADIUS] - _radius(state, value)
        for i in range(3):
            row[3] += row[i] * value[i]
        for k in range(4):
            row[k] *= weight
        rotate(room, row)
        before_x, before_y = value[1], value[2]
        back_substitute(room, 3, value)
        if abs(value[1] - before_x) + abs(value[2] - before_y) <= _CLOSE * state[at.LARGEST]:
            break
    _copy(room, array)


@compiled(error_model="numpy")
def _conclude(state, array, room, value, information):
    """Write values (q, x, y) and covariance from a triangle, changed in place, and prior knowledge."""
    back_substitute(array, 3, value)
    weighing = _weighing_noise(state, _ratio_of(state, value))
    _with_center(state, array, value, weighing)
    if state[at.PRIOR_SD] > 0.0:
        _with_radius(state, array, value, weighing, room)
    _write_covariance(array, information)
    if state[at.LIMACON] == 0.0 and state[at.WEIGHT] > _ENOUGH:
        _without_bias(state, value, information)


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _without_bias(state, value, information):
    """Subtract the bias of the values by squared noise: rows contain the readings with their noise."""
    ratio = _ratio_of(state, value)
    scale = state[at.SQUARES] / (state[at.WEIGHT] - 3.0) / ratio
    first = scale * state[at.BIAS] / ratio
    second = scale * (state[at.BIAS + 1] / ratio + state[at.BIAS + 3])
    third = scale * (state[at.BIAS + 2] / ratio + state[at.BIAS + 4])
    for i in range(3):
        value[i] -= information[i, 0] * first + information[i, 1] * second + information[i, 2] * third


@compiled(error_model="numpy")
def _worst(a, b, c):
    """Root of the largest eigenvalue of ((a, b), (b, c))."""
    half = 0.5 * (a - c)
    return np.sqrt(0.5 * (a + c) + np.sqrt(half * half + b * b))


@compiled(error_model="numpy")
def _form_bound(state, array):
    """Greatest error of the centre by the assumed lobes, each in its worst phase, over the ratio, mm."""
    if state[at.FORMS] == 0.0:
        return 0.0
    value, other, total = np.empty(3), np.empty(3), 0.0
    for n in range(int(state[at.FORMS])):
        back_substitute(array, 4 + 2 * n, value)
        back_substitute(array, 5 + 2 * n, other)
        a = value[1] ** 2 + other[1] ** 2
        b = value[1] * value[2] + other[1] * other[2]
        c = value[2] ** 2 + other[2] ** 2
        total += _worst(a, b, c) * state[at.TAIL + 2 * n + 1]
    return total


@compiled(error_model="numpy")
def judge(state, least):
    """Fit with prior knowledge and write the result; return whether it is valid over at least this arc."""
    if state[at.WEIGHT] <= 0.0 or state[at.COVERED] < least:  # guard
        return False
    state = uncounted(state)
    rows = _arrays(state)
    array, room = rows[9:12], rows[12:15]
    _copy(rows, array)
    value = state[at.VALUE : at.VALUE + 3]
    information = state[at.INFORMATION : at.INFORMATION + 9].reshape((3, 3))
    _conclude(state, array, room, value, information)
    ratio = _ratio_of(state, value)
    _write_fit(state, value, information, ratio)
    _write_noise(state, ratio, _form_bound(state, array))
    return _write_band(state)


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _write_fit(state, value, information, ratio):
    """Write radius, centre and their covariance for unit noise."""
    state[at.RADIUS] = _radius(state, value) - state[at.TIP]
    state[at.FIT_X], state[at.FIT_Y] = value[1], value[2]
    row, square = _arrays(state)[15], ratio * ratio
    _radius_row(state, value, row)
    state[at.SHAPE] = 0.0
    for j in range(3):
        across = row[0] * information[0, j] + row[1] * information[1, j] + row[2] * information[2, j]
        state[at.SHAPE] += square * across * row[j]
        if j > 0:
            state[at.SHAPE + j] = state[at.SHAPE + 3 * j] = square * across
            for k in range(1, 3):
                state[at.SHAPE + 3 * j + k] = square * information[j, k]
    state[at.SPREAD] = ratio * _worst(information[1, 1], information[1, 2], information[2, 2])


@compiled(error_model="numpy")
def holds_axis(state):
    """Whether the fitted circle contains the spindle axis; a limacon may have radius 0."""
    return (
        state[at.LIMACON] != 0.0
        or np.hypot(state[at.FIT_X], state[at.FIT_Y]) < state[at.RADIUS] + state[at.TIP]
    )


@compiled(error_model="numpy")
def never_changed(state):
    """Whether all readings are equal, so that their noise is unknown."""
    return state[at.NOISE] == 0.0 and state[at.QUANTUM] == 0.0 and state[at.REPEATS] > 0.0


@compiled(error_model="numpy")
def _write_rounding(state):
    """Raise noise and inflation to those of rounding to steps q where many readings are repeated.

    Rounding errors without noise correlate over the whole turn; with noise s a part q exp(-2 pi^2 s^2/q^2) of
    them does.
    """
    step = state[at.QUANTUM]
    if step <= 0.0 or state[at.REPEATS] < _REPEATED * state[at.SEEN]:
        return
    rounding = step / np.sqrt(12.0)
    state[at.FIT_NOISE] = max(state[at.FIT_NOISE], rounding)
    free = max((state[at.FIT_NOISE] / step) ** 2 - 1.0 / 12.0, 0.0)
    together = rounding * np.sqrt(state[at.WEIGHT]) * np.exp(-2.0 * np.pi**2 * free)
    state[at.INFLATION] = max(
        state[at.INFLATION], together / (_quantile(state, state[at.FREEDOM]) * state[at.FIT_NOISE])
    )


@compiled(error_model="numpy")
def in_doubt(state):
    """Whether the latest readings disagree; a single reading on both old and new circle changes nothing."""
    return state[at.IN_A_ROW] >= 1.0 or state[at.BAD] > at.DOUBTFUL


@compiled(error_model="numpy")
def may_have_moved(state):
    """Whether readings within the first turn disagree, by a move or by form."""
    return state[at.DOUBT] != 0.0 and _in_first_turn(state)


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _write_band(state):
    """Write band, tolerance and the noise of the band; return whether the estimate is valid."""
    _write_rounding(state)
    seen = _quantile(state, state[at.FREEDOM]) * state[at.FIT_NOISE]
    least = _known_quantile(state) * state[at.NOISE]
    if state[at.FREED] != 0.0 and seen * state[at.INFLATION] < least:
        state[at.INFLATION], seen = 1.0, 0.0
    measured = seen >= least
    state[at.SCALE] = state[at.FIT_NOISE] if measured else state[at.NOISE]
    state[at.SCALE_FREEDOM] = state[at.FREEDOM] if measured else 0.0
    state[at.REACH] = max(seen, least)
    state[at.BAND] = state[at.REACH] * state[at.SPREAD] * state[at.INFLATION] + state[at.FORM_BOUND]
    offset = np.sqrt(state[at.FIT_X] ** 2 + state[at.FIT_Y] ** 2)
    state[at.TOLERANCE] = max(state[at.REL_TOL] * offset, state[at.ABS_TOL])
    if in_doubt(state) or may_have_moved(state) or never_changed(state) or not holds_axis(state):
        return False
    # at least one degree of freedom, even with known noise: else a wrong reading would remain unnoticed
    return (
        state[at.COVERED] >= state[at.ARC_MIN]
        and state[at.FREEDOM] >= 1.0
        and state[at.BAND] <= state[at.TOLERANCE]
    )
