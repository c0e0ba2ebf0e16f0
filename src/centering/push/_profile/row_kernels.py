"""Compiled rows (duration s, velocity mm/s, acceleration mm/s^2) of pushes; a row may have duration 0."""

from math import ceil, sqrt

from sdpgrind.base.compiling.compiled import compiled

ROWS = 8  # derived: at least the rows that any push below writes

SHAPE, TOTAL, SPEED, MOST, CLOSING, GAIN, BRAKE, PUSH = range(8)
"""Columns of a push: 1 if gentle; travel (mm), speed, greatest acceleration; arguments of `gentle_rows`."""

# mm/s, chosen: at breakaway a slow tip has stored little more than F_s^2/(2 k) in the contact
_BREAKAWAY_SPEED = 1.0
CLEAR = 0.5  # mm, chosen: retraction of the tip after a push


@compiled
def _row(out, k, duration, velocity, acceleration):
    out[k, 0], out[k, 1], out[k, 2] = max(duration, 0.0), velocity, acceleration
    return k + 1


@compiled
def trapezoid_rows(distance, speed, acceleration, out):
    """Fastest move from rest to rest; return the number of rows."""
    top = min(speed, sqrt(acceleration * distance))
    rise = top / acceleration
    _row(out, 0, rise, 0.0, acceleration)
    _row(out, 1, distance / top - rise, top, 0.0)
    return _row(out, 2, rise, top, -acceleration)


@compiled
def last_rows(rows, count, travel):
    """Keep of the first `count` rows, all forward, the last `travel` (mm); return the number of rows kept."""
    k, left = count - 1, travel
    way = (rows[k, 1] + rows[k, 2] * rows[k, 0] / 2.0) * rows[k, 0]
    while way < left and k > 0:
        left -= way
        k -= 1
        way = (rows[k, 1] + rows[k, 2] * rows[k, 0] / 2.0) * rows[k, 0]
    end = rows[k, 1] + rows[k, 2] * rows[k, 0]
    kept = min(2.0 * left / (end + sqrt(max(end * end - 2.0 * rows[k, 2] * left, 0.0))), rows[k, 0])
    _row(rows, k, kept, end - rows[k, 2] * kept, rows[k, 2])
    for i in range(k, count):
        _row(rows, i - k, rows[i, 0], rows[i, 1], rows[i, 2])
    return count - k


@compiled
def _whole(time, period):
    """Round a time up to whole periods; a period of 0 leaves it."""
    return ceil(time / period - 1e-9) * period if period > 0.0 else time


@compiled
def _ramps(way, speed, slow, gain, brake, period):
    """Top speed of a run from a slow speed to rest, and the durations of its two ramps."""
    top = min(speed, sqrt((way + slow * slow * 0.5 / gain) / (0.5 / gain + 0.5 / brake)))
    rise, fall = _whole((top - slow) / gain, period), _whole(top / brake, period)
    if period > 0.0:
        top = min(top, (2.0 * way - slow * rise) / (rise + fall))
        if top <= slow:  # no room for whole periods
            return _ramps(way, speed, slow, gain, brake, 0.0)
    return top, rise, fall


@compiled
def gentle_rows(distance, speed, closing, gain, brake, period, most, out):
    """Slow until the contact has closed, faster, to rest, retracted; return the number of rows."""
    slow, half = min(_BREAKAWAY_SPEED, speed, sqrt(2.0 * brake * distance)), sqrt(CLEAR / most)
    k, way = 0, distance
    if distance > closing + slow * slow / (2.0 * brake):
        k, way = _row(out, k, closing / slow, slow, 0.0), distance - closing
    top, rise, fall = _ramps(way, speed, slow, gain, brake, period)
    if k == 0 or top <= slow:
        k = _row(out, k, (way - 0.5 * slow * slow / brake) / slow, slow, 0.0)
        k = _row(out, k, slow / brake, slow, -brake)
    else:
        k = _row(out, k, rise, slow, (top - slow) / rise)
        k = _row(out, k, (way - 0.5 * (slow + top) * rise - 0.5 * top * fall) / top, top, 0.0)
        k = _row(out, k, fall, top, -top / fall)
    k = _row(out, k, half, 0.0, -most)
    return _row(out, k, half, -most * half, most)


@compiled
def push_rows(push, reach, longer, out):
    """Rows of a push from first touch on, `reach` (mm) from the axis, stroke `longer` (mm); their number."""
    if push[SHAPE] < 0.5:
        return last_rows(
            out, trapezoid_rows(push[TOTAL] + longer, push[SPEED], push[MOST], out), reach + longer
        )
    return gentle_rows(
        reach + longer, push[SPEED], push[CLOSING], push[GAIN], push[BRAKE], 0.0, push[MOST], out
    )
