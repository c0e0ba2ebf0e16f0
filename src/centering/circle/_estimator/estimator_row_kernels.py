"""The row of a reading in the triangle: regressors, target, what lobes add, what the noise's square adds. Compiled.

Exact curve of an offset circle, with the tip's radius added to reading r and radius R: r^2 = 2 x r cos + 2 y r sin + R^2 - d^2 is
linear. Divided by 2 S, S = r - x cos - y sin, the residual is the reading's error to first order and a row is the curve's own
derivative, so that the triangle is that of maximum likelihood: exact without noise, efficient with it. S is R times the cosine of
the angle between the probe and the surface's normal. That angle is known after a few readings, R only at the end: so rows are
divided by the cosine and the first reading r0, and all the residuals are too large by one and the same ratio R/r0.
"""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.validity_kernels import LEAST_RATIO, MOST_RATIO
from sdpgrind.base.compiled import compiled

_STEEPEST = 0.25  # cosine between the probe and the surface's normal: offsets up to 0.97 radii


@compiled(error_model="numpy")
def _write_row(state, angle, reading, row):
    """Write regressors, target and lobes of a reading: error of the reading = target - regressors @ (q, x, y)."""
    _write_row_at(state, np.cos(angle), np.sin(angle), reading, row)


@compiled(error_model="numpy")
def _write_row_at(state, c, s, reading, row):
    """The same at an angle of this cosine and sine."""
    if state[at.LIMACON] != 0.0:
        if state[at.KNOWN] > 0.0:
            reading -= _known_form(state, c, s)
        row[0], row[1], row[2], row[3] = 1.0, c, s, reading - state[at.REFERENCE]
        _write_lobes(state, c, s, 1.0, row)
        return
    r, x, y = reading + state[at.TIP], state[at.CENTER_X], state[at.CENTER_Y]
    part_x, part_y, along = r * c - x, r * s - y, r - (x * c + y * s)
    distance, start, per_start = np.sqrt(part_x * part_x + part_y * part_y), state[at.REFERENCE], state[at.PER_REFERENCE]
    if along > _STEEPEST * distance:
        cosine, steep = along / distance, distance / along
    else:
        cosine, steep = _STEEPEST, 1.0 / _STEEPEST
    state[at.RATIO] = min(max(distance * per_start, LEAST_RATIO), MOST_RATIO)
    if state[at.FORMS] > 0.0 or state[at.KNOWN] > 0.0:
        part_x, part_y = part_x / distance, part_y / distance
        if state[at.KNOWN] > 0.0:
            r -= _known_form(state, part_x, part_y) * steep
        _write_lobes(state, part_x, part_y, steep, row)
    across = steep * per_start
    row[0], row[1], row[2] = steep, r * c * across, r * s * across
    row[3] = 0.5 * (r - start) * (r + start) * across
    # What noise e of the reading adds to the normal equations in the mean, by its square: E[h (target - h value)]. The reading
    # stands in the row h and in its weight too, so that rows and errors are correlated: with 2 S the residual is e + e^2/(2 S),
    # the derivative of r h is (0, cos, sin) and that of the logarithm of the weight -sin^2(slope)/S.
    state[at.NEW_BIAS] = (2.0 * cosine - 1.5 * steep) * per_start
    state[at.NEW_BIAS + 1], state[at.NEW_BIAS + 2] = c * across, s * across


@compiled(error_model="numpy")
def _wave(c, s, upr):
    """Cosine and sine of a whole multiple of an angle."""
    cosine, sine = 1.0, 0.0
    for _ in range(int(upr)):
        cosine, sine = cosine * c - sine * s, sine * c + cosine * s
    return cosine, sine


@compiled(error_model="numpy")
def _write_lobes(state, c, s, slope, row):
    """What lobes of amplitude 1 add to a reading."""
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
