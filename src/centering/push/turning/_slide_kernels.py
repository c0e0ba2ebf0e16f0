"""Compiled slide of a ring over a turning table: one step of fifth order, and its events.

A ring is (law: `PushModel.parameters`, radius, speed of the table in rad/s); a tip is (place on the x axis,
speed toward the axis, acceleration) in mm and s. A state is its first five entries: centre, velocity, travel
over the table. Between events all is smooth: contact touches or does not, the slip is not 0.
"""

from math import sqrt

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# error_model="numpy" below: 2.5 times as fast without checks for division by zero (measured)

X, Y, V_X, V_Y, WAY, MOTION = range(6)
"""Entries of a state that the integration advances, and their number."""

_M, _K, _B, _FS, _FK, _KV = range(6)
STAGES = 7  # source: slopes in a step of Dormand and Prince (1980)
_EXACT = 1e-11  # s, chosen: accuracy of the time of an event
_MOST = 60  # chosen: most iterations of the root finder; the rule of Illinois takes far fewer
_TINY = 1e-300  # chosen: keeps divisors from 0


@compiled(error_model="numpy")
def _tip_after(tip, h):
    """Tip a time h later."""
    place, v, a = tip
    return place - (v + a * h / 2.0) * h, v + a * h, a


@compiled(error_model="numpy")
def _contact(ring, tip, state):
    """Contact force, the lesser of it and the spring force alone (> 0: contact pushes), and the normal."""
    law, r, _ = ring
    place, v, _ = tip
    x, y = state[X] - place, state[Y]
    away = sqrt(x * x + y * y)
    n_x, n_y = x / away, y / away
    spring = law[_K] * (r - away)
    force = spring - law[_B] * ((state[V_X] + v) * n_x + state[V_Y] * n_y)
    return force, min(spring, force), n_x, n_y


@compiled(error_model="numpy")
def _slip_of(ring, state):
    """Velocity over the table."""
    return state[V_X] + ring[2] * state[Y], state[V_Y] - ring[2] * state[X]


@compiled(error_model="numpy")
def _slope(ring, tip, touching, state, out):
    """Time derivatives of a slide: contact along the normal, friction against the slip."""
    law = ring[0]
    s_x, s_y = _slip_of(ring, state)
    slip = sqrt(s_x * s_x + s_y * s_y)
    drag = (law[_FK] / max(slip, _TINY) + law[_KV]) / law[_M]
    out[X], out[Y], out[WAY] = state[V_X], state[V_Y], slip
    out[V_X], out[V_Y] = -drag * s_x, -drag * s_y
    if touching:
        force, _, n_x, n_y = _contact(ring, tip, state)
        out[V_X] += force * n_x / law[_M]
        out[V_Y] += force * n_y / law[_M]


@compiled(error_model="numpy")
def _stride(ring, tip, touching, h, y, k, end):
    """One step to `end` by Dormand and Prince; slopes k[0] here, k[6] there. Return the error, mm."""
    for i in range(MOTION):
        end[i] = y[i] + h * k[0, i] / 5.0
    _slope(ring, _tip_after(tip, h / 5.0), touching, end, k[1])
    for i in range(MOTION):
        end[i] = y[i] + h * (3 / 40 * k[0, i] + 9 / 40 * k[1, i])
    _slope(ring, _tip_after(tip, 0.3 * h), touching, end, k[2])
    for i in range(MOTION):
        end[i] = y[i] + h * (44 / 45 * k[0, i] - 56 / 15 * k[1, i] + 32 / 9 * k[2, i])
    _slope(ring, _tip_after(tip, 0.8 * h), touching, end, k[3])
    for i in range(MOTION):
        gained = (
            19372 / 6561 * k[0, i] - 25360 / 2187 * k[1, i] + 64448 / 6561 * k[2, i] - 212 / 729 * k[3, i]
        )
        end[i] = y[i] + h * gained
    _slope(ring, _tip_after(tip, 8 / 9 * h), touching, end, k[4])
    for i in range(MOTION):
        gained = 9017 / 3168 * k[0, i] - 355 / 33 * k[1, i] + 46732 / 5247 * k[2, i] + 49 / 176 * k[3, i]
        end[i] = y[i] + h * (gained - 5103 / 18656 * k[4, i])
    after = _tip_after(tip, h)
    _slope(ring, after, touching, end, k[5])
    for i in range(MOTION):
        gained = (
            35 / 384 * k[0, i]
            + 500 / 1113 * k[2, i]
            + 125 / 192 * k[3, i]
            - 2187 / 6784 * k[4, i]
            + 11 / 84 * k[5, i]
        )
        end[i] = y[i] + h * gained
    _slope(ring, after, touching, end, k[6])
    return _error(ring[0], h, k)


@compiled(error_model="numpy")
def _error(law, h, k):
    """Difference of the two orders, mm; velocities are divided by the contact's natural frequency."""
    worst, frequency = 0.0, sqrt(law[_K] / law[_M])
    for i in range(V_Y + 1):
        first = 71 / 57600 * k[0, i] - 71 / 16695 * k[2, i] + 71 / 1920 * k[3, i]
        off = h * abs(first - 17253 / 339200 * k[4, i] + 22 / 525 * k[5, i] - k[6, i] / 40)
        worst = max(worst, off if i < V_X else off / frequency)
    return worst


@compiled(error_model="numpy")
def _to_event(ring, tip, touching, h, y, k, end):
    """Shorten a step to the start or end of the contact, by the rule of Illinois; return the time."""
    sign, low, high, side = -1.0 if touching else 1.0, 0.0, h, 0
    before = min(sign * _contact(ring, tip, y)[1], -_TINY)
    after = sign * _contact(ring, _tip_after(tip, h), end)[1]
    for _ in range(_MOST):
        if high - low <= _EXACT:
            break
        t = min(max(high - after * (high - low) / (after - before), low + _EXACT / 3), high - _EXACT / 3)
        _stride(ring, tip, touching, t, y, k, end)
        now = sign * _contact(ring, _tip_after(tip, t), end)[1]
        if now > 0.0:
            high, after, before, side = t, now, before / 2 if side > 0 else before, 1
        else:
            low, before, after, side = t, min(now, -_TINY), after / 2 if side < 0 else after, -1
    _stride(ring, tip, touching, high, y, k, end)
    return high


@compiled(error_model="numpy")
def _creep(ring, tip, h, y, end):
    """One short step with all forces but friction constant: friction stops the ring and does not reverse it.

    Return whether the ring has stopped. It begins and ends slides, where the direction of friction is not
    smooth.
    """
    law, _, w = ring
    m = law[_M]
    for i in range(MOTION):
        end[i] = y[i]
    end[X], end[Y] = y[X] + y[V_X] * h / 2.0, y[Y] + y[V_Y] * h / 2.0
    force, pushes, n_x, n_y = _contact(ring, _tip_after(tip, h / 2.0), end)
    force = force if pushes > 0.0 else 0.0
    s_x, s_y = _slip_of(ring, end)
    s_x, s_y = s_x + h * force * n_x / m, s_y + h * force * n_y / m
    slip, lost = sqrt(s_x * s_x + s_y * s_y), h * law[_FK] / m
    kept = 0.0 if slip <= lost else (1.0 - lost / slip) / (1.0 + h * law[_KV] / m)
    end[V_X], end[V_Y] = -w * end[Y] + kept * s_x, w * end[X] + kept * s_y
    end[X], end[Y] = end[X] + end[V_X] * h / 2.0, end[Y] + end[V_Y] * h / 2.0
    end[WAY] = y[WAY] + kept * slip * h
    return slip <= lost


@compiled(error_model="numpy")
def _time_left(ring, y, slopes):
    """Time to stop at the present deceleration, s; infinite where the slide accelerates."""
    w = ring[2]
    s_x, s_y = _slip_of(ring, y)
    braked = -(s_x * (slopes[V_X] + w * y[V_Y]) + s_y * (slopes[V_Y] - w * y[V_X]))
    return (s_x * s_x + s_y * s_y) / braked if braked > 0.0 else np.inf


@compiled(error_model="numpy")
def _gain(ring, tip, y, slopes):
    """Contact force and its time derivative."""
    law, _, _ = ring
    _, v, a = tip
    force, _, n_x, n_y = _contact(ring, tip, y)
    u_x, u_y = y[V_X] + v, y[V_Y]
    across, away = u_y * n_x - u_x * n_y, max(y[X] - tip[0], _TINY)
    away = away / n_x
    parting = (slopes[V_X] + a) * n_x + slopes[V_Y] * n_y + across * across / away
    return force, -law[_K] * (u_x * n_x + u_y * n_y) - law[_B] * parting


@compiled(error_model="numpy")
def _crest(h, first, rise, last, fall):
    """Greatest force in a step, from values and derivatives at both ends."""
    if not rise > 0.0 > fall:
        return max(first, last)
    t = h * rise / (rise - fall)
    return max(first, last, 0.5 * (first + rise * t / 2.0 + last - fall * (h - t) / 2.0))
