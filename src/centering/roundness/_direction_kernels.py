"""Directions of points about a centre in bins, without sorting: gaps, and first contacts of an exchange."""

import numpy as np

from centering.roundness._distance_kernels import _distance
from sdpgrind.base.compiling.compiled import compiled

_BINS = 512  # chosen: bins of a turn; gaps below 1.4 deg are not resolved
_FEW = 64  # chosen: points up to which sorting is fast and bins are too few


@compiled
def _diamond(dx, dy):
    """Place of a direction on the square |x| + |y| = 1, in [0, 4), which rises with the angle."""
    total = abs(dx) + abs(dy)
    if total == 0.0:
        return 0.0
    place = dy / total if dx >= 0.0 else 2.0 - dy / total
    return place if place >= 0.0 else place + 4.0


@compiled
def _angle(place):
    """Angle (rad, in [0, 2 pi)) of a place on the square."""
    side = min(int(place), 3)
    along = place - side
    return 0.5 * np.pi * side + np.arctan2(along, 1.0 - along)


@compiled
def gaps(x, y, cx, cy):
    """Largest and second gap of directions, rad, at least a bin; middle of the largest, rad."""
    low, high = np.full(_BINS, 9.0), np.full(_BINS, -1.0)
    for k in range(x.size):
        place = _diamond(x[k] - cx, y[k] - cy)
        b = min(int(place * (_BINS / 4)), _BINS - 1)
        low[b], high[b] = min(low[b], place), max(high[b], place)
    least = 4 * np.pi / _BINS  # a unit of place is 1 to 2 rad
    first = -1.0
    last = 0.0
    largest, second, middle = least, least, 0.0
    for b in range(_BINS):
        if high[b] < 0.0:
            continue
        here = _angle(low[b])
        if first < 0.0:
            first = here
        elif here - last > largest:
            largest, second, middle = here - last, largest, 0.5 * (here + last)
        else:
            second = max(second, here - last)
        last = _angle(high[b])
    around = first + 2 * np.pi - last
    if around > largest:
        return around, largest, 0.5 * (first + 2 * np.pi + last)
    return largest, max(second, around), middle


@compiled
def _four_about(x, y, cx, cy, basis):
    """Write two far and two near points that alternate about a centre, the extremes of four sectors."""
    sector = np.zeros(x.size, dtype=np.int8)
    if x.size <= _FEW or not _by_bins(x, y, cx, cy, sector):
        _by_order(x, y, cx, cy, sector)
    best = np.array([-np.inf, np.inf, -np.inf, np.inf])
    slot = np.array([0, 2, 1, 3])
    for k in range(x.size):
        s = sector[k]
        away = _distance(x, y, cx, cy, k)
        if (away > best[s]) if s % 2 == 0 else (away < best[s]):
            best[s], basis[slot[s]] = away, k


@compiled
def _by_bins(x, y, cx, cy, sector):
    """Assign points to four sectors of equally many filled bins; return whether at least four are filled."""
    rank = np.zeros(_BINS, dtype=np.int64)
    for k in range(x.size):
        rank[min(int(_diamond(x[k] - cx, y[k] - cy) * (_BINS / 4)), _BINS - 1)] = 1
    filled = 0
    for b in range(_BINS):
        filled += rank[b]
        rank[b] = filled - 1
    for k in range(x.size):
        sector[k] = 4 * rank[min(int(_diamond(x[k] - cx, y[k] - cy) * (_BINS / 4)), _BINS - 1)] // filled
    return filled >= 4


@compiled
def _ranked(values):
    """Indices in ascending order of values: Shell's sort, which compiles in a fraction of numpy's time."""
    order = np.arange(values.size)
    step = values.size // 2
    while step > 0:
        for k in range(step, values.size):
            this, place = order[k], k
            while place >= step and values[order[place - step]] > values[this]:
                order[place] = order[place - step]
                place -= step
            order[place] = this
        step //= 2
    return order


@compiled
def _by_order(x, y, cx, cy, sector):
    """Assign each point to one of four sectors of equally many points."""
    place = np.empty(x.size)
    for k in range(x.size):
        place[k] = _diamond(x[k] - cx, y[k] - cy)
    order = _ranked(place)
    for k in range(x.size):
        sector[order[k]] = 4 * k // x.size
