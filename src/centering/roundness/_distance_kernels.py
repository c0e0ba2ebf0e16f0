"""Geometry of the exchanges: farthest and nearest point, crossing bisectors, contacts about a centre."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_PARALLEL = 1e-14  # chosen: sine of the angle between two chords with parallel bisectors, rounding
_NEAREST = 1e-300  # chosen: mm; least distance, avoids a division by 0
_EVEN = 1e-15  # chosen: area between unit vectors that is rounding


@compiled
def extremes(x, y, cx, cy):
    """Index and distance (mm) of the point farthest from a centre, then of the nearest."""
    far, near, most, least = 0, 0, -1.0, np.inf
    for k in range(x.size):
        square = (x[k] - cx) * (x[k] - cx) + (y[k] - cy) * (y[k] - cy)
        if square > most:
            far, most = k, square
        if square < least:
            near, least = k, square
    return far, np.sqrt(most), near, np.sqrt(least)


@compiled
def _distance(x, y, cx, cy, k):
    """Distance of point k from a centre, mm."""
    return np.sqrt((x[k] - cx) * (x[k] - cx) + (y[k] - cy) * (y[k] - cy))


@compiled
def _towards(x, y, cx, cy, k):
    """Unit vector from a centre to point k; 0 for a point on the centre."""
    dx, dy = x[k] - cx, y[k] - cy
    length = max(np.sqrt(dx * dx + dy * dy), _NEAREST)
    return dx / length, dy / length


@compiled
def _crossing(x, y, i, j, k, m):
    """Centre (mm) as far from point i as from j, and from k as from m; infinite for parallel bisectors."""
    ax, ay, bx, by = x[j] - x[i], y[j] - y[i], x[m] - x[k], y[m] - y[k]
    det = ax * by - ay * bx
    if abs(det) <= _PARALLEL * (np.hypot(ax, ay) * np.hypot(bx, by)):
        return np.inf, np.inf
    midx, midy = 0.5 * (x[i] + x[j]), 0.5 * (y[i] + y[j])  # about a chord's middle no digits are lost
    b = bx * (0.5 * (x[k] + x[m]) - midx) + by * (0.5 * (y[k] + y[m]) - midy)
    return midx - ay * b / det, midy + ax * b / det


@compiled
def _standing(x, y, cx, cy, i, j, k):
    """Depth of a centre in the triangle of the directions of three points; < 0 outside, 0 up to rounding."""
    px, py = _towards(x, y, cx, cy, i)
    qx, qy = _towards(x, y, cx, cy, j)
    rx, ry = _towards(x, y, cx, cy, k)
    one, two, three = px * qy - py * qx, qx * ry - qy * rx, rx * py - ry * px
    stood = max(min(one, two, three), min(-one, -two, -three))
    return 0.0 if abs(stood) < _EVEN else stood


@compiled
def _parting(x, y, cx, cy, p, q, i, j):
    """Degree to which points i and j separate p from q in direction; < 0 if not, 0 up to rounding."""
    ux, uy = _towards(x, y, cx, cy, i)
    vx, vy = _towards(x, y, cx, cy, j)
    px, py = _towards(x, y, cx, cy, p)
    qx, qy = _towards(x, y, cx, cy, q)
    one, two = (vx - ux) * (py - uy) - (vy - uy) * (px - ux), (vx - ux) * (qy - uy) - (vy - uy) * (qx - ux)
    parted = max(min(one, -two), min(-one, two))
    return 0.0 if abs(parted) < _EVEN else parted
