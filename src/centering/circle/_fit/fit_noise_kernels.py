"""What the residuals of a fit say of noise: whether each resembles the last, what that costs, and what of it is form. Compiled.

Residuals stand in the order of the angle travelled. Noise that fades by rho from reading to reading (AR(1)) moves the centre by
`factor(rho)` more than independent noise. Lobes of few undulations look like such noise; from a whole turn on they are told from
it: 2 to 5 upr are fitted along with the circle, and noise is what is left. What these 11 columns take of the noise is reckoned
with its spectrum f(w) = (1 - rho^2)/(1 - 2 rho cos w + rho^2) at 0 to 5 upr.
"""

import numpy as np

from centering.circle._fit.solve_kernels import _back, _triangle
from sdpgrind.base.compiled import compiled

TURN = 2.0 * np.pi
FOLLOWS = 0.8  # share of the steps of one sense from which on readings are in the order of the travel
SAME = 1e-6  # rad
SIGNIFICANT = 2.33  # standard deviations from which on a correlation is believed: of independent noise 1 % is
MOST = 0.9999
LOBES, COLUMNS = 5, 11
SLOW = 4.0  # degrees of freedom a turn of the slowest waves above form
RATIO, INFLATION, FREEDOM, SHIFT = 0, 1, 2, 3
"""What is told: sd of a reading over the root of squares/(m - 3), factor on it, degrees of freedom, way that form moves the
centre."""


@compiled(error_model="numpy")
def factor(rho):
    """Sd of a mean of noise that fades by rho from reading to reading, over that of independent noise."""
    return np.sqrt((1.0 + rho) / (1.0 - rho))


@compiled(error_model="numpy")
def travelled(angle):
    """Angles with whole turns counted, where readings are in the order of the travel; else as they are."""
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
    """Sum of squares, and that of differences of successive values over it."""
    squares, lagged = 0.0, 0.0
    for i in range(line.size):
        squares += line[i] * line[i]
        if i > 0:
            lagged += (line[i] - line[i - 1]) ** 2
    return squares, lagged / squares if squares > 0.0 else 2.0


@compiled(error_model="numpy")
def _write_columns(angle, reading, circle, left, out):
    """Radius, centre and lobes of 2 to 5 upr where a reading was taken, in the reading; and what is left of it."""
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
    """Take lobes of 2 to 5 upr out of the residuals, in place; how far they move the centre, less than 0: not told."""
    array, row, found = np.zeros((COLUMNS, COLUMNS + 1)), np.empty(COLUMNS + 1), np.empty(COLUMNS)
    for k in range(line.size):
        _write_columns(angle[kept[k]], reading[kept[k]], circle, line[k], row)
        for i in range(COLUMNS):
            for j in range(i, COLUMNS + 1):
                array[i, j] += row[i] * row[j]
    if not _triangle(array, COLUMNS):
        return -1.0
    _back(array, COLUMNS, found)
    for k in range(line.size):
        _write_columns(angle[kept[k]], reading[kept[k]], circle, line[k], row)
        for i in range(COLUMNS):
            line[k] -= found[i] * row[i]
    return np.hypot(found[1], found[2])


@compiled(error_model="numpy")
def _expected(rho, count, step):
    """Squares of noise of sd 1, and of its differences, that are left beside the columns of a circle and its lobes."""
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
    """The rho whose noise leaves such differences over its squares, where the columns of circle and lobes are taken out."""
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
    """Square of the noise of sd 1 at 1 upr, which moves the centre; twice that of its spectrum where it walks at random."""
    return (1.0 - rho * rho) / (1.0 - 2.0 * rho * np.cos(step) + rho * rho) * (1.0 + rho**count)


@compiled(error_model="numpy")
def _certain(rho, count, step):
    """Degrees of freedom of the noise that moves the centre: 2 over the variance of the logarithm of its square, by Whittle."""
    a, b, c, h = 0.5 * count, 0.0, count / (1.0 - rho * rho), 0.0
    for n in range(LOBES + 1):
        cosine, half = np.cos(n * step), 0.5 if n == 0 else 1.0
        slope = (2.0 * cosine - 2.0 * rho) / (1.0 - 2.0 * rho * cosine + rho * rho)
        h = slope if n == 1 else h
        a, b, c = a - half, b - half * slope, c - half * slope * slope
    return 2.0 * (a * c - b * b) / (c - 2.0 * b * h + a * h * h)


@compiled(error_model="numpy")
def noise(angle, reading, circle, left, order, whole, told):
    """Write what the residuals tell, NaN for readings that do not count; `whole` is how many turns they cover, 0: not one."""
    kept, line = np.empty(order.size, dtype=np.int64), np.empty(order.size)
    count = 0
    for k in order:
        if not np.isnan(left[k]):
            kept[count], line[count] = k, left[k]
            count += 1
    kept, line = kept[:count], line[:count]
    told[RATIO], told[INFLATION], told[FREEDOM], told[SHIFT] = 1.0, 1.0, count - 3.0, 0.0
    before, differences = _resemblance(line)
    plain = 1.0 - 0.5 * differences
    rho = min(plain + (2.0 + 5.0 * plain) / count, MOST)
    if count < 5 or rho <= SIGNIFICANT / np.sqrt(count):
        return
    longer = factor(rho) ** 2
    told[RATIO] = np.sqrt((count - 3.0) / (count - 3.0 * min(longer, (count - 4.0) / 8.0)))
    told[INFLATION], told[FREEDOM] = factor(rho), max(count / (1.0 + 2.0 * longer) - 3.0, 1.0)
    if whole and count > 2 * COLUMNS:
        _noise_beside_form(_freed(angle, reading, kept, circle, line), line, before, whole, told)


@compiled(error_model="numpy", inline="always")  # compiled with its caller
def _noise_beside_form(moved, line, before, whole, told):
    """Write what is told of noise that lobes have been taken out of; less than 0: they could not."""
    count, step = line.size, TURN * whole / line.size
    squares, differences = _resemblance(line)
    rho = _fading(differences, count, step)
    if moved < 0.0:
        return
    rho = rho if rho > SIGNIFICANT / np.sqrt(count) else 0.0
    told[RATIO] = np.sqrt(squares / (count - COLUMNS) / before * (count - 3.0))
    told[INFLATION] = np.sqrt((count - COLUMNS) / _expected(rho, count, step)[0] * _once(rho, count, step))
    told[FREEDOM], told[SHIFT] = count - COLUMNS, moved
    if rho > 0.0:  # what walks at random is known by the few slow waves only that are left
        told[FREEDOM] = max(min(_certain(rho, count, step), SLOW * whole / rho**count), 1.0)
