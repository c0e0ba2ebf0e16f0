"""Whether a straight move between two samples of a run stays near those between them."""

from math import asin, sin, sqrt

from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def _angle(first, second, sign):
    """Angle between unit quaternions (4,), rad, the second one times a sign: exact where it is small."""
    less, more = 0.0, 0.0
    for c in range(4):
        other = sign * second[c]
        less += (first[c] - other) ** 2
        more += (first[c] + other) ** 2
    return 4.0 * asin(min(0.5 * sqrt(min(less, more)), 1.0))


@compiled(error_model="numpy")
def _turned_away(first, second, share, half, sign, turn, alike):
    """Angle of a turn (4,) from that at a share of the shortest turn, 2 `half` wide, between two, rad."""
    a, b = 1.0 - share, share
    if half >= alike:
        a, b = sin(a * half) / sin(half), sin(b * half) / sin(half)
    size, less, more = 0.0, 0.0, 0.0
    for c in range(4):
        size += (a * first[c] + b * sign * second[c]) ** 2
    size = sqrt(size)
    for c in range(4):
        told = (a * first[c] + b * sign * second[c]) / size
        less += (told - turn[c]) ** 2
        more += (told + turn[c]) ** 2
    return 4.0 * asin(min(0.5 * sqrt(min(less, more)), 1.0))


@compiled(error_model="numpy")
def chord_fits(points, turns, carried, begin, end, tolerance, lever, alike):
    """Return whether all samples between two are within the tolerance of their chord, mm.

    Parameters
    ----------
    points, turns, carried : array, (n, 3), (n, 4), (n, e)
        Places, mm, unit quaternions, and positions of axes that carry the work, times their levers, mm.
    begin, end : int
        The two samples.
    tolerance, lever, alike : float
        Of places and of turns times the lever, mm; angle below which quaternions are on a straight line, rad.
    """
    square, dot = 0.0, 0.0
    for c in range(3):
        square += (points[end, c] - points[begin, c]) ** 2
    if square == 0.0:
        return end == begin + 1
    for c in range(4):
        dot += turns[begin, c] * turns[end, c]
    sign = -1.0 if dot < 0.0 else 1.0
    half = 0.5 * _angle(turns[begin], turns[end], sign)
    for k in range(begin + 1, end):
        share, away = 0.0, 0.0
        for c in range(3):
            share += (points[k, c] - points[begin, c]) * (points[end, c] - points[begin, c])
        share = min(max(share / square, 0.0), 1.0)
        for c in range(3):
            step = points[end, c] - points[begin, c]
            away += (points[k, c] - points[begin, c] - share * step) ** 2
        if sqrt(away) > tolerance:
            return False
        turned = _turned_away(turns[begin], turns[end], share, half, sign, turns[k], alike)
        if not lever * turned <= tolerance:
            return False
        away = 0.0
        for c in range(carried.shape[1]):
            step = carried[end, c] - carried[begin, c]
            away += abs(carried[k, c] - carried[begin, c] - share * step)
        if away > tolerance:
            return False
    return True
