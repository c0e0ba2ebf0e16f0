"""Proof that no other centre is better: steepness of the height about an optimum, and bounds away from it.

The height of a centre c is max |P - c| - min |P - c| for the minimum zone, -min |P - c| for the inscribed
circle. With u the directions of inner contacts and a those of outer ones, ``|P - c - v| <= |P - c| - u.v +
v.v / (2 (|P - c| - |v|))`` and ``|Q - c - v| >= |Q - c| - a.v``: the height rises by at least the steepness
times ``|v|`` minus the last term.
"""

import numpy as np

from centering.roundness._distance_kernels import _towards, extremes
from sdpgrind.base.compiling.compiled import compiled

_HALF_TURN = np.pi + 0.02  # chosen: rad; a larger gap may hide a direction and its opposite


@compiled
def _height(x, y, cx, cy, zone):
    """Height at a centre, mm, to be minimized: width of the zone, or negative radius of the empty circle."""
    _, most, _, least = extremes(x, y, cx, cy)
    return most - least if zone else -least


@compiled
def steepness(x, y, cx, cy, basis, zone):
    """Least first-order rise of height per mm off a centre over all directions; < 0: not held by contacts.

    It is the distance of the origin from the border of the polygon of the differences u - a (of u without
    outer contacts).
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
    """Distance (mm) from an optimum of this steepness and contact radius within which no centre is better."""
    return 2.0 * max(steep, 0.0) * radius / (1.0 + 2.0 * max(steep, 0.0))


@compiled
def zone_reach(width, inner, gap, second):
    """Distance (mm) from a zone's centre, up to half the inner radius, beyond which every centre is worse.

    Along any direction there is a point within half a gap, and one within half the other gap the opposite
    way.
    """
    slope, bend = np.cos(0.5 * gap) + np.cos(0.5 * second), np.sin(0.5 * gap) ** 2
    a, b, c = 2.0 * slope + bend, slope * inner + 2.0 * width, 4.0 * width * inner
    root = b * b - a * c
    if gap > _HALF_TURN or slope <= 0.0 or root < 0.0 or b + np.sqrt(root) < 0.5 * inner * a:
        return 0.5 * inner
    return min(c / (b + np.sqrt(root)), 0.5 * inner)


@compiled
def empty_reach(radius, outer, gap):
    """Distance (mm) from an empty circle's centre beyond which no centre in the hull has a larger circle.

    Along any direction there is a point within half a gap, at most at `outer`; the hull ends before it.
    """
    along, across = outer * np.cos(0.5 * gap), outer * np.sin(0.5 * gap)
    if along <= 0.0 or across >= radius:
        return outer
    return along - np.sqrt((radius - across) * (radius + across))


@compiled
def _cell_bound(x, y, cx, cy, around, zone, px, py):
    """Height at a centre, and its lower bound within a distance `around` (mm).

    Bounds come from the farthest and nearest point and known contacts `px`, `py` (4,), for a zone two outer
    and two inner: from differences of distances of an outer and an inner point, and weighted means of two of
    them. For an empty circle the nearest opposite point is added: between two flats it holds the circle
    together with the nearest.
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
    """Nearest point more than 120 deg from a given one, seen from a centre; the given one if none."""
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
    """Signed distance of a point from a centre, mm, and its gradient by the centre."""
    dx, dy = px - cx, py - cy
    away = np.sqrt(dx * dx + dy * dy)
    return sign * away, -sign * dx / away, -sign * dy / away


@compiled
def _mean_bound(rise, gx, gy, around):
    """Lower bound of the maximum of linear functions within a distance, by pairs of opposed gradients."""
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
    """Lower bound of the difference of distances of two points in one direction, within `around` of a centre.

    Its gradient is 2 sin(angle / 2), with the angle between them; the sine of that is their distance times
    that of the line through them over the product of theirs.
    """
    ax, ay, ux, uy = fx - cx, fy - cy, nx - cx, ny - cy
    a, u = np.sqrt(ax * ax + ay * ay), np.sqrt(ux * ux + uy * uy)
    if min(a, u) <= around or ax * ux + ay * uy <= 0.0:
        return -np.inf
    area = abs((fx - nx) * uy - (fy - ny) * ux) + around * np.hypot(fx - nx, fy - ny)
    sine = area / ((a - around) * (u - around))
    return a - u - 1.01 * sine * around if sine < 0.1 else -np.inf
