"""Compiled control law on a locus, shared by `step` and batches."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.locus._trace.table_kernels import look_up

PLACE, LAST, LAST_BUT_ONE, UPDATES, SAMPLES, ACTUAL, WAITED, HELD = range(8)
"""State: coordinate, last two errors, updates since a missing reading, samples since the start, estimated
actual coordinate, samples waited for it, successive saturated readings with negative slack (`step` only)."""
STATES = 8  # derived: numbers of a state


class WalkLaw(NamedTuple):
    """Parameters of the control law; coordinates are in the user's unit."""

    low: float
    high: float
    direction: float  # of falling slack: +1 or -1
    integral: float  # gain; theta of a schedule
    proportional: float
    derivative: float
    scheduled: bool
    decay: float  # of command - actual coordinate, per period
    slopes: Floats  # packed table of the loop slope


@compiled(inline="always")
def _hermite(t, step, first, last, first_slope, last_slope):
    """Return the cubic Hermite interpolant at the share `t` of an interval, and its slope by the share."""
    rise = last - first
    square = 3.0 * rise - step * (2.0 * first_slope + last_slope)
    cube = step * (first_slope + last_slope) - 2.0 * rise
    value = first + t * (step * first_slope + t * (square + t * cube))
    return value, step * first_slope + t * (2.0 * square + 3.0 * t * cube)


@compiled(inline="always")
def _find(value, knots, values, slopes):
    """Return the coordinate at which a monotone column has a value, clamped: safeguarded Newton."""
    rising = values[-1] > values[0]
    low, high = 0, knots.size - 1
    while high - low > 1:  # at most 64
        middle = (low + high) // 2
        if (values[middle] <= value) == rising:
            low = middle
        else:
            high = middle
    step = knots[high] - knots[low]
    ends = 0.0, 1.0
    sign = 1.0 if rising else -1.0
    if sign * (value - values[low]) <= 0.0:
        return knots[low]
    if sign * (value - values[high]) >= 0.0:
        return knots[high]
    a, b = ends
    t = (value - values[low]) / (values[high] - values[low])
    for _ in range(60):
        found, by = _hermite(t, step, values[low], values[high], slopes[low], slopes[high])
        off = found - value
        if sign * off > 0.0:
            b = t
        else:
            a = t
        guess = t - off / by if by != 0.0 else a
        if not a <= guess <= b:
            guess = 0.5 * (a + b)
        if abs(guess - t) <= 1e-16:
            t = guess
            break
        t = guess
    return knots[low] + t * step


@compiled(error_model="numpy")
def find_many(value, knots, values, slopes, out):
    """Fill `out` (N,) with the coordinates of values (N,), see `_find`."""
    for k in range(value.size):
        out[k] = _find(value[k], knots, values, slopes)


@compiled(error_model="numpy")
def begin(state, start, actual):
    """Initialise a state at a coordinate `start`, its actual value `actual`."""
    state[:] = 0.0
    state[PLACE], state[ACTUAL] = start, actual


@compiled(error_model="numpy")
def follow(state, law):
    """Count a sample and advance the estimate of the actual coordinate by one period."""
    if state[SAMPLES] > 0.0:
        state[ACTUAL] = state[PLACE] + law.decay * (state[ACTUAL] - state[PLACE])
    state[SAMPLES] += 1.0


@compiled(error_model="numpy")
def advance(state, law, error, base):
    """Koren (36), Fig. 3: move on from the coordinate `base` by its error, limit - response; NaN: keep it."""
    if np.isnan(error):
        state[UPDATES] = 0.0
        return state[PLACE]
    change = _gain_at(law, base) * error
    if state[UPDATES] >= 1.0:  # the first update has no change of the error
        change += law.proportional * (error - state[LAST])
    if state[UPDATES] >= 2.0:
        change += law.derivative * (error - 2.0 * state[LAST] + state[LAST_BUT_ONE])
    state[LAST_BUT_ONE], state[LAST] = state[LAST], error
    state[UPDATES] += 1.0
    # The clamped coordinate is kept: no wind-up.
    state[PLACE] = min(max(base + law.direction * change, law.low), law.high)
    return state[PLACE]


@compiled(error_model="numpy", inline="always")
def _gain_at(law, place):
    """Return the integral gain at a coordinate."""
    if not law.scheduled:
        return law.integral
    slope = np.zeros(1)  # filled below: compilers that check indices do not see it
    look_up(law.slopes, place, slope)
    return law.integral / abs(slope[0])


@compiled(error_model="numpy")
def advance_many(states, law, errors):
    """Call `follow` and `advance` for every run: states (N, STATES), errors (N,)."""
    for k in range(errors.size):
        follow(states[k], law)
        advance(states[k], law, errors[k], states[k, PLACE])
