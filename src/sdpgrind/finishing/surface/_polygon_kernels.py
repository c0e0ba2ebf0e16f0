"""Polygons in the parameters of a surface: crossings of their sides, places inside."""

from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def _side(ax, ay, bx, by, px, py):
    """Twice the area of the triangle a, b, p: > 0 on the left of a to b."""
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@compiled(error_model="numpy")
def first_crossing(one, other, same):
    """Index of the first pair i * len(other) + j of sides that cross inside both, or -1.

    `one` and `other` (n, 4): starts and ends of sides; `same`: both are the same polygon.
    """
    count = len(other)
    for i in range(len(one)):
        ax, ay, bx, by = one[i, 0], one[i, 1], one[i, 2], one[i, 3]
        low_x, high_x, low_y, high_y = min(ax, bx), max(ax, bx), min(ay, by), max(ay, by)
        for j in range(i + 2 if same else 0, count):
            cx, cy, dx, dy = other[j, 0], other[j, 1], other[j, 2], other[j, 3]
            if min(cx, dx) > high_x or max(cx, dx) < low_x or min(cy, dy) > high_y or max(cy, dy) < low_y:
                continue
            if same and i == 0 and j == count - 1:
                continue
            if (
                _side(ax, ay, bx, by, cx, cy) * _side(ax, ay, bx, by, dx, dy) < 0.0
                and _side(cx, cy, dx, dy, ax, ay) * _side(cx, cy, dx, dy, bx, by) < 0.0
            ):
                return i * count + j
    return -1


@compiled(error_model="numpy")
def even_odd(sides, band, begin, low, high, width, places, inside):
    """Fill `inside` (m,) for places (m, 2): an odd number of sides (n, 4) crosses the ray to greater u.

    band, begin: numbers of sides band by band, of a width in v, from `low` to `high`; where each band begins.
    """
    for k in range(len(places)):
        x, y = places[k, 0], places[k, 1]
        odd = False
        if low <= y < high:
            at = int((y - low) / width)
            for i in band[begin[at] : begin[at + 1]]:
                ay, by = sides[i, 1], sides[i, 3]
                if (ay > y) != (by > y):
                    ax, bx = sides[i, 0], sides[i, 2]
                    if x < ax + (y - ay) / (by - ay) * (bx - ax):
                        odd = not odd
        inside[k] = odd
