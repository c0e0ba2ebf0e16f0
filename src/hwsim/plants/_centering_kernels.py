"""Compiled core of a ring on a turning table and the tip that pushes it: both directions of the table, in small exact steps.

In the table's frame M u' = F_c + M (w^2 c + 2 w J'u + w' J'c) - (F_k + k_v |u|) u/|u|, with the contact force F_c = k d + b d' of
the closure d that only pushes, along the normal of the rim at the tip. A ring at rest stays until what pulls at it is above
F_s; friction that holds the spin of the ring is not there to hold its place. Fourth order in steps short against the contact's
own oscillation; touch, parting, stop and breakaway are found within a step. Serial; arrays as in the kernels of the slide.
"""

from typing import Any

import numpy as np
from numba import njit

from hwsim.plants import _centering_slide_kernels as slide
from hwsim.plants import _probe_kernels as probe

_OPTIONS: Any = {"cache": True, "nogil": True}

GRAVITY = 9807.0  # mm/s^2
_NEAR = 0.8  # of the breakaway force: from there on a ring at rest is watched closely
_FASTEST = 150.0  # mm/s: no tip comes closer faster
_SPLITS = 60
_STEPS_MAX = 100_000  # in a piece, beyond 20 times those that an uneventful one takes
_CLOSE = 1e-12  # s
_STILL = 1e-6  # mm/s: a ring that is slowed down to this by a damper, for ever, stands
_SPINNING = 1.0  # mm/s: slower, what holds the spin of a ring does not brake it; faster, it all does
_ONWARD = 0.3  # cosine: a ring that slides much aside of its way has stopped in between


@njit(**_OPTIONS)
def contact_force(state, cell, profile, time, x, y, speed_x, speed_y):
    """Force (N) of the tip on the ring, along x and y of the table, its size, and the closure (mm, below 0: a gap)."""
    rate = slide.spindle_rate(state, cell)
    angle, spin = state[slide.ANGLE] + (state[slide.SPEED] + 0.5 * rate * time) * time, state[slide.SPEED] + rate * time
    tip, velocity = slide.tip_at(state, cell, profile, time)
    cosine, sine = np.cos(angle), np.sin(angle)
    along, across = x * cosine + y * sine - tip, y * cosine - x * sine
    distance = np.sqrt(along * along + across * across)
    closure = cell[slide.RADIUS] - distance
    if closure <= 0.0:
        return 0.0, 0.0, 0.0, closure
    normal_x, normal_y = along / distance, across / distance
    # the ring's own speed over ground; the tip goes at -velocity along the line
    ground_x = speed_x * cosine + speed_y * sine + spin * across + velocity
    ground_y = speed_y * cosine - speed_x * sine - spin * (along + tip)
    force = cell[slide.STIFFNESS] * closure - cell[slide.CONTACT_DAMPING] * (normal_x * ground_x + normal_y * ground_y)
    if force <= 0.0:
        return 0.0, 0.0, 0.0, closure
    turned, aside = np.cos(cell[slide.AIM]), np.sin(cell[slide.AIM])
    push_x, push_y = normal_x * turned - normal_y * aside, normal_y * turned + normal_x * aside
    return force * (push_x * cosine - push_y * sine), force * (push_y * cosine + push_x * sine), force, closure


@njit(**_OPTIONS)
def _pull(state, cell, profile, time, x, y, speed_x, speed_y):
    """What pulls at the ring but friction, N, along x and y of the table; and the closure."""
    rate = slide.spindle_rate(state, cell)
    spin, inertia = state[slide.SPEED] + rate * time, cell[slide.INERTIA]
    push_x, push_y, _, closure = contact_force(state, cell, profile, time, x, y, speed_x, speed_y)
    pull_x = push_x + inertia * (spin * spin * x - 2.0 * spin * speed_y - rate * y)
    pull_y = push_y + inertia * (spin * spin * y + 2.0 * spin * speed_x + rate * x)
    return pull_x, pull_y, closure


@njit(**_OPTIONS)
def _held(state, cell):
    """Share of friction that holds the place of the ring, as the rest holds its spin against a changing speed of the table."""
    spin = slide.spindle_rate(state, cell) * cell[slide.RADIUS] * cell[slide.INERTIA]
    return np.sqrt(max(1.0 - (spin / (cell[slide.BREAKAWAY] * cell[slide.FRICTION])) ** 2, 0.0))


@njit(**_OPTIONS)
def _way(state, cell, profile, time):
    """Direction over the table in which the ring slides, or begins to."""
    way_x, way_y = state[slide.SPEED_X], state[slide.SPEED_Y]
    if way_x == 0.0 and way_y == 0.0:
        way_x, way_y, _ = _pull(state, cell, profile, time, state[slide.X], state[slide.Y], 0.0, 0.0)
    length = np.sqrt(way_x * way_x + way_y * way_y)
    return (way_x / length, way_y / length) if length > 0.0 else (1.0, 0.0)


@njit(**_OPTIONS)
def _slope(state, cell, profile, time, way_x, way_y, x, y, speed_x, speed_y):
    """Acceleration over the table, mm/s^2, of a ring that slides; friction goes on as if it did where it has come to a stop."""
    pull_x, pull_y, _ = _pull(state, cell, profile, time, x, y, speed_x, speed_y)
    speed = np.sqrt(speed_x * speed_x + speed_y * speed_y)
    if speed_x * way_x + speed_y * way_y > _ONWARD * speed:
        way_x, way_y = speed_x / speed, speed_y / speed
    held = _held(state, cell)
    held += (1.0 - held) * min(speed / _SPINNING, 1.0)
    friction, viscous = cell[slide.COULOMB] * cell[slide.FRICTION] * held, cell[slide.VISCOUS]
    pull_x -= friction * way_x + viscous * speed_x
    pull_y -= friction * way_y + viscous * speed_y
    return pull_x / cell[slide.INERTIA], pull_y / cell[slide.INERTIA]


@njit(**_OPTIONS)
def _slide_on(state, cell, profile, time, w, z, step):
    """Place and speed of a ring that slides in the direction w, z one step later, to fourth order."""
    x, y, u, v = state[slide.X], state[slide.Y], state[slide.SPEED_X], state[slide.SPEED_Y]
    half = 0.5 * step
    a1, b1 = _slope(state, cell, profile, time, w, z, x, y, u, v)
    u2, v2 = u + half * a1, v + half * b1
    a2, b2 = _slope(state, cell, profile, time + half, w, z, x + half * u, y + half * v, u2, v2)
    u3, v3 = u + half * a2, v + half * b2
    a3, b3 = _slope(state, cell, profile, time + half, w, z, x + half * u2, y + half * v2, u3, v3)
    u4, v4 = u + step * a3, v + step * b3
    a4, b4 = _slope(state, cell, profile, time + step, w, z, x + step * u3, y + step * v3, u4, v4)
    sixth = step / 6.0
    x += sixth * (u + 2.0 * u2 + 2.0 * u3 + u4)
    y += sixth * (v + 2.0 * v2 + 2.0 * v3 + v4)
    return x, y, u + sixth * (a1 + 2.0 * a2 + 2.0 * a3 + a4), v + sixth * (b1 + 2.0 * b2 + 2.0 * b3 + b4)


@njit(**_OPTIONS)
def _when(state, cell, profile, time, x, y, u, v, way_x, way_y):
    """What changes sign at an event of a sliding ring: its speed onward, its closure, and the force where it is closed."""
    _, _, force, closure = contact_force(state, cell, profile, time, x, y, u, v)
    return u * way_x + v * way_y, closure, force


@njit(**_OPTIONS)
def _happens(onward, closure, force, closed, pushed):
    """Whether a stop, a touch, a parting or a renewed push lies behind, given how it was before."""
    return onward <= 0.0 or (closure > 0.0) != closed or (force > 0.0) != pushed


@njit(**_OPTIONS)
def _move(state, cell, profile, time, step):
    """Let a sliding ring go on by at most a step, or to where it stops, touches or parts before; return the time taken."""
    x, y, u, v = state[slide.X], state[slide.Y], state[slide.SPEED_X], state[slide.SPEED_Y]
    w, z = _way(state, cell, profile, time)
    _, closure, force = _when(state, cell, profile, time, x, y, u, v, w, z)
    closed, pushed = closure > 0.0, force > 0.0
    x, y, u, v = _slide_on(state, cell, profile, time, w, z, step)
    onward, closure, force = _when(state, cell, profile, time + step, x, y, u, v, w, z)
    if _happens(onward, closure, force, closed, pushed):
        low, high = 0.0, step
        for _ in range(_SPLITS):
            if high - low < _CLOSE:
                break
            step = 0.5 * (low + high)
            x, y, u, v = _slide_on(state, cell, profile, time, w, z, step)
            onward, closure, force = _when(state, cell, profile, time + step, x, y, u, v, w, z)
            if _happens(onward, closure, force, closed, pushed):
                high = step
            else:
                low = step
        step = high
        x, y, u, v = _slide_on(state, cell, profile, time, w, z, step)
        onward = u * w + v * z
    before, after = state[slide.SPEED_X] ** 2 + state[slide.SPEED_Y] ** 2, u * u + v * v
    state[slide.X], state[slide.Y], state[slide.SPEED_X], state[slide.SPEED_Y] = x, y, u, v
    if onward <= 0.0 or after < min(before, _STILL * _STILL):
        state[slide.SPEED_X], state[slide.SPEED_Y], state[slide.MOVING] = 0.0, 0.0, 0.0
    return step


@njit(**_OPTIONS)
def _at_rest(state, cell, profile, time):
    """Whether a ring at rest stays so, and the closure."""
    pull_x, pull_y, closure = _pull(state, cell, profile, time, state[slide.X], state[slide.Y], 0.0, 0.0)
    most = cell[slide.BREAKAWAY] * cell[slide.FRICTION] * _held(state, cell)
    return pull_x * pull_x + pull_y * pull_y <= most * most, closure


@njit(**_OPTIONS)
def _wait(state, cell, profile, time, step):
    """Let a ring at rest be for at most a step: to where it is touched or set in motion; return the time taken."""
    stays, closure = _at_rest(state, cell, profile, time)
    if not stays:
        state[slide.MOVING] = 1.0
        if contact_force(state, cell, profile, time, state[slide.X], state[slide.Y], 0.0, 0.0)[2] == 0.0:
            state[slide.SLIPPED] = 1.0
        return 0.0
    later, closed = _at_rest(state, cell, profile, time + step)
    if later and not closure < 0.0 < closed:
        return step
    low, high = 0.0, step
    for _ in range(_SPLITS):
        middle = 0.5 * (low + high)
        if high - low < _CLOSE:
            break
        stays, closed = _at_rest(state, cell, profile, time + middle)
        if stays and not closure < 0.0 < closed:
            low = middle
        else:
            high = middle
    return high


@njit(**_OPTIONS)
def _far(state, cell, profile, length):
    """Whether nothing can happen to a ring at rest within a piece: the tip is far, and the table too slow to shake it off."""
    if state[slide.MOVING] != 0.0:
        return False
    x, y = state[slide.X], state[slide.Y]
    spin = max(abs(state[slide.SPEED]), abs(state[slide.SPEED_SET]))
    offset = np.sqrt(x * x + y * y)
    rate = slide.spindle_rate(state, cell)
    pull = cell[slide.INERTIA] * offset * np.sqrt(spin**4 + rate * rate)
    if pull > _NEAR * cell[slide.BREAKAWAY] * cell[slide.FRICTION] * _held(state, cell):
        return False
    closure = contact_force(state, cell, profile, 0.0, x, y, 0.0, 0.0)[3]
    return closure < -(_FASTEST + 2.0 * spin * offset) * length


@njit(**_OPTIONS)
def _feel(state, cell, profile, time):
    """Note the force of the contact, and when one begins."""
    where = state[slide.X], state[slide.Y], state[slide.SPEED_X], state[slide.SPEED_Y]
    _, _, force, closure = contact_force(state, cell, profile, time, *where)
    state[slide.FORCE] = force
    state[slide.PEAK] = max(state[slide.PEAK], force)
    state[slide.PEAK_EVER] = max(state[slide.PEAK_EVER], force)
    if force > 0.0 and state[slide.TOUCHES] == 0.0 and state[slide.SEGMENT] < 0.0:
        state[slide.COLLISIONS] += 1.0
    if closure > 0.0:
        state[slide.TOUCHES] = 1.0
    elif closure < 0.0:
        state[slide.TOUCHES] = 0.0
    return closure > 0.0


@njit(**_OPTIONS)
def _piece(state, cell, profile, length):
    """Let the ring go on through a piece of the slide's motion; return how much of it was used: a first touch loads the slide."""
    if _far(state, cell, profile, length):
        state[slide.FORCE] = 0.0
        return length
    time, steps = 0.0, 0
    touched = _feel(state, cell, profile, 0.0)
    while time < length - _CLOSE:
        if touched and state[slide.SEGMENT] >= 0.0 and state[slide.TOUCHED] == 0.0:
            if time > 0.0:
                return time
            state[slide.TOUCHED] = 1.0
        step = min(cell[slide.STEP], length - time)
        steps += 1
        if steps > _STEPS_MAX + 20.0 * length / cell[slide.STEP]:
            raise RuntimeError("a ring that is pushed starts and stops without end: stiffness, damping and friction fit no step")
        moves = state[slide.MOVING] != 0.0
        time += _move(state, cell, profile, time, step) if moves else _wait(state, cell, profile, time, step)
        touched = _feel(state, cell, profile, time)
    return length


@njit(**_OPTIONS)
def advance(state, cell, profile, until):
    """Let slide, spindle and ring go on until a time, or to the start of the profile that waits; return whether it has come."""
    while state[slide.TIME] < until - _CLOSE:
        length = slide.piece_length(state, cell, profile, until - state[slide.TIME])
        length = _piece(state, cell, profile, length)
        slide.commit(state, cell, profile, length)
        if state[slide.SEGMENT] >= 0.0 and state[slide.GONE] >= profile[int(state[slide.SEGMENT]), 0] - _CLOSE:
            state[slide.SEGMENT] += 1.0
            state[slide.GONE] = 0.0
            if state[slide.SEGMENT] >= profile.shape[0]:
                state[slide.SEGMENT], state[slide.ACCELERATION] = -1.0, 0.0
        if state[slide.ARMED] != 0.0 and slide.time_to(state, cell, state[slide.START]) <= _CLOSE:
            return True
    state[slide.TIME] = until
    return False


@njit(**_OPTIONS)
def settled(state):
    """Whether the ring lies still on the table."""
    return state[slide.MOVING] == 0.0


@njit(**_OPTIONS)
def reading(state, shape, lobes):
    """Where a faultless probe finds the rim on the line now, mm from the axis, and the polar angle on the part."""
    return probe.contact(shape, lobes, state[slide.X], state[slide.Y], state[slide.ANGLE])
