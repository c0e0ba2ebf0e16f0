"""Compiled motion of a ring in the plane, pushed on a turning table.

Lengths mm, times s, forces N. The tip moves on the x axis toward the table's axis; its profile is rows of
duration, initial velocity and acceleration. The table turns at a constant speed w (rad/s, from x to y). The
ring's centre is c, the tip's face at p x^, the normal n = (c - p x^)/|c - p x^|. All positions are in the
frame of the ground. Arrays are changed in place.
"""

from math import atan2, cos, hypot, inf, pi, sin, sqrt, tan

import numpy as np

from centering.push._profile.row_kernels import ROWS, TOTAL, push_rows
from centering.push.turning._rim_kernels import reach
from centering.push.turning._slide_kernels import (
    MOTION,
    STAGES,
    _contact,
    _creep,
    _crest,
    _gain,
    _slope,
    _stride,
    _time_left,
    _tip_after,
    _to_event,
)
from sdpgrind.base.compiling.compiled import compiled

# State of a ring under a tip: centre, its velocity, travel over the table; distance of the tip from the axis,
# 1 where the ring rests on the table; contact force now and at most; time since the start, and of first touch
# (< 0: none yet); travel of the present slide without contact, and of the longest.
X, Y, V_X, V_Y, WAY, TIP, RESTS, FORCE, PEAK_FORCE, CLOCK, TOUCH, FREE, FREE_MAX, STATES = range(14)

_M, _K, _B, _FS, _FK, _KV = range(6)  # of the law

# chosen: usual step control of a method of fifth order
_GROWTH, _SHRINK, _SAFETY, _ORDER = 4.0, 0.2, 0.9, 5.0
_BRAKED = 0.8  # chosen: share of the time to stop in a step; at the stop friction is not smooth
_SHORT = 2e-6  # s, chosen: step that begins or ends a slide, in which a stopping ring moves 3e-9 mm
_PER_SWING = 4.0  # chosen: least steps per swing of the ring on the contact; fewer miss a contact that begins
_EXACT = 1e-11  # s, chosen: accuracy of the time of an event
_SLIVER = 1e-12  # s, chosen: a shorter rest of a segment is rounding
_GOLDEN = (sqrt(5.0) - 1.0) / 2.0  # derived: golden section
# chosen: shares of a rest: where its load is compared; accuracy of the greatest load
_EDGE, _CREST = 0.02, 1e-6
_PARTS = 4  # chosen: a slide after the stroke is followed in this many parts and once as many again
_HELD = 1.0 / 16.0  # chosen: least share of mu_k g beyond the centrifugal force, to bound a slide's time
_MOVED = 0.02  # chosen: share of the offset; a ring that moves less has stuck and shows no direction
_ASTRAY = 0.1  # rad, chosen: a ring that deviates by more is not pushed toward the axis


@compiled(error_model="numpy")
def place(offset, angle, radius, w, state):
    """Put a ring that rests on the table at a polar angle (rad), with the tip at its rim."""
    state[:] = 0.0
    state[X], state[Y] = offset * cos(angle), offset * sin(angle)
    state[V_X], state[V_Y] = -w * state[Y], w * state[X]
    state[TIP], state[RESTS], state[TOUCH] = state[X] + sqrt(radius * radius - state[Y] * state[Y]), 1.0, -1.0


@compiled(error_model="numpy")
def _carry(ring, h, state, out):
    """Centre and velocity of a resting ring after the table has turned for a time h."""
    w = ring[2]
    c, s = cos(w * h), sin(w * h)
    out[X], out[Y], out[WAY] = c * state[X] - s * state[Y], s * state[X] + c * state[Y], state[WAY]
    out[V_X], out[V_Y] = -w * out[Y], w * out[X]


@compiled(error_model="numpy")
def _held(ring, tip, h, state, out):
    """Contact force after a rest of h, load over the friction limit (> 1: slip), whether there is contact."""
    law, _, w = ring
    _carry(ring, h, state, out)
    force, pushes, n_x, n_y = _contact(ring, _tip_after(tip, h), out)
    force = force if pushes > 0.0 else 0.0
    thrown = law[_M] * w * w
    l_x, l_y = thrown * out[X] + force * n_x, thrown * out[Y] + force * n_y
    return force, sqrt(l_x * l_x + l_y * l_y) / law[_FS], pushes > 0.0


@compiled(error_model="numpy")
def _to_crest(ring, tip, h, state, out):
    """Time of the greatest load in a rest where it lies inside; else h."""
    if _held(ring, tip, h - _EDGE * h, state, out)[1] <= _held(ring, tip, h, state, out)[1]:
        return h
    if _held(ring, tip, _EDGE * h, state, out)[1] <= _held(ring, tip, 0.0, state, out)[1]:
        return h
    low, high = 0.0, h
    while high - low > _CREST * h:
        one, other = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        if _held(ring, tip, one, state, out)[1] < _held(ring, tip, other, state, out)[1]:
            low = one
        else:
            high = other
    return high


@compiled(error_model="numpy")
def _to_change(ring, tip, h, pushes, state, out):
    """Time at which a rest ends or the contact begins or ends, at most h; by bisection."""
    _, load, pushed = _held(ring, tip, h, state, out)
    if load <= 1.0 and pushed == pushes:
        return h
    low, high = 0.0, h
    while high - low > _EXACT:
        middle = 0.5 * (low + high)
        _, load, pushed = _held(ring, tip, middle, state, out)
        if load > 1.0 or pushed != pushes:
            high = middle
        else:
            low = middle
    return high


@compiled(error_model="numpy")
def _out_of_reach(ring, tip, left, state):
    """Time in which tip and ring cannot meet, s."""
    gap = sqrt((state[X] - tip[0]) ** 2 + state[Y] ** 2) - ring[1]
    fastest = max(tip[1], tip[1] + tip[2] * left, 0.0) + abs(ring[2]) * sqrt(state[X] ** 2 + state[Y] ** 2)
    return min(gap / fastest, left) if fastest > 0.0 else left


@compiled(error_model="numpy")
def _rest(ring, tip, longest, left, state, out):
    """Let a ring rest until an event, at most `left`; return the duration."""
    _, load, pushes = _held(ring, tip, 0.0, state, out)
    if load > 1.0:
        state[RESTS] = 0.0
        return 0.0
    h = min(longest, left)
    h = _to_crest(ring, tip, h, state, out) if pushes else max(h, _out_of_reach(ring, tip, left, state))
    h = _to_change(ring, tip, h, pushes, state, out)
    force, load, pushes = _held(ring, tip, h, state, out)
    state[RESTS], state[FREE] = 0.0 if load > 1.0 else 1.0, 0.0
    _note(h, force, force, pushes, state, out)
    return h


@compiled(error_model="numpy")
def _note(h, force, most, pushes, state, out):
    """Record the ring's motion, contact force, peak force and first touch."""
    for i in range(MOTION):
        state[i] = out[i]
    state[FORCE], state[PEAK_FORCE] = force, max(state[PEAK_FORCE], most)
    if pushes and state[TOUCH] < 0.0:
        state[TOUCH] = state[CLOCK] + h


@compiled(error_model="numpy")
def _step(ring, tip, touching, h, tolerance, state, k, end):
    """One step of a slide within the tolerance: its length and a bound of the next; 0: use `_creep`."""
    while h > _SHORT:
        error = _stride(ring, tip, touching, h, state, k, end)
        longer = max(_SAFETY * (tolerance / max(error, 1e-300)) ** (1.0 / _ORDER), _SHRINK)
        if error <= tolerance:
            return h, h * min(longer, _GROWTH)
        h *= longer
    return 0.0, 2.0 * _SHORT


@compiled(error_model="numpy")
def _advance(ring, tip, touching, h, left, tolerance, state, k, end):
    """One step of a slide up to an event: length, bound of the next, whether the forces have changed."""
    h = min(h, _BRAKED * _time_left(ring, state, k[0]))
    h, following = _step(ring, tip, touching, h, tolerance, state, k, end)
    if h == 0.0:
        h = min(_SHORT, left)
        state[RESTS] = 1.0 if _creep(ring, tip, h, state, end) else 0.0
        return h, following, True
    changed = (_contact(ring, _tip_after(tip, h), end)[1] > 0.0) != touching
    return _to_event(ring, tip, touching, h, state, k, end) if changed else h, following, changed


@compiled(error_model="numpy")
def _slide(ring, tip, h, longest, left, tolerance, fresh, state, k, end):
    """Let a ring slide for one step: length, bound of the next, whether the forces have changed."""
    touching = _contact(ring, tip, state)[1] > 0.0 if fresh else state[FORCE] > 0.0
    if fresh:
        _slope(ring, tip, touching, state, k[0])
    first, rise = _gain(ring, tip, state, k[0])
    h = min(h, left if touching else min(longest, left))  # a contact that begins is not passed over
    h, following, changed = _advance(ring, tip, touching, h, left, tolerance, state, k, end)
    after = _tip_after(tip, h)
    last, fall = _gain(ring, after, end, k[STAGES - 1])
    pushes = _contact(ring, after, end)[1] > 0.0
    force = last if pushes else 0.0
    state[FREE] = 0.0 if touching else state[FREE] + end[WAY] - state[WAY]
    state[FREE_MAX] = max(state[FREE_MAX], state[FREE])
    _note(h, force, _crest(h, first, rise, last, fall) if touching else force, pushes, state, end)
    for i in range(MOTION):
        k[0, i] = k[STAGES - 1, i]
    return h, following, changed


@compiled(error_model="numpy")
def _push_on_table(parameters, radius, spindle_speed, segments, tolerance, state):
    """Move the tip by a profile, and the ring by contact, friction against the slip, and inertia.

    Events (contact begins or ends, friction yields or stops the ring) separate steps of fifth order with
    errors up to `tolerance` (mm); a resting ring turns exactly. A further call continues from `state`.
    """
    ring = (parameters, radius, spindle_speed)
    end, k = np.empty(MOTION), np.empty((STAGES, MOTION))
    longest = 2.0 * pi * sqrt(parameters[_M] / parameters[_K]) / _PER_SWING
    step = longest
    for row in range(segments.shape[0]):
        left, v, a = segments[row, 0], segments[row, 1], segments[row, 2]
        fresh = left > _SLIVER  # true; the literal True would have `_slide` compiled twice
        while left > _SLIVER:
            tip = (state[TIP], v, a)
            if state[RESTS] > 0.5:
                h, step, fresh = _rest(ring, tip, longest, left, state, end), _SHORT, True
            else:
                h, step, fresh = _slide(ring, tip, step, longest, left, tolerance, fresh, state, k, end)
            state[TIP], v, _ = _tip_after(tip, h)
            state[CLOCK] += h
            left -= h


@compiled(error_model="numpy")
def land(parameters, radius, spindle_speed, segments, tolerance, state):
    """`_push_on_table`, then a tip at rest until the ring rests; RESTS is 0 where the ring goes on sliding.

    A ring that leaves the tip at twice its speed u stops in 2 u/(mu_k g - w^2 r), r at most the offset; a
    pressed one swings first. It gets twice that time: a ring that slides longer leans on the tip while the
    table turns below it, or is thrown off.
    """
    off = parameters[_M] * spindle_speed**2 * sqrt(state[X] ** 2 + state[Y] ** 2) / parameters[_FK]
    _push_on_table(parameters, radius, spindle_speed, segments, tolerance, state)
    wait, swing = np.zeros((1, 3)), 2.0 * pi * sqrt(parameters[_M] / parameters[_K])
    fastest = 0.0
    for row in range(segments.shape[0]):
        fastest = max(fastest, abs(segments[row, 1]))
    slide = 2.0 * (fastest + 1.0) * parameters[_M] / parameters[_FK]
    wait[0, 0] = (slide + swing) / (max(1.0 - off, _HELD) * _PARTS)
    for _ in range(2 * _PARTS):
        if state[RESTS] < 0.5:
            _push_on_table(parameters, radius, spindle_speed, wait, tolerance, state)


@compiled(error_model="numpy")
def missed(parameters, radius, spindle_speed, push, offset, angle, longer, tolerance):
    """Miss of a push (in the form of `push_rows`) that touches the ring `angle` before the push line.

    Deviation (rad), distance left along the way, distance from the axis, and 1 where the ring comes to rest.
    Lengths, `longer` and `tolerance` too, are shares of the offset; infinite where the ring is not pushed
    toward the axis.
    """
    way = reach(angle, offset, radius)
    if not min(way, way + longer * offset, push[TOTAL] - way) > 0.0:
        return inf, inf, inf, 0.0
    rows, state = np.empty((ROWS, 3)), np.empty(STATES)
    count = push_rows(push, way, longer * offset, rows)
    place(offset, -angle, radius, spindle_speed, state)
    land(parameters, radius, spindle_speed, rows[:count], tolerance * offset, state)
    turned = angle - spindle_speed * state[CLOCK]
    c, s = cos(turned), sin(turned)
    x, y = (c * state[X] - s * state[Y]) / offset - 1.0, (s * state[X] + c * state[Y]) / offset
    if x * x + y * y < _MOVED * _MOVED:
        astray, along = 0.0, 1.0 - hypot(x, y)
    else:
        astray, along = atan2(-y, -x), 1.0 + x
    left = hypot(along, (1.0 - along) * tan(astray)) if abs(astray) < _ASTRAY else inf
    return astray, along, left, state[RESTS]
