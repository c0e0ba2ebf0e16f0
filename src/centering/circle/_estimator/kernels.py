"""The streaming estimator: each reading gives a row, rotated into a triangle; outliers are refused.

With the tip's radius added to reading r and radius R, the exact curve of an offset circle, r^2 = 2 x r cos +
2 y r sin + R^2 - d^2, is linear. Divided by 2 S, S = r - x cos - y sin, its residual is the error of the
reading to first order and the row is the derivative of the curve: the triangle is that of maximum likelihood.
S is R times the cosine between the probe and the surface normal. The cosine is known after a few readings, R
only at the end: rows are divided by the cosine and the first reading r0, which scales all residuals by the
ratio R/r0.
"""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.form_kernels import _gather
from centering.circle._estimator.move_kernels import _has_moved, _keep
from centering.circle._estimator.validity_kernels import LEAST_RATIO, MOST_RATIO
from sdpgrind.base.compiling.compiled import compiled

TAKEN, REFUSED, COMPLETE, MOVED, SHIFTED = range(5)
"""Outcome of a reading: taken, refused, last of the start; or the part has moved, by the number of refused
readings or by a shift of the latest ones as a whole."""
NOT_FINITE, TOO_FAR, COARSE_STEPS, NOT_POSITIVE = range(-1, -5, -1)
"""Why a reading is invalid."""
PIVOT = 1e-13  # chosen: least diagonal of the triangle, far below an entry of a row (1), above rounding
_TURN = 2.0 * np.pi
_GAP = 4.0  # chosen: a larger step, in mean steps, is a gap: its arc is not covered
_SMALL_GAP = np.pi / 36  # chosen: rad; steps up to 5 deg are never gaps
_COARSE = 0.75  # chosen: rad; larger even steps suggest degrees taken for rad
_MANY_COARSE = 12  # chosen: coarse even steps in a row before a reading is invalid
_STEEPEST = 0.25  # chosen: least cosine between probe and surface normal; offsets up to 0.97 radii
_OUTLIER_SD = 5.0  # chosen: standard deviations; refuses one good Gaussian reading in 1.7 million
_QUIET = 1e-11  # chosen: least noise of the outlier test over the largest reading, above rounding
_SAME = 1e-12  # chosen: relative to the largest reading; smaller differences are rounding of sums
_FEW = 8  # chosen: readings before the fitted centre weighs the rows; earlier it is too uncertain
_MANY = 64  # chosen: readings from which on the centre is updated less often, to save time
_EACH = 8  # chosen: readings between these updates


@compiled(error_model="numpy")
def _objection(state, angle, reading):
    """Code of the reason why a reading is invalid; TAKEN if it is valid."""
    if not (np.isfinite(angle) and np.isfinite(reading)):  # guard
        return NOT_FINITE
    if state[at.LIMACON] == 0.0 and reading <= 0.0:
        return NOT_POSITIVE
    if state[at.INDEX] > 0.0:
        step = angle - state[at.LAST_ANGLE]
        if abs(step) > 1.001 * _TURN:
            return TOO_FAR
        if state[at.COARSE] >= _MANY_COARSE - 1 and _is_coarse(state, step):
            return COARSE_STEPS
    return TAKEN


@compiled(error_model="numpy")
def _is_coarse(state, step):
    """Whether a step is coarse and nearly equal to the one before."""
    return abs(step) > _COARSE and abs(step - state[at.LAST_STEP]) < 0.25 * abs(step)


@compiled(error_model="numpy")
def _travel(state, array, angle):
    """Advance to an angle: update angle travelled, arc covered and forgetting."""
    if state[at.INDEX] > 0.0:
        step = angle - state[at.LAST_ANGLE]
        state[at.COARSE] = state[at.COARSE] + 1.0 if _is_coarse(state, step) else 0.0
        state[at.LAST_STEP] = step
        step = _signed_step(state, step)
        _cover(state, step)
        if state[at.LOG_FORGETTING] != 0.0 and step != 0.0:
            _forget(state, array, np.exp(state[at.LOG_FORGETTING] * abs(step)))
    state[at.LAST_ANGLE] = angle


@compiled(error_model="numpy")
def _signed_step(state, step):
    """Signed angle of a step, rad; a step of more than half a turn continues the rotation."""
    if abs(step) <= 0.5 * _TURN:
        return step
    onward = step * state[at.DIRECTION] >= 0.0
    return step if onward and state[at.DIRECTION] != 0.0 else step - np.copysign(_TURN, step)


@compiled(error_model="numpy")
def _cover(state, step):
    """Extend the covered arc by a step; a gap adds one mean step only."""
    state[at.POSITION] += step
    way = abs(step)
    state[at.TRAVEL] += way
    if state[at.SEEN] == 0.0:
        state[at.LOW] = state[at.HIGH] = state[at.POSITION]
        return
    if way > 0.0:
        state[at.PATH] += way
        state[at.MOVES] += 1.0
        state[at.DIRECTION] = 1.0 if step > 0.0 else -1.0
    wider = max(state[at.POSITION] - state[at.HIGH], state[at.LOW] - state[at.POSITION])
    if wider <= 0.0:
        return
    count = state[at.WIDENINGS]
    if wider > _SMALL_GAP and count > 0.0 and wider * count > _GAP * state[at.COVERED]:
        state[at.COVERED] += state[at.COVERED] / count
    else:
        state[at.COVERED] += wider
    state[at.WIDENINGS] += 1.0
    state[at.LOW] = min(state[at.LOW], state[at.POSITION])
    state[at.HIGH] = max(state[at.HIGH], state[at.POSITION])


@compiled(error_model="numpy")
def _forget(state, array, weight):
    """Multiply the weight of all readings so far."""
    for i in range(at.SUM, at.SUM + at.SUMS):
        state[i] *= weight
    root = np.sqrt(weight)
    for i in range(3):
        for j in range(i, array.shape[1]):
            array[i, j] *= root
        if abs(array[i, i]) < PIVOT:
            array[i, i] = PIVOT


@compiled(error_model="numpy")
def _write_row(state, angle, reading, row):
    """Write regressors, target and lobes of a reading: error = target - regressors @ (q, x, y)."""
    _write_row_at(state, np.cos(angle), np.sin(angle), reading, row)


@compiled(error_model="numpy")
def _write_row_at(state, c, s, reading, row):
    """Write the row of a reading at an angle given by cosine and sine."""
    if state[at.LIMACON] != 0.0:
        if state[at.KNOWN] > 0.0:
            reading -= _known_form(state, c, s)
        row[0], row[1], row[2], row[3] = 1.0, c, s, reading - state[at.REFERENCE]
        _write_lobes(state, c, s, 1.0, row)
        return
    r, start, per_start = reading + state[at.TIP], state[at.REFERENCE], state[at.PER_REFERENCE]
    part_x, part_y, distance, cosine, steep = _slant(c, s, r, state[at.CENTER_X], state[at.CENTER_Y])
    if state[at.FORMS] > 0.0 or state[at.KNOWN] > 0.0:
        part_x, part_y = part_x / distance, part_y / distance
        if state[at.KNOWN] > 0.0:
            r -= _known_form(state, part_x, part_y) * steep
        _write_lobes(state, part_x, part_y, steep, row)
    state[at.RATIO], curve = _curve(c, s, r, distance, steep, start, per_start)
    row[0], row[1], row[2], row[3] = curve
    across = steep * per_start
    # Bias of the normal equations by noise e of variance 1, E[h (target - h value)]: row h and weight hold
    # the reading and its error. With 2 S the residual is e + e^2/(2 S), the derivative of r h (0, cos, sin)
    # and that of the logarithm of the weight -sin^2(slope)/S.
    state[at.NEW_BIAS] = (2.0 * cosine - 1.5 * steep) * per_start
    state[at.NEW_BIAS + 1], state[at.NEW_BIAS + 2] = c * across, s * across


@compiled(error_model="numpy")
def _slant(c, s, r, x, y):
    """Place from the centre and its distance (mm), cosine between probe and normal, and its inverse."""
    part_x, part_y, along = r * c - x, r * s - y, r - (x * c + y * s)
    distance = np.sqrt(part_x * part_x + part_y * part_y)
    if along > _STEEPEST * distance:
        return part_x, part_y, distance, along / distance, distance / along
    return part_x, part_y, distance, _STEEPEST, 1.0 / _STEEPEST


@compiled(error_model="numpy")
def _curve(c, s, r, distance, steep, start, per_start):
    """Ratio R/r0, regressors and target of a radius on the exact curve."""
    ratio, across = min(max(distance * per_start, LEAST_RATIO), MOST_RATIO), steep * per_start
    return ratio, (steep, r * c * across, r * s * across, 0.5 * (r - start) * (r + start) * across)


@compiled(error_model="numpy")
def _wave(c, s, upr):
    """Cosine and sine of a whole multiple of an angle, by recurrence."""
    cosine, sine = 1.0, 0.0
    for _ in range(int(upr)):
        cosine, sine = cosine * c - sine * s, sine * c + cosine * s
    return cosine, sine


@compiled(error_model="numpy")
def _write_lobes(state, c, s, slope, row):
    """Write the effect of unit lobes on a reading."""
    for n in range(int(state[at.FORMS])):
        cosine, sine = _wave(c, s, state[at.TAIL + 2 * n])
        row[4 + 2 * n], row[5 + 2 * n] = slope * cosine, slope * sine


@compiled(error_model="numpy")
def _known_form(state, c, s):
    """Known form at a part angle, mm."""
    begin, total = at.TAIL + 2 * int(state[at.FORMS]), 0.0
    for n in range(begin, begin + 3 * int(state[at.KNOWN]), 3):
        cosine, sine = _wave(c, s, state[n])
        total += state[n + 1] * cosine + state[n + 2] * sine
    return total


@compiled(error_model="numpy")
def _least_noise(state):
    """Least noise of the outlier test, scaled as the triangle."""
    return max(state[at.NOISE], _QUIET * state[at.LARGEST]) * state[at.RATIO]


@compiled(error_model="numpy")
def _rotate_unless_outlier(state, array, row):
    """Rotate a row in unless it is an outlier; return the rotated residual, inf for an outlier.

    The rotated residual is the prediction error over its standard deviation for unit noise.
    """
    p0, c0, s0 = _rotation(array[0, 0], row[0])
    a01, r1 = c0 * array[0, 1] + s0 * row[1], c0 * row[1] - s0 * array[0, 1]
    a02, r2 = c0 * array[0, 2] + s0 * row[2], c0 * row[2] - s0 * array[0, 2]
    a03, r3 = c0 * array[0, 3] + s0 * row[3], c0 * row[3] - s0 * array[0, 3]
    p1, c1, s1 = _rotation(array[1, 1], r1)
    a12, r2 = c1 * array[1, 2] + s1 * r2, c1 * r2 - s1 * array[1, 2]
    a13, r3 = c1 * array[1, 3] + s1 * r3, c1 * r3 - s1 * array[1, 3]
    p2, c2, s2 = _rotation(array[2, 2], r2)
    a23, r3 = c2 * array[2, 3] + s2 * r3, c2 * r3 - s2 * array[2, 3]
    if _is_outlier(state, abs(r3), c0 * c1 * c2):
        return np.inf
    array[0, 0], array[0, 1], array[0, 2], array[0, 3] = p0, a01, a02, a03
    array[1, 1], array[1, 2], array[1, 3], array[2, 2], array[2, 3] = p1, a12, a13, p2, a23
    for j in range(4, row.shape[0]):
        array[0, j], left = c0 * array[0, j] + s0 * row[j], c0 * row[j] - s0 * array[0, j]
        array[1, j], left = c1 * array[1, j] + s1 * left, c1 * left - s1 * array[1, j]
        array[2, j] = c2 * array[2, j] + s2 * left
    return r3


@compiled(error_model="numpy")
def _rotation(pivot, entry):
    """New pivot > 0, cosine and sine of the rotation that eliminates an entry."""
    square = pivot * pivot + entry * entry
    inverse = 1.0 / np.sqrt(square)
    return square * inverse, pivot * inverse, entry * inverse


@compiled(error_model="numpy")
def _is_outlier(state, left, cosine):
    """Whether a rotated residual is an outlier; `cosine` is the product of the three rotations' cosines."""
    freedom, least = state[at.WEIGHT] - 3.0, _least_noise(state)
    if left * left * freedom <= _OUTLIER_SD * _OUTLIER_SD * state[at.SQUARES] or left <= _OUTLIER_SD * least:
        return False
    if state[at.COVERED] < state[at.GATE_FROM] or freedom < 1.0:
        return False
    left = max(left - state[at.FORM_GATE] * state[at.RATIO] * abs(cosine), 0.0)
    return left * left > _outlier_quantile(freedom) ** 2 * max(state[at.SQUARES] / freedom, least * least)


@compiled(error_model="numpy")
def _outlier_quantile(freedom):
    """Student quantile as rare as 5 standard deviations (Wallace); 5 above 200 degrees of freedom."""
    if freedom > 200.0:
        return _OUTLIER_SD
    z = _OUTLIER_SD * (8.0 * freedom + 3.0) / (8.0 * freedom + 1.0)
    return np.sqrt(freedom * np.expm1(z * z / freedom))


@compiled(error_model="numpy")
def _note(state, row, weight, way):
    """Add a row to its block, to the bias and to the products of successive differences."""
    h0, h1, h2, t = row[0], row[1], row[2], row[3]
    _gather(state, h0, h1, h2, t, way)
    share = weight * state[at.NEW_BIAS]
    state[at.BIAS] += share * h0
    state[at.BIAS + 1] += share * h1
    state[at.BIAS + 2] += share * h2
    state[at.BIAS + 3] += weight * state[at.NEW_BIAS + 1]
    state[at.BIAS + 4] += weight * state[at.NEW_BIAS + 2]
    if state[at.LAGGED] != 0.0:
        change = (
            h0 - state[at.PREVIOUS],
            h1 - state[at.PREVIOUS + 1],
            h2 - state[at.PREVIOUS + 2],
            t - state[at.PREVIOUS + 3],
        )
        k = at.LAG
        for i in range(4):
            for j in range(i, 4):
                state[k] += weight * change[i] * change[j]
                k += 1
    state[at.LAGGED] = 1.0
    state[at.PREVIOUS], state[at.PREVIOUS + 1], state[at.PREVIOUS + 2], state[at.PREVIOUS + 3] = h0, h1, h2, t


@compiled(error_model="numpy")
def _count(state, array, left, weight):
    """Count a rotated row and its residual, and update the centre that weighs later rows."""
    state[at.SQUARES] += left * left
    state[at.WEIGHT] += weight
    used = state[at.USED] + 1.0
    state[at.USED] = used
    if used >= _FEW and (used < _MANY or int(used) % _EACH == 0):
        y = array[2, 3] / array[2, 2]
        state[at.CENTER_X], state[at.CENTER_Y] = (array[1, 3] - array[1, 2] * y) / array[1, 1], y


@compiled(error_model="numpy")
def _remember(state, angle, reading):
    """Write a reading into the ring buffer, where it replaces the oldest; return its place."""
    cell = at.RING_AT + at.CELL * (int(state[at.SEEN]) % at.RING)
    state[at.BAD] -= state[cell + 2]
    state[cell], state[cell + 1], state[cell + 2], state[cell + 3] = angle, reading, 0.0, state[at.TRAVEL]
    state[cell + 4] = state[at.INDEX]
    if state[at.SEEN] == 0.0:
        state[at.REFERENCE] = reading + state[at.TIP]
        state[at.PER_REFERENCE] = 1.0 / state[at.REFERENCE] if state[at.LIMACON] == 0.0 else 0.0
    else:
        _see_step(state, reading)
    state[at.LATEST] = reading
    state[at.LARGEST] = max(state[at.LARGEST], abs(reading + state[at.TIP]))
    return cell


@compiled(error_model="numpy")
def _see_step(state, reading):
    """Update the smallest step between readings and the count of repeated ones."""
    step = abs(reading - state[at.LATEST])
    if step <= _SAME * state[at.LARGEST]:
        state[at.REPEATS] += 1.0
    elif state[at.QUANTUM] == 0.0 or step < state[at.QUANTUM]:
        state[at.QUANTUM] = step


@compiled(error_model="numpy")
def _take(state, array, row, angle, reading):
    """Take a reading; return its outcome, or a negative code and an unchanged state if it is invalid.

    What follows of an outcome is left to `update_step`.
    """
    code = _objection(state, angle, reading)
    if code != TAKEN:
        return code
    _travel(state, array, angle)
    if int(state[at.SEEN]) % at.RING == 0:
        _keep(state, array)
    cell = _remember(state, angle, reading)
    _write_row(state, angle, reading, row)
    state[at.INDEX] += 1.0
    state[at.SEEN] += 1.0
    left = _rotate_unless_outlier(state, array, row)
    if left == np.inf:
        state[cell + 2] = 1.0
        state[at.BAD] += 1.0
        state[at.IN_A_ROW] += 1.0
        return MOVED if 2.0 * state[at.BAD] > at.RING else REFUSED
    state[at.IN_A_ROW] = 0.0
    _note(state, row, 1.0, state[at.TRAVEL])
    _count(state, array, left, 1.0)
    if int(state[at.SEEN]) % at.RING == 0:
        return COMPLETE if state[at.SEEN] == at.RING else SHIFTED if _has_moved(state, array) else TAKEN
    return TAKEN
