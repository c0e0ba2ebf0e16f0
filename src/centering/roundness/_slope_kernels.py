"""Highest rise within a window that goes round a turn."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

_ROUNDING = 1e-9  # chosen: of the window; both ends of one on a grid count


@compiled
def steepest_window(angle, values, window):
    """Greatest difference of values in a window, where it begins, and the greatest between its two ends.

    `angle` rises over less than a turn; ends are the first and the last point within a window. Each point
    enters and leaves two queues once: of values that may become the highest and the lowest of a window.
    """
    n = angle.size
    high, low = np.empty(2 * n, np.int64), np.empty(2 * n, np.int64)
    high_first = high_end = low_first = low_end = 0
    best, at, ends, last = -1.0, 0.0, 0.0, -1
    for first in range(n):
        while last + 1 < first + n and _angle(angle, last + 1) <= angle[first] + window * (1 + _ROUNDING):
            last += 1
            value = values[last % n]
            while high_end > high_first and values[high[high_end - 1] % n] <= value:
                high_end -= 1
            while low_end > low_first and values[low[low_end - 1] % n] >= value:
                low_end -= 1
            high[high_end], low[low_end] = last, last
            high_end, low_end = high_end + 1, low_end + 1
        high_first += high[high_first] < first
        low_first += low[low_first] < first
        rise = values[high[high_first] % n] - values[low[low_first] % n]
        if rise > best:
            best, at = rise, angle[first]
        ends = max(ends, abs(values[last % n] - values[first]))
    return best, at, ends


@compiled
def _angle(angle, k):
    """Angle of a point that may be of the next turn."""
    return angle[k] if k < angle.size else angle[k - angle.size] + 2 * np.pi
