"""Kernels of the exact curve's fit: a linear start, then Gauss-Newton steps by orthogonal columns.

Lengths are in mm, angles in rad. Radius and reading include the tip's radius. A circle is (radius, x, y).
Data are rows (4, m): cosine and sine of the angle, reading, and the known form at that place. The last row
after the readings is the radius prior, of weight 0 without one.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

STEPS, HALVINGS = 60, 25  # chosen: limits of the Gauss-Newton steps and of the halvings of one step
SETTLED = 1e-8  # chosen: squared step over the squared standard deviation that ends the steps
ROUNDING = 4e-15  # chosen: rounding of a residual relative to the radius, some 20 units in the last place
SAME = 1e-6  # chosen: rad; closer readings are at one place
GAP = 10.0  # chosen: a larger step, in median steps, is a gap: its arc is not covered
FITTED, SINGULAR, OUTSIDE, ENDLESS = range(4)
"""Outcome of a fit: settled; readings do not determine three quantities; axis outside of the circle; not
settled."""
RADIUS, X, Y, NOISE, SEEN, UNIT, FREEDOM, CONDITION, WORST, TAKEN, AWAY, INVERSE = range(12)
RESULT = INVERSE + 9
"""Slots of a result: circle, sd of a reading, sd that scales the covariance, the same but at least the given
noise, degrees of freedom, largest factor of the other quantities on an sd, its quantity, steps taken, number
of readings weighed by less than half, and (J'J)^-1 by rows; RESULT is their count."""


@compiled(error_model="numpy")
def _prepared(angle, reading, form):
    """Rows of data (4, m)."""
    data = np.empty((4, angle.size))
    for i in range(angle.size):
        data[0, i], data[1, i] = np.cos(angle[i]), np.sin(angle[i])
        data[2, i], data[3, i] = reading[i], form[i]
    return data


@compiled(error_model="numpy")
def _dot(a, b):
    """Dot product, in four sums at a time."""
    one, two, three, four = 0.0, 0.0, 0.0, 0.0
    whole = a.size - a.size % 4
    for i in range(0, whole, 4):
        one += a[i] * b[i]
        two += a[i + 1] * b[i + 1]
        three += a[i + 2] * b[i + 2]
        four += a[i + 3] * b[i + 3]
    for i in range(whole, a.size):
        one += a[i] * b[i]
    return (one + two) + (three + four)


@compiled(error_model="numpy")
def _mean(values):
    """Mean, summed in order."""
    total = 0.0
    for i in range(values.size):
        total += values[i]
    return total / values.size


@compiled(error_model="numpy")
def _orthonormalize(rows, upper):
    """Orthonormalize the first three rows (4, n), project the last, in place; write their triangle (3, 4)."""
    for i in range(3):
        upper[i, i] = np.sqrt(_dot(rows[i], rows[i]))
        if upper[i, i] > 0.0:
            for k in range(rows.shape[1]):
                rows[i, k] /= upper[i, i]
        for j in range(i + 1, 4):
            upper[i, j] = _dot(rows[i], rows[j])
            for k in range(rows.shape[1]):
                rows[j, k] -= upper[i, j] * rows[i, k]


@compiled(error_model="numpy")
def _solved(upper, out):
    """Solve a triangle (3, 4) for `out` (3,); return whether it is regular."""
    for i in range(2, -1, -1):
        if upper[i, i] <= 0.0:
            return False
        out[i] = upper[i, 3]
        for j in range(i + 1, 3):
            out[i] -= upper[i, j] * out[j]
        out[i] /= upper[i, i]
    return True


@compiled(error_model="numpy")
def _spread(upper, result):
    """Write (R'R)^-1, the largest factor of the other quantities on an sd, and its quantity."""
    back = np.zeros((3, 3))
    back[0, 0], back[1, 1], back[2, 2] = 1.0 / upper[0, 0], 1.0 / upper[1, 1], 1.0 / upper[2, 2]
    back[0, 1], back[1, 2] = -upper[0, 1] * back[0, 0] * back[1, 1], -upper[1, 2] * back[1, 1] * back[2, 2]
    back[0, 2] = -(upper[0, 1] * back[1, 2] + upper[0, 2] * back[2, 2]) * back[0, 0]
    result[CONDITION] = 0.0
    for i in range(3):
        own = 0.0
        for j in range(3):
            own += upper[j, i] * upper[j, i] if j <= i else 0.0
            product = back[i, 0] * back[j, 0] + back[i, 1] * back[j, 1] + back[i, 2] * back[j, 2]
            result[INVERSE + 3 * i + j] = product
        widened = np.sqrt(own * result[INVERSE + 4 * i])
        if widened > result[CONDITION]:
            result[CONDITION], result[WORST] = widened, i


@compiled(error_model="numpy")
def _holds_axis(circle):
    """Whether the spindle axis lies in a circle."""
    return circle[1] * circle[1] + circle[2] * circle[2] < circle[0] * circle[0] and circle[0] > 0.0


@compiled(error_model="numpy")
def _residuals(data, circle, out):
    """Write the readings minus the exact curve; return whether the curve exists."""
    if not _holds_axis(circle):
        return False
    for i in range(data.shape[1]):
        c, s = data[0, i], data[1, i]
        across, effective = circle[2] * c - circle[1] * s, circle[0] + data[3, i]
        out[i] = (
            data[2, i] - circle[1] * c - circle[2] * s - np.sqrt((effective - across) * (effective + across))
        )
    return True


@compiled(error_model="numpy")
def _slopes(data, circle, weight, rows):
    """Write the weighted derivatives of the exact curve by radius, x and y, (3, m)."""
    for i in range(data.shape[1]):
        c, s = data[0, i], data[1, i]
        across, effective = circle[2] * c - circle[1] * s, circle[0] + data[3, i]
        side = np.sqrt((effective - across) * (effective + across))
        rows[0, i] = weight[i] * effective / side
        rows[1, i] = weight[i] * (c + across * s / side)
        rows[2, i] = weight[i] * (s - across * c / side)


@compiled(error_model="numpy")
def _write_linear(data, limacon, rows):
    """Write the rows of r^2 = 2 x r cos + 2 y r sin + c, or of the limacon."""
    m = data.shape[1]
    for k in range(4):
        rows[k, m] = 0.0
    for i in range(m):
        r = data[2, i]
        scale = 1.0 if limacon else 2.0 * r
        rows[0, i], rows[1, i], rows[2, i] = 1.0, scale * data[0, i], scale * data[1, i]
        rows[3, i] = r if limacon else r * r


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _started(data, rows, circle):
    """Write a first circle by the linear form, else the limacon, else about the axis; return the outcome."""
    upper = np.empty((3, 4))
    for limacon in range(2):
        _write_linear(data, limacon == 1, rows)
        _orthonormalize(rows, upper)
        solved = _solved(upper, circle)
        if limacon == 0:
            if not solved:
                return SINGULAR
            circle[0] = np.sqrt(max(circle[0] + circle[1] ** 2 + circle[2] ** 2, 0.0))
        if solved and _holds_axis(circle):
            return FITTED
    circle[0], circle[1], circle[2] = _mean(data[2]), 0.0, 0.0
    return FITTED if _holds_axis(circle) else OUTSIDE


@compiled(error_model="numpy")
def _direction(data, circle, weight, left, prior_weight, rows, step, result):
    """Write the Gauss-Newton step and its covariance; return the predicted gain of squares, < 0: singular."""
    m, upper = data.shape[1], np.empty((3, 4))
    _slopes(data, circle, weight, rows)
    rows[0, m], rows[1, m], rows[2, m] = prior_weight, 0.0, 0.0
    for i in range(m):
        rows[3, i] = weight[i] * left[i]
    rows[3, m] = prior_weight * left[m]
    _orthonormalize(rows, upper)
    if not _solved(upper, step):
        return -1.0
    _spread(upper, result)
    return upper[0, 3] ** 2 + upper[1, 3] ** 2 + upper[2, 3] ** 2


@compiled(error_model="numpy")
def _moved(data, circle, step, prior_mean, prior_weight, left):
    """Apply a step, halved until it does not raise the sum of squares; return its share, 0 for none."""
    m, trial, share = data.shape[1], np.empty(3), 1.0
    cost = _dot(left[:m], left[:m]) + (prior_weight * left[m]) ** 2
    for _ in range(HALVINGS):
        for k in range(3):
            trial[k] = circle[k] + share * step[k]
        if _residuals(data, trial, left):
            left[m] = prior_mean - trial[0]
            now = _dot(left[:m], left[:m]) + (prior_weight * left[m]) ** 2
            if np.sqrt(now) <= np.sqrt(cost) + np.sqrt(m) * ROUNDING * circle[0]:
                circle[0], circle[1], circle[2] = trial[0], trial[1], trial[2]
                return share
        share *= 0.5
    return 0.0


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _improved(data, even, prior_mean, prior_sd, noise_sd, rows, left, result):
    """Take one Gauss-Newton step; return `FITTED` when settled, `ENDLESS` when another step is needed."""
    m, step, before = data.shape[1], np.empty(3), result[UNIT]
    square = _dot(left[:m], left[:m])
    result[UNIT] = max(np.sqrt(square / max(result[FREEDOM], 1.0)), noise_sd)
    weight = result[UNIT] / prior_sd
    gain = _direction(data, result, even, left, weight, rows, step, result)
    if gain < 0.0:
        return SINGULAR
    share = _moved(data, result, step, prior_mean, weight, left)
    if share == 0.0:
        return OUTSIDE
    result[FREEDOM] = m - 3.0 + weight * weight * result[INVERSE]
    least = ROUNDING * result[RADIUS]
    settled = gain <= SETTLED * square / m + m * least**2
    known = weight == 0.0 or abs(result[UNIT] - before) <= 1e-6 * before + least
    return FITTED if settled and known and share == 1.0 else ENDLESS


@compiled(error_model="numpy")
def fit_exact(angle, reading, form, prior_mean, prior_sd, noise_sd, left, result):
    """Fit the exact curve by least squares; write residuals (m + 1) and slots, return the outcome.

    A prior of infinite sd has no effect; the noise is that of the residuals, at least `noise_sd`.
    """
    m, data = angle.size, _prepared(angle, reading, form)
    rows, even = np.empty((4, m + 1)), np.empty(m)
    for i in range(m):
        even[i] = 1.0
    ended = _started(data, rows, result)
    if ended != FITTED or not _residuals(data, result, left):
        return max(ended, SINGULAR)
    left[m], result[FREEDOM] = prior_mean - result[0], m - 3.0
    result[UNIT] = result[AWAY] = result[TAKEN] = 0.0
    ended = ENDLESS
    while ended == ENDLESS and result[TAKEN] < STEPS:
        result[TAKEN] += 1.0
        ended = _improved(data, even, prior_mean, prior_sd, noise_sd, rows, left, result)
    result[NOISE] = result[SEEN] = np.sqrt(_dot(left[:m], left[:m]) / max(result[FREEDOM], 1.0))
    result[UNIT] = max(result[NOISE], noise_sd)
    return ended


@compiled(error_model="numpy")
def distinct(angle, enough):
    """Number of different directions, counted up to `enough`."""
    known, found = np.empty(enough), 0
    for i in range(angle.size):
        turned, new = angle[i] % (2.0 * np.pi), True
        for k in range(found):
            apart = abs(turned - known[k])
            new = new and min(apart, 2.0 * np.pi - apart) > 1e-9
        if new:
            known[found] = turned
            found += 1
            if found == enough:
                break
    return found


@compiled(error_model="numpy")
def _ranked(values, wanted):
    """Value at a rank of the sorted list, by partition; reorders the values."""
    low, high = 0, values.size - 1
    while low < high:
        pivot, i, j = values[(low + high) // 2], low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i, j = i + 1, j - 1
        if wanted <= j:
            high = j
        elif wanted >= i:
            low = i
        else:
            break
    return values[wanted]


@compiled(error_model="numpy")
def swept(line):
    """Angle covered by sorted angles without gaps, rad."""
    steps, count, total = np.empty(line.size), 0, 0.0
    for i in range(1, line.size):
        if line[i] > line[i - 1] + SAME:
            steps[count] = line[i] - line[i - 1]
            count += 1
    widest = GAP * _ranked(steps[:count], count // 2) if count > 0 else 0.0
    for i in range(count):
        total += steps[i] if steps[i] <= widest else 0.0
    return total
