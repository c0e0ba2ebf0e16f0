"""Correlation of the residuals of a fit, its effect on the centre, and its separation from form.

Residuals are in the order of the angle travelled. AR(1) noise of correlation rho moves the centre by
`factor(rho)` more than independent noise. Low undulations look like such noise; from a whole turn on 2 to 5
upr are fitted along with the circle, and the rest is noise. The loss of noise to these 11 columns follows
from its spectrum f(w) = (1 - rho^2)/(1 - 2 rho cos w + rho^2) at 0 to 5 upr.
"""

import numpy as np

from centering.circle._fit.cholesky_kernels import _cholesky
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.identify.kernels import back_substitute

TURN = 2.0 * np.pi
FOLLOWS = 0.8  # chosen: share of steps of one sense from which readings are in the order of travel
SAME = 1e-6  # chosen: rad; smaller steps are none
SIGNIFICANT = 2.33  # derived: standard deviations of a correlation that 1 % of independent noise exceeds
MOST = 0.9999  # chosen: largest correlation; 1 would make the inflation infinite
LOBES, COLUMNS = 5, 11  # derived: most upr of a lobe; 3 of the circle, 2 of each lobe of 2 to 5 upr
SLOW = 4.0  # chosen: degrees of freedom a turn of the slowest waves above form
RATIO, INFLATION, FREEDOM, SHIFT = range(4)
"""Slots of a result: sd of a reading over sqrt(squares/(m - 3)), factor on it, degrees of freedom, shift of
the centre by form (mm)."""


@compiled(error_model="numpy")
def factor(rho):
    """Sd of a mean of AR(1) noise of correlation rho over that of independent noise."""
    return np.sqrt((1.0 + rho) / (1.0 - rho))


@compiled(error_model="numpy")
def travelled(angle):
    """Angles (rad) with whole turns counted if the readings are in the order of travel; else unchanged."""
    out, sense, moves = np.empty(angle.size), 0.0, 0
    for i in range(angle.size):
        out[i] = angle[i]
    for i in range(1, angle.size):
        step = angle[i] - angle[i - 1]
        step -= TURN * np.rint(step / TURN)
        if abs(step) > SAME:
            sense += np.sign(step)
            moves += 1
    if abs(sense) < FOLLOWS * moves or moves == 0:
        return out
    way = np.sign(sense)
    for i in range(1, angle.size):
        step = angle[i] - angle[i - 1]
        if step * way < -0.5 * TURN:
            step += way * TURN * np.ceil(abs(step) / TURN)
        out[i] = out[i - 1] + step
    return out


@compiled(error_model="numpy")
def _resemblance(line):
    """Sum of squares, and sum of squared successive differences over it."""
    squares, lagged = 0.0, 0.0
    for i in range(line.size):
        squares += line[i] * line[i]
        if i > 0:
            lagged += (line[i] - line[i - 1]) ** 2
    return squares, lagged / squares if squares > 0.0 else 2.0


@compiled(error_model="numpy")
def _write_columns(angle, reading, circle, left, out):
    """Write derivatives of a reading by radius, centre and lobes of 2 to 5 upr, then its residual."""
    c, s = np.cos(angle), np.sin(angle)
    across, side = circle[2] * c - circle[1] * s, reading - circle[1] * c - circle[2] * s
    effective = np.sqrt(side * side + across * across)
    x, y, part = (side * c + across * s) / effective, (side * s - across * c) / effective, effective / side
    out[0], cosine, sine = part, part, 0.0
    for n in range(LOBES):
        cosine, sine = cosine * x - sine * y, sine * x + cosine * y
        out[2 * n + 1], out[2 * n + 2] = cosine, sine
    out[COLUMNS] = left


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _freed(angle, reading, kept, circle, line):
    """Remove lobes of 2 to 5 upr from the residuals, in place; return the centre's shift, -1: singular."""
    array, row, found = np.zeros((COLUMNS, COLUMNS + 1)), np.empty(COLUMNS + 1), np.empty(COLUMNS)
    for k in range(line.size):
        _write_columns(angle[kept[k]], reading[kept[k]], circle, line[k], row)
        for i in range(COLUMNS):
            for j in range(i, COLUMNS + 1):
                array[i, j] += row[i] * row[j]
    if not _cholesky(array, COLUMNS):
        return -1.0
    back_substitute(array, COLUMNS, found)
    for k in range(line.size):
        _write_columns(angle[kept[k]], reading[kept[k]], circle, line[k], row)
        for i in range(COLUMNS):
            line[k] -= found[i] * row[i]
    return np.hypot(found[1], found[2])


@compiled(error_model="numpy")
def _expected(rho, count, step):
    """Expected squares of unit noise, and of its differences, outside the columns of circle and lobes."""
    end = rho**count
    squares = count * (1.0 + end) / (1.0 - end)
    differences = 2.0 * (squares - count * (rho + rho ** (count - 1)) / (1.0 - end))
    for n in range(LOBES + 1):
        c, columns = np.cos(n * step), 1.0 if n == 0 else 2.0
        here = columns * (1.0 - rho * rho) / (1.0 - 2.0 * rho * c + rho * rho)
        squares -= here
        differences -= here * (2.0 - 2.0 * c)
    return squares, differences


@compiled(error_model="numpy")
def _fading(differences, count, step):
    """Correlation rho whose noise leaves this ratio of squared differences to squares."""
    low, high = 0.0, MOST
    for _ in range(40):
        rho = 0.5 * (low + high)
        a, b = _expected(rho, count, step)
        if b > differences * a:
            low = rho
        else:
            high = rho
    return 0.5 * (low + high)


@compiled(error_model="numpy")
def _once(rho, count, step):
    """Power of unit noise at 1 upr, which moves the centre; doubled for a random walk."""
    return (1.0 - rho * rho) / (1.0 - 2.0 * rho * np.cos(step) + rho * rho) * (1.0 + rho**count)


@compiled(error_model="numpy")
def _certain(rho, count, step):
    """Degrees of freedom of the noise that moves the centre: 2 over the log-power's variance (Whittle)."""
    a, b, c, h = 0.5 * count, 0.0, count / (1.0 - rho * rho), 0.0
    for n in range(LOBES + 1):
        cosine, half = np.cos(n * step), 0.5 if n == 0 else 1.0
        slope = (2.0 * cosine - 2.0 * rho) / (1.0 - 2.0 * rho * cosine + rho * rho)
        h = slope if n == 1 else h
        a, b, c = a - half, b - half * slope, c - half * slope * slope
    return 2.0 * (a * c - b * b) / (c - 2.0 * b * h + a * h * h)


@compiled(error_model="numpy")
def noise(angle, reading, circle, left, order, whole, result):
    """Write the noise of residuals (NaN: left out); `whole` is the number of turns covered, 0 below one."""
    kept, line = np.empty(order.size, dtype=np.int64), np.empty(order.size)
    count = 0
    for k in order:
        if not np.isnan(left[k]):
            kept[count], line[count] = k, left[k]
            count += 1
    kept, line = kept[:count], line[:count]
    result[RATIO], result[INFLATION], result[FREEDOM], result[SHIFT] = 1.0, 1.0, count - 3.0, 0.0
    before, differences = _resemblance(line)
    plain = 1.0 - 0.5 * differences
    rho = min(plain + (2.0 + 5.0 * plain) / count, MOST)
    if count < 5 or rho <= SIGNIFICANT / np.sqrt(count):
        return
    longer = factor(rho) ** 2
    result[RATIO] = np.sqrt((count - 3.0) / (count - 3.0 * min(longer, (count - 4.0) / 8.0)))
    result[INFLATION], result[FREEDOM] = factor(rho), max(count / (1.0 + 2.0 * longer) - 3.0, 1.0)
    if whole and count > 2 * COLUMNS:
        _noise_beside_form(_freed(angle, reading, kept, circle, line), line, before, whole, result)


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _noise_beside_form(moved, line, before, whole, result):
    """Write the noise of residuals without lobes; `moved` < 0: the lobes could not be removed."""
    count, step = line.size, TURN * whole / line.size
    squares, differences = _resemblance(line)
    rho = _fading(differences, count, step)
    if moved < 0.0:
        return
    rho = rho if rho > SIGNIFICANT / np.sqrt(count) else 0.0
    result[RATIO] = np.sqrt(squares / (count - COLUMNS) / before * (count - 3.0))
    result[INFLATION] = np.sqrt((count - COLUMNS) / _expected(rho, count, step)[0] * _once(rho, count, step))
    result[FREEDOM], result[SHIFT] = count - COLUMNS, moved
    if rho > 0.0:  # of a random walk only the few remaining slow waves inform
        result[FREEDOM] = max(min(_certain(rho, count, step), SLOW * whole / rho**count), 1.0)
