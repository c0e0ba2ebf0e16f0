"""Why no other centre is better: how steeply contacts rise about an optimum, and how far from it a better one can lie.

The height of a centre c is max |P - c| - min |P - c| for the minimum zone, -min |P - c| for the inscribed circle. With u the
directions of inner contacts and a those of outer ones, ``|P - c - v| <= |P - c| - u.v + v.v / (2 (|P - c| - |v|))`` and
``|Q - c - v| >= |Q - c| - a.v``, so that the height rises by at least the steepness times ``|v|`` less the last term.
"""

import numpy as np

from centering.roundness._distance_kernels import _towards, extremes
from sdpgrind.base.compiled import compiled

_HALF_TURN = np.pi + 0.02
"""Gap, rad, that hides a direction and its opposite only where both are all but next to a point."""


@compiled
def _height(x, y, cx, cy, zone):
    """What is to be made least at a centre, mm: the width between two circles, or else the negative radius of the empty one."""
    _, most, _, least = extremes(x, y, cx, cy)
    return most - least if zone else -least


@compiled
def steepness(x, y, cx, cy, basis, zone):
    """Least rise of the height per mm off a centre, to first order, over all directions; negative where contacts do not hold it.

    It is the distance of the origin from the border of the polygon of the differences u - a (of u itself without outer contacts).
    """
    px, py = np.empty(4), np.empty(4)
    size = 4 if zone else 3
    for k in range(size):
        px[k], py[k] = _towards(x, y, cx, cy, basis[2 + k // 2 if zone else k])
        if zone:
            ax, ay = _towards(x, y, cx, cy, basis[k % 2])
            px[k], py[k] = px[k] - ax, py[k] - ay
    least = np.inf
    for i in range(size):
        for j in range(size):
            ex, ey = py[j] - py[i], px[i] - px[j]
            length = np.hypot(ex, ey)
            if length > 0.0:
                most = -np.inf
                for k in range(size):
                    most = max(most, (px[k] * ex + py[k] * ey) / length)
                least = min(least, most)
    return least if least < np.inf else 0.0


@compiled
def ball(steep, radius):
    """Distance (mm) from an optimum of that steepness, with contacts at a radius, within which no centre is better."""
    return 2.0 * max(steep, 0.0) * radius / (1.0 + 2.0 * max(steep, 0.0))


@compiled
def zone_reach(width, inner, gap, second):
    """Distance (mm) from a centre of a width, up to half the inner radius, beyond which every centre is worse.

    Along any direction there is a point within half a gap, and one within half the other gap the other way.
    """
    slope, bend = np.cos(0.5 * gap) + np.cos(0.5 * second), np.sin(0.5 * gap) ** 2
    a, b, c = 2.0 * slope + bend, slope * inner + 2.0 * width, 4.0 * width * inner
    root = b * b - a * c
    if gap > _HALF_TURN or slope <= 0.0 or root < 0.0 or b + np.sqrt(root) < 0.5 * inner * a:
        return 0.5 * inner
    return min(c / (b + np.sqrt(root)), 0.5 * inner)


@compiled
def empty_reach(radius, outer, gap):
    """Distance (mm) from the centre of an empty circle beyond which no centre within the hull of the points has a larger one.

    Along any direction there is a point within half a gap, no further than `outer`; the hull ends before it is passed.
    """
    along, across = outer * np.cos(0.5 * gap), outer * np.sin(0.5 * gap)
    if along <= 0.0 or across >= radius:
        return outer
    return along - np.sqrt((radius - across) * (radius + across))


@compiled
def _cell_bound(x, y, cx, cy, around, zone, px, py):
    """Height at a centre, and what it is at least within a distance `around` (mm) of it.

    Bounds come from the farthest and the nearest point and from known contacts `px`, `py` (4,), of a zone two outer, two inner:
    from differences of distances of one outer and one inner point each, and from weighted means of two of those. Without a zone
    the nearest point across is taken in too: between two flats it and the nearest hold a circle, wherever along them it lies.
    """
    far, most, near, least = extremes(x, y, cx, cy)
    high = most - least if zone else -least
    if least <= 2.0 * around:
        return high, high - 2.0 * around
    rise, gx, gy = np.empty(5), np.empty(5), np.empty(5)
    last = 4 if zone else 3
    below, bend = -np.inf, 0.5 * around * around / (least - around)
    if not zone:
        opposite = _across(x, y, cx, cy, near)
        rise[4], gx[4], gy[4] = _rise(x[opposite], y[opposite], cx, cy, -1.0)
    for k in range(last + 1):
        new = k == last
        nx, ny = (x[near], y[near]) if new else (px[2 + k // 2 if zone else k], py[2 + k // 2 if zone else k])
        rise[k], gx[k], gy[k] = _rise(nx, ny, cx, cy, -1.0)
        if zone:
            fx, fy = (x[far], y[far]) if new else (px[k % 2], py[k % 2])
            below = max(below, _pair_bound(fx, fy, nx, ny, cx, cy, around))
            up, ux, uy = _rise(fx, fy, cx, cy, 1.0)
            rise[k], gx[k], gy[k] = rise[k] + up, gx[k] + ux, gy[k] + uy
    return high, max(below, _mean_bound(rise, gx, gy, around) - bend)


@compiled
def _across(x, y, cx, cy, near):
    """Nearest of the points that a centre sees more than 120 deg off a given one; that one itself where there are none."""
    dx, dy = x[near] - cx, y[near] - cy
    square, best, least = dx * dx + dy * dy, near, np.inf
    for k in range(x.size):
        ex, ey = x[k] - cx, y[k] - cy
        along, away = dx * ex + dy * ey, ex * ex + ey * ey
        if along < 0.0 and 4.0 * along * along > square * away and away < least:
            best, least = k, away
    return best


@compiled
def _rise(px, py, cx, cy, sign):
    """Distance of a point from a centre, mm, and its gradient by the centre, all with a sign."""
    dx, dy = px - cx, py - cy
    away = np.sqrt(dx * dx + dy * dy)
    return sign * away, -sign * dx / away, -sign * dy / away


@compiled
def _mean_bound(rise, gx, gy, around):
    """Least value, within a distance, of the greatest of linear functions: by means of two whose gradients cancel best."""
    below = -np.inf
    for i in range(rise.size):
        for j in range(i + 1):
            ex, ey = gx[i] - gx[j], gy[i] - gy[j]
            square = ex * ex + ey * ey
            share = min(max(-(gx[j] * ex + gy[j] * ey) / square, 0.0), 1.0) if square > 0.0 else 0.0
            slope = np.hypot(gx[j] + share * ex, gy[j] + share * ey)
            below = max(below, rise[j] + share * (rise[i] - rise[j]) - slope * around)
    return below


@compiled
def _pair_bound(fx, fy, nx, ny, cx, cy, around):
    """Least difference of the distances of two points that lie one way, within a distance `around` of a centre.

    It hardly turns: its gradient is 2 sin(angle / 2) of the angle between them, and the sine of that is their distance times that
    of the line through them over the product of theirs.
    """
    ax, ay, ux, uy = fx - cx, fy - cy, nx - cx, ny - cy
    a, u = np.sqrt(ax * ax + ay * ay), np.sqrt(ux * ux + uy * uy)
    if min(a, u) <= around or ax * ux + ay * uy <= 0.0:
        return -np.inf
    area = abs((fx - nx) * uy - (fy - ny) * ux) + around * np.hypot(fx - nx, fy - ny)
    sine = area / ((a - around) * (u - around))
    return a - u - 1.01 * sine * around if sine < 0.1 else -np.inf
