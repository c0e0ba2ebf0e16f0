"""Parameters from shares of area: inverse of cumulative areas, polynomials in cells, with derivatives."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_TIMES = 60  # chosen: limit of the Newton steps
NO_AREA = 1e-9  # of the mean density, chosen: with less the map has no derivative


@compiled(error_model="numpy")
def _polynomial(powers, x):
    """Value and two derivatives."""
    value, first, second = 0.0, 0.0, 0.0
    for i in range(len(powers) - 1, -1, -1):
        second = second * x + first
        first = first * x + value
        value = value * x + powers[i]
    return value, first, 2.0 * second


@compiled(error_model="numpy")
def _root(powers, goal):
    """Place in [0, 1] at which a rising polynomial is `goal`: Newton's method within a bracket."""
    low, high, rise = 0.0, 1.0, 0.0
    for i in range(1, len(powers)):
        rise += powers[i]
    x = min(max((goal - powers[0]) / rise, 0.0), 1.0) if rise > 0.0 else 0.5
    for _ in range(_TIMES):
        value, slope, _second = _polynomial(powers, x)
        if value < goal:
            low = x
        else:
            high = x
        following = x - (value - goal) / slope
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - x) <= 1e-15:
            return following
        x = following
    return x


@compiled(error_model="numpy")
def _cell_of(powers, i, x, goal, guess):
    """Number of the cell in a row (cells, degree + 1, ...) that holds the cumulative area `goal`; a guess."""
    low, high = 0, powers.shape[1]
    above = guess == 0 or _area_before(powers, i, guess, x) <= goal
    if above and (guess == high - 1 or _area_before(powers, i, guess + 1, x) > goal):
        return guess
    while high - low > 1:
        middle = (low + high) // 2
        if _area_before(powers, i, middle, x) <= goal:
            low = middle
        else:
            high = middle
    return low


@compiled(error_model="numpy")
def _area_before(powers, i, cell, x):
    """Cumulative area up to a cell of a row, at x in its strip."""
    value = 0.0
    for a in range(powers.shape[2] - 1, -1, -1):
        value = value * x + powers[i, cell, a, 0]
    return value


@compiled(error_model="numpy")
def _area(strips):
    """Area up to the end of the last strip."""
    area = 0.0
    for power in range(strips.shape[1]):
        area += strips[-1, power]
    return area


@compiled(error_model="numpy")
def _strip(strips, goal):
    """Number of the strip that holds the cumulative area `goal`, and the place there, 0 to 1."""
    i = min(max(np.searchsorted(strips[:, 0], goal, side="right") - 1, 0), len(strips) - 1)
    return i, _root(strips[i], goal)


@compiled(error_model="numpy")
def _placed(maps, area, b, i, x, guess, rows):
    """Cell of the share b in strip i at x; u, v; W and Y there with their derivatives.

    maps: see `carry`; `rows` (3, degree + 2) is free. W, W_u, W_uu; Y_u, Y_v, Y_uu, Y_uv, Y_vv; Y_v: NaN if
    there is no area.
    """
    breaks_u, breaks_v, _strips, across, cells = maps
    h = breaks_u[i + 1] - breaks_u[i]
    w, wu, wuu = _polynomial(across[i], x)
    j = _cell_of(cells, i, x, b * w, guess)
    for power in range(rows.shape[1]):
        rows[0, power], rows[1, power], rows[2, power] = _polynomial(cells[i, j, :, power], x)
    y = _root(rows[0], b * w)
    k = breaks_v[j + 1] - breaks_v[j]
    _, yv, yvv = _polynomial(rows[0], y)
    yu, yuv, _ = _polynomial(rows[1], y)
    yuu, _, _ = _polynomial(rows[2], y)
    yv = yv / k
    side = (breaks_u[-1] - breaks_u[0]) * (breaks_v[-1] - breaks_v[0])
    if yv * side <= NO_AREA * area:
        yv = np.nan
    place = breaks_u[i] + x * h, breaks_v[j] + y * k
    return j, place, (w, wu / h, wuu / h**2), (yu / h, yv, yuu / h**2, yuv / (h * k), yvv / k**2)


@compiled(error_model="numpy")
def carry(breaks_u, breaks_v, strips, across, cells, jets, out):
    """Carry jets (m, 3, 2) of (a, b) over into jets of (u, v).

    `strips` (nu, degree + 2): area up to u in the strips of u; `across` (nu, degree + 1): its derivative W
    over 0 to 1 across a strip; `cells` (nu, nv, degree + 1, degree + 2): Y, the integral of the density by v
    up to v. Without area derivatives are NaN.
    """
    maps, area = (breaks_u, breaks_v, strips, across, cells), _area(strips)
    rows = np.empty((3, strips.shape[1]))
    i, j, x, known = 0, len(breaks_v) // 2, 0.5, -1.0
    for m in range(len(jets)):
        a, b = jets[m, 0, 0], jets[m, 0, 1]
        if a != known:
            i, x = _strip(strips, a * area)
            known = a
        j, place, (w, wu, wuu), (yu, yv, yuu, yuv, yvv) = _placed(maps, area, b, i, x, j, rows)
        a1, b1, a2, b2 = jets[m, 1, 0], jets[m, 1, 1], jets[m, 2, 0], jets[m, 2, 1]
        u1 = area * a1 / w
        u2 = (area * a2 - wu * u1**2) / w
        v1 = (b1 * w + (b * wu - yu) * u1) / yv
        bent = yuu * u1**2 + 2.0 * yuv * u1 * v1 + yvv * v1**2 + yu * u2
        v2 = (b2 * w + 2.0 * b1 * wu * u1 + b * (wuu * u1**2 + wu * u2) - bent) / yv
        out[m, 0, 0], out[m, 0, 1] = place
        out[m, 1, 0], out[m, 1, 1], out[m, 2, 0], out[m, 2, 1] = u1, v1, u2, v2


@compiled(error_model="numpy")
def carry_sides(breaks_u, breaks_v, strips, across, cells, places, out):
    """Carry places (m, 2) in the square into (u, v) with their derivatives by a and by b, (m, 3, 2)."""
    maps, area = (breaks_u, breaks_v, strips, across, cells), _area(strips)
    rows = np.empty((3, strips.shape[1]))
    i, j, x, known = 0, len(breaks_v) // 2, 0.5, -1.0
    for m in range(len(places)):
        a, b = places[m, 0], places[m, 1]
        if a != known:
            i, x = _strip(strips, a * area)
            known = a
        j, place, (w, wu, _), (yu, yv, _, _, _) = _placed(maps, area, b, i, x, j, rows)
        out[m, 0, 0], out[m, 0, 1] = place
        out[m, 1, 0], out[m, 1, 1] = area / w, (b * wu - yu) * (area / w) / yv
        out[m, 2, 0], out[m, 2, 1] = 0.0, w / yv
