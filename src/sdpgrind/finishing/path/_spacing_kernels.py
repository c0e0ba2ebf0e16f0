"""Lines in sequence, each as far from the last as the widest gap allows."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled


@compiled
def march(total, slope, across, gap, count):
    """Places (count,) of lines: the first half a `gap` from the border, the others one `gap` from the last.

    total, slope (rows, m): distance from the border over `across` (m,), and its derivative: cubic between,
    straight beyond.
    """
    rows = total.shape[0]
    lines, interval, reached = np.empty(count), np.zeros(rows, np.int64), np.zeros(rows)
    nearest = rows // 2
    for k in range(count):
        step, place, near = gap if k else 0.5 * gap, np.inf, across.size
        for turn in range(-1, rows):  # first the row of the last line: most others are farther then
            i = turn if turn >= 0 else nearest
            wanted = reached[i] + step
            while interval[i] < across.size - 1 and total[i, interval[i] + 1] < wanted:
                interval[i] += 1
            if not _farther(total[i], slope[i], across, interval[i], wanted, near, place):
                found = _place(total[i], slope[i], across, interval[i], wanted)
                if found < place:
                    place, nearest, near = found, i, interval[i]
        lines[k] = place
        for i in range(rows):
            reached[i] = _value(total[i], slope[i], across, place)
    return lines


@compiled
def _farther(total, slope, across, j, wanted, near, place):
    """Whether a row has the distance `wanted`, in interval `j`, beyond a place in interval `near`.

    By more than the error of `_place`, lest rows that are equal be told apart.
    """
    if j != near or near == across.size - 1:
        return j > near
    share = (place - across[j]) / (across[j + 1] - across[j])
    return _cubic(total, slope, across, j, share) < wanted - 1e-11 * total[-1]


@compiled
def _value(total, slope, across, place):
    """Distance of a place from the border in one row."""
    last = across.size - 1
    if place >= across[last]:
        return total[last] + slope[last] * (place - across[last])
    j = min(max(np.searchsorted(across, place) - 1, 0), last - 1)
    return _cubic(total, slope, across, j, (place - across[j]) / (across[j + 1] - across[j]))


@compiled
def _cubic(total, slope, across, j, t):
    """Distance in interval `j` at the share `t`: Hermite's cubic."""
    h, rise = across[j + 1] - across[j], total[j + 1] - total[j]
    left, right = slope[j] * h, slope[j + 1] * h
    return total[j] + t * (left + t * (3.0 * rise - 2.0 * left - right + t * (left + right - 2.0 * rise)))


@compiled
def _place(total, slope, across, j, wanted):
    """Place with the distance `wanted` in one row, in interval `j`: regula falsi (Illinois)."""
    last = across.size - 1
    if j == last and slope[last] <= 0.0:
        return np.inf  # all of the row is one point
    if j == last:
        return across[last] + (wanted - total[last]) / slope[last]
    low, high = 0.0, 1.0
    below, above = total[j] - wanted, total[j + 1] - wanted
    for _ in range(60):
        t = (low * above - high * below) / (above - below)
        found = _cubic(total, slope, across, j, t) - wanted
        if abs(found) <= 1e-12 * total[last] or high - low < 1e-15:
            break
        if found < 0.0:
            low, below, above = t, found, 0.5 * above
        else:
            high, above, below = t, found, 0.5 * below
    return across[j] + t * (across[j + 1] - across[j])
