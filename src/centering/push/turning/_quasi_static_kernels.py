"""Compiled push on a turning table without inertia, followed backward from the axis to first touch.

Lengths mm, times s. The tip moves on the x axis toward the table's axis; its profile is rows of duration,
initial velocity and acceleration. The table turns at a constant speed w (rad/s, from x to y).
"""

from math import atan2, ceil, cos, sin, sqrt

from sdpgrind.base.compiling.compiled import compiled

# Output of `touch_back`: polar angle of the centre at first touch (rad), time from the start of the profile
# (s), travel of the tip after it (mm); 1 where it was found.
ANGLE, TIME, TRAVEL, FOUND, TOUCHES = range(5)

_FINE = 0.02  # rad, chosen: turn in a step of the path; the error, of fourth order, is then 1e-9
_HALVINGS = 60  # derived: halvings after which the interval is below rounding


@compiled
def _slope(r, w, v, x, beta):
    """Turn of the normal without force across: R beta' = w (R - p cos beta) + v sin beta, p = R + x."""
    half = sin(beta / 2.0)
    return (w * (2.0 * r * half * half - x * cos(beta)) + v * sin(beta)) / r


@compiled
def _earlier(r, w, v, a, x, beta, h):
    """Tip and normal a time h before x and beta, where the tip has speed v; one step of fourth order."""
    x_half, x_full = x + v * h / 2.0 - a * h * h / 8.0, x + v * h - a * h * h / 2.0
    v_half, v_full = v - a * h / 2.0, v - a * h
    k1 = _slope(r, w, v, x, beta)
    k2 = _slope(r, w, v_half, x_half, beta - h / 2.0 * k1)
    k3 = _slope(r, w, v_half, x_half, beta - h / 2.0 * k2)
    k4 = _slope(r, w, v_full, x_full, beta - h * k3)
    return x_full, beta - h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


@compiled
def _off_axis(r, x, beta):
    """Distance of the ring's centre from the axis."""
    return sqrt(x * x + 4.0 * (r + x) * r * sin(beta / 2.0) ** 2)


@compiled
def touch_back(r, w, segments, offset, out):
    """Follow the push backward from the axis until the ring is `offset` away; write the touch."""
    x, beta, left = 0.0, 0.0, 0.0
    out[FOUND] = 0.0
    for k in range(segments.shape[0]):
        left += segments[k, 0]
    for k in range(segments.shape[0] - 1, -1, -1):
        a = segments[k, 2]
        v = segments[k, 1] + a * segments[k, 0]
        steps = ceil(segments[k, 0] * (abs(w) + abs(v) / r + abs(segments[k, 1]) / r) / _FINE) + 4
        h = segments[k, 0] / steps
        for _ in range(steps):
            x_next, beta_next = _earlier(r, w, v, a, x, beta, h)
            if _off_axis(r, x_next, beta_next) >= offset:
                low, high = 0.0, h
                for _ in range(_HALVINGS):
                    middle = (low + high) / 2.0
                    x_next, beta_next = _earlier(r, w, v, a, x, beta, middle)
                    if _off_axis(r, x_next, beta_next) >= offset:
                        high = middle
                    else:
                        low = middle
                out[ANGLE] = atan2(-r * sin(beta_next), x_next + 2.0 * r * sin(beta_next / 2.0) ** 2)
                out[TIME], out[TRAVEL], out[FOUND] = left - high, x_next, 1.0
                return
            x, beta, v, left = x_next, beta_next, v - a * h, left - h
