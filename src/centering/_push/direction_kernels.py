"""Compiled core of a push on a turning table: where the ring must be at first touch, and where it goes, in the plane.

Lengths mm, times s, forces N. The tip moves on the x axis toward the table's axis; its profile is rows of duration, velocity at
the start and acceleration. The table turns by a constant speed w (rad/s, from x to y). The ring's centre is c, the tip's face at
p x^, the normal n = (c - p x^)/|c - p x^|. All positions are in the frame of the ground. Arrays are changed in place; serial.
"""

from math import atan2, ceil, cos, hypot, sin, sqrt
from typing import Any

from numba import njit

_OPTIONS: Any = {"cache": True, "nogil": True}

# What `touch_back` writes: polar angle of the centre at first touch, time from the start of the profile, travel of the tip after
# it; whether it was found.
ANGLE, TIME, TRAVEL, FOUND, TOUCHES = range(5)

# State of a ring under a tip: centre, its velocity, distance of the tip from the axis, 1 where the ring rests on the table;
# contact force now and at most; time since the start, of the first touch (< 0: none yet); way over the table, that of the slide
# without contact now, and the longest.
X, Y, V_X, V_Y, TIP, RESTS, FORCE, PEAK_FORCE, CLOCK, TOUCH, WAY, FREE, FREE_MAX, STATES = range(14)

# Rows of the parameters of a push, as `PushModel.parameters` gives them.
_M, _K, _B, _FS, _FK, _KV = range(6)

_FINE = 0.02  # rad: turn of a step of the quasi-static path; its error of fourth order is then 1e-9
_HALVINGS = 60
_SHORTEST = 1e-7  # s: so finely a first touch is met


@njit(**_OPTIONS)
def _slope(r, w, v, x, beta):
    """Turn of the contact normal when no force acts across it: R beta' = w (R - p cos beta) + v sin beta with p = R + x."""
    half = sin(beta / 2.0)
    return (w * (2.0 * r * half * half - x * cos(beta)) + v * sin(beta)) / r


@njit(**_OPTIONS)
def _earlier(r, w, v, a, x, beta, h):
    """Tip and normal a time h before x and beta, the tip then at speed v with acceleration a: one step of fourth order."""
    x_half, x_full = x + v * h / 2.0 - a * h * h / 8.0, x + v * h - a * h * h / 2.0
    v_half, v_full = v - a * h / 2.0, v - a * h
    k1 = _slope(r, w, v, x, beta)
    k2 = _slope(r, w, v_half, x_half, beta - h / 2.0 * k1)
    k3 = _slope(r, w, v_half, x_half, beta - h / 2.0 * k2)
    k4 = _slope(r, w, v_full, x_full, beta - h * k3)
    return x_full, beta - h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


@njit(**_OPTIONS)
def _off_axis(r, x, beta):
    """Distance of the ring's centre from the axis."""
    return sqrt(x * x + 4.0 * (r + x) * r * sin(beta / 2.0) ** 2)


@njit(**_OPTIONS)
def touch_back(r, w, segments, offset, out):
    """Follow the quasi-static push backward from the axis until the ring is `offset` away: where and when it is touched."""
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


@njit(**_OPTIONS)
def _contact(parameters, r, tip, v, state):
    """Contact force for a tip at `tip` that moves at v toward the axis, the normal, the gap (> 0 apart), how fast it closes."""
    x, y = state[X] - tip, state[Y]
    away = hypot(x, y)
    n_x, n_y = x / away, y / away
    closing = -((state[V_X] + v) * n_x + state[V_Y] * n_y)
    force = max(0.0, parameters[_K] * (r - away) + parameters[_B] * closing) if away < r else 0.0
    return force, n_x, n_y, away - r, closing


@njit(**_OPTIONS)
def _turn(w, h, state):
    """Carry a ring that rests on the table along with it."""
    c, s = cos(w * h), sin(w * h)
    x, y = state[X], state[Y]
    state[X], state[Y] = c * x - s * y, s * x + c * y
    state[V_X], state[V_Y] = -w * state[Y], w * state[X]


@njit(**_OPTIONS)
def _slide(parameters, r, w, tip, v, h, state):
    """Advance a ring that slides: half a step along, the forces, half a step along; friction stops, it does not reverse."""
    m = parameters[_M]
    state[X] += state[V_X] * h / 2.0
    state[Y] += state[V_Y] * h / 2.0
    force, n_x, n_y, _, _ = _contact(parameters, r, tip, v, state)
    slip_x = state[V_X] + h * force * n_x / m + w * state[Y]
    slip_y = state[V_Y] + h * force * n_y / m - w * state[X]
    slip = hypot(slip_x, slip_y)
    lost = h * parameters[_FK] / m
    state[RESTS] = 1.0 if slip <= lost else 0.0
    kept = 0.0 if slip <= lost else (1.0 - lost / slip) / (1.0 + h * parameters[_KV] / m)
    state[V_X], state[V_Y] = -w * state[Y] + kept * slip_x, w * state[X] + kept * slip_y
    state[X] += state[V_X] * h / 2.0
    state[Y] += state[V_Y] * h / 2.0
    state[WAY] += kept * slip * h
    state[FREE] = 0.0 if force > 0.0 else state[FREE] + kept * slip * h
    state[FREE_MAX] = max(state[FREE_MAX], state[FREE])
    return force


@njit(**_OPTIONS)
def push_on_table(parameters, radius, spindle_speed, segments, step, state):
    """Move the tip by a profile and the ring by what acts on it: contact along the normal, friction against the slip, inertia.

    Steps of `step` (s); while the ring rests out of reach they are as long as the gap allows. Called again, it goes on from
    `state`. Positions err by the square of the step, over a slide of the time t also by w^2 d t/2 times the step; the begin and
    the end of a slide by one step.
    """
    m, w, r = parameters[_M], spindle_speed, radius
    for k in range(segments.shape[0]):
        left, v, a = segments[k, 0], segments[k, 1], segments[k, 2]
        while left > 1e-12:
            force, n_x, n_y, gap, closing = _contact(parameters, r, state[TIP], v, state)
            h = min(step, left)
            if state[RESTS] > 0.5:
                needed_x = -m * w * w * state[X] - force * n_x
                needed_y = -m * w * w * state[Y] - force * n_y
                if hypot(needed_x, needed_y) > parameters[_FS]:
                    state[RESTS] = 0.0
                elif gap >= 0.0:
                    fastest = max(v, v + a * left, 0.0) + abs(w) * hypot(state[X], state[Y])
                    h = min(max(step if gap > 2.0 * step * closing else _SHORTEST, 0.5 * gap / (fastest + 1e-9)), left)
            if force > 0.0 and state[TOUCH] < 0.0:
                state[TOUCH] = state[CLOCK]
            if state[RESTS] > 0.5:
                _turn(w, h, state)
                state[FREE] = 0.0
            else:
                force = _slide(parameters, r, w, state[TIP] - (v + a * h / 4.0) * h / 2.0, v + a * h / 2.0, h, state)
            state[FORCE] = force
            state[PEAK_FORCE] = max(state[PEAK_FORCE], force)
            state[TIP] -= (v + a * h / 2.0) * h
            state[CLOCK] += h
            v += a * h
            left -= h
