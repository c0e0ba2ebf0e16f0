"""Compiled rows (duration s, velocity mm/s, acceleration mm/s^2) of pushes; rows may have no length."""

from math import ceil, sqrt

from sdpgrind.base.compiled import compiled

ROWS = 8
"""So many rows at most has a push."""

SHAPE, TOTAL, SPEED, MOST, CLOSING, GAIN, BRAKE, PUSH = range(8)
"""Columns of a push: 1 where it is gentle; the tip's travel (mm), speed and greatest acceleration; what `gentle_rows` takes."""

_BREAKAWAY_SPEED = (
    1.0  # mm/s: what is stored in the contact when the part breaks away is F_s^2/(2 k), and little more
)
_CLEAR = 0.5  # chosen: mm that the tip is drawn back by


@compiled
def _row(out, k, duration, velocity, acceleration):
    out[k, 0], out[k, 1], out[k, 2] = max(duration, 0.0), velocity, acceleration
    return k + 1


@compiled
def trapezoid_rows(distance, speed, acceleration, out):
    """From rest to rest, as fast as may be; return how many rows."""
    top = min(speed, sqrt(acceleration * distance))
    rise = top / acceleration
    _row(out, 0, rise, 0.0, acceleration)
    _row(out, 1, distance / top - rise, top, 0.0)
    return _row(out, 2, rise, top, -acceleration)


@compiled
def last_rows(rows, count, travel):
    """Leave of the first `count` rows, all forward, what the tip does on its last `travel`; return how many rows that are."""
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
    """A time, made longer to a whole number of periods, where these are not 0."""
    return ceil(time / period - 1e-9) * period if period > 0.0 else time


@compiled
def _ramps(way, speed, slow, gain, brake, period):
    """Top speed of a run that begins at a slow one and ends at rest, times of its two ramps."""
    top = min(speed, sqrt((way + slow * slow * 0.5 / gain) / (0.5 / gain + 0.5 / brake)))
    rise, fall = _whole((top - slow) / gain, period), _whole(top / brake, period)
    if period > 0.0:
        top = min(top, (2.0 * way - slow * rise) / (rise + fall))
        if top <= slow:  # no room for whole periods
            return _ramps(way, speed, slow, gain, brake, 0.0)
    return top, rise, fall


@compiled
def gentle_rows(distance, speed, closing, gain, brake, period, most, out):
    """Slow until the contact has closed, faster, to rest, and drawn back; return how many rows."""
    slow, half, k, way = (
        min(_BREAKAWAY_SPEED, speed, sqrt(2.0 * brake * distance)),
        sqrt(_CLEAR / most),
        0,
        distance,
    )
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
    """A push from first touch on, where `reach` (mm) is left to the axis, with a stroke so much longer; how many rows."""
    if push[SHAPE] < 0.5:
        return last_rows(
            out, trapezoid_rows(push[TOTAL] + longer, push[SPEED], push[MOST], out), reach + longer
        )
    return gentle_rows(
        reach + longer, push[SPEED], push[CLOSING], push[GAIN], push[BRAKE], 0.0, push[MOST], out
    )
