"""Position of a ring's rim on the push line, Mears (3.1) to (3.3); angle from alignment (rad), mm."""

from math import cos, pi, sin, sqrt

from sdpgrind.base.compiling.compiled import compiled

# chosen: each round is twelve times finer; the place to 1e-8 rad, the value to rounding
_PLACES, _CLOSER = 24, 8


@compiled
def advance(angle, offset, radius):
    """Advance of the rim until alignment, d_lead of Mears (5.5); exact for small offsets and angles."""
    half, across = sin(angle / 2.0), offset * sin(angle)
    return 2.0 * offset * half * half + across * across / (radius + sqrt(radius * radius - across * across))


@compiled
def reach(angle, offset, radius):
    """Distance of the rim beyond that of a ring on the axis."""
    return offset - advance(angle, offset, radius)


@compiled
def motion(angle, offset, radius):
    """Distance of the rim from the axis, and its derivatives by the angle, Mears (3.1) and (3.2)."""
    c, s = offset * cos(angle), offset * sin(angle)
    g = sqrt(radius * radius - s * s)
    return c + g, -s - s * c / g, -c - (c * c - s * s) / g - (s * c) ** 2 / g**3


@compiled
def greatest(offset, radius, order):
    """Greatest absolute slope (order 1) or curvature (2) of the rim in a turn, mm; by ever finer sampling."""
    low, high, most = 0.0, pi, 0.0
    for _ in range(_CLOSER):
        step, best, most = (high - low) / _PLACES, low, 0.0
        for k in range(_PLACES + 1):
            now = abs(motion(low + k * step, offset, radius)[order])
            if now > most:
                most, best = now, low + k * step
        low, high = best - step, best + step
    return most


@compiled
def ahead(rows, until, angle, offset, radius, w, total, places):
    """Greatest lead of the rim over a tip that runs up by rows from `total` before the axis' rim.

    The ring is at `angle` (rad) before alignment at the time `until` (s); `places` times before it are
    compared.
    """
    most, gone, row, begun = -total, 0.0, 0, 0.0
    for k in range(places):
        t = until * k / places
        while row < rows.shape[0] - 1 and t >= begun + rows[row, 0]:
            gone += (rows[row, 1] + 0.5 * rows[row, 2] * rows[row, 0]) * rows[row, 0]
            begun += rows[row, 0]
            row += 1
        into = t - begun
        way = gone + (rows[row, 1] + 0.5 * rows[row, 2] * into) * into
        most = max(most, reach(angle + w * (until - t), offset, radius) - (total - way))
    return most
