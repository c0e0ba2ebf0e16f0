"""Joint least squares of centre, radius and lobes of a ring, from readings and prior information. Compiled.

A reading (tip included) of a ring of radius R about (x, y) is that of a circle plus, to first order, steep
(dR + dx cos b + dy sin b + sum of c_n cos nb + s_n sin nb): b the angle about the ring's centre, steep 1 over
the cosine between probe and normal. Values are (x, y, dR, c_2, s_2, ...), mm. All but the centre persist over
pushes as normal equations: information and its product with the values.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

FIRST, LAST = 2, 7
"""Undulations per revolution of the lobes that are looked for; derived: 1 is the offset; chosen: finer form
counts as noise."""
SIZE = 3 + 2 * (LAST - FIRST + 1)
"""Values."""
_FAR = 1e-4  # 1/mm^2, chosen: that the centre is on the table is information, too
_STEEPEST = 0.25  # chosen: least cosine between probe and normal
_STEPS, _CLOSE = 8, 1e-5  # mm, chosen: Gauss-Newton ends with a step of the centre that is shorter


@compiled(error_model="numpy")
def _write_row(angle, reading, x, y, radius, turning, row):
    """Write the derivatives of a reading by the values; return its excess over a circle (mm) and its weight.

    `turning` is the error of an angle over that of a reading, rad/mm: it reduces the weight where the rim is
    fast.
    """
    c, s = np.cos(angle), np.sin(angle)
    along, across = x * c + y * s, x * s - y * c
    root = np.sqrt(max(radius * radius - across * across, (_STEEPEST * radius) ** 2))
    steep = radius / root
    u, v = ((along + root) * c - x) / radius, ((along + root) * s - y) / radius
    cosine, sine = u * steep, v * steep
    row[0], row[1], row[2] = cosine, sine, steep
    for n in range(FIRST, LAST + 1):
        cosine, sine = cosine * u - sine * v, sine * u + cosine * v
        row[2 * n - 1], row[2 * n] = cosine, sine
    slope = turning * across * (1.0 + along / root)
    return reading - along - root, 1.0 / (1.0 + slope * slope)


@compiled(error_model="numpy")
def _add_readings(angles, readings, value, radius, turning, noise_sd, matrix, vector):
    """Add readings to normal equations about a value: upper triangle; `radius`: at dR = 0, tip included."""
    row = np.empty(SIZE)
    for k in range(angles.size):
        target, weight = _write_row(
            angles[k], readings[k], value[0], value[1], radius + value[2], turning, row
        )
        for i in range(3):
            target += row[i] * value[i]
        for i in range(SIZE):
            share = weight * row[i] / (noise_sd * noise_sd)
            vector[i] += share * target
            for j in range(i, SIZE):
                matrix[i, j] += share * row[j]


@compiled(error_model="numpy")
def solve(angles, readings, value, radius, turning, noise_sd, known, told, matrix, vector):
    """Improve `value` by readings and prior (`known`, `told` times the value); write the normal equations.

    Returns the covariance of the values.
    """
    for _ in range(_STEPS):
        matrix[:] = 0.0
        for i in range(SIZE):
            vector[i] = told[i]
        _add_readings(angles, readings, value, radius, turning, noise_sd, matrix, vector)
        matrix[0, 0] += _FAR
        matrix[1, 1] += _FAR
        for i in range(SIZE):
            for j in range(i, SIZE):
                matrix[i, j] += known[i, j]
                matrix[j, i] = matrix[i, j]
        covariance = np.linalg.inv(matrix)
        x, y = value[0], value[1]
        for i in range(SIZE):
            value[i] = 0.0
            for j in range(SIZE):
                value[i] += covariance[i, j] * vector[j]
        if not abs(value[0] - x) + abs(value[1] - y) > _CLOSE:
            break
    return covariance


@compiled(error_model="numpy")
def residuals(angles, readings, value, radius, turning):
    """Weighted sums of squared residuals of readings, and of squares of successive differences, mm^2."""
    row, squares, lagged, before = np.empty(SIZE), 0.0, 0.0, 0.0
    for k in range(angles.size):
        left, weight = _write_row(angles[k], readings[k], value[0], value[1], radius + value[2], turning, row)
        for i in range(3, SIZE):
            left -= row[i] * value[i]
        left *= np.sqrt(weight)
        squares += left * left
        if k > 0:
            lagged += (left - before) ** 2
        before = left
    return squares, lagged


@compiled(error_model="numpy")
def forget_center(matrix, vector, known, told):
    """Write the information of normal equations on all values but the centre, which becomes free."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[1, 1]
    by = a * c - b * b
    known[:] = 0.0
    told[:] = 0.0
    for i in range(2, SIZE):
        first, second = (c * matrix[i, 0] - b * matrix[i, 1]) / by, (a * matrix[i, 1] - b * matrix[i, 0]) / by
        told[i] = vector[i] - first * vector[0] - second * vector[1]
        for j in range(2, SIZE):
            known[i, j] = matrix[i, j] - first * matrix[0, j] - second * matrix[1, j]


@compiled(error_model="numpy")
def lobes_at(angle, value, radius):
    """Contribution of the lobes to a reading (mm) at an angle of the spindle."""
    row, total = np.empty(SIZE), 0.0
    _write_row(angle, 0.0, value[0], value[1], radius + value[2], 0.0, row)
    for i in range(3, SIZE):
        total += row[i] * value[i]
    return total
