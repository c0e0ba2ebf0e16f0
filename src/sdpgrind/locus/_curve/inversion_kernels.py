"""Compiled inversion of a response for the hidden state; see `inversion`."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.locus._problem.tape_kernels import run, work_size
from sdpgrind.locus._trace.table_kernels import ABOVE, BELOW, INSIDE, NO_KEY, look_up, look_up_within

CONTROLS, RESPONSE, SLOPE, TAPE, LOW, HIGH, DIRECTION, GUESS, HEAD = range(9)
"""Head of the packed array, before tape and table: number of controls; indices of response and slope in the
output of the tape; size of the tape; range of the state; sign of the slope (1 or -1); initial state."""
INSET = 1e-3  # chosen: share of the range between the first guess and a pole that may lie at its end
STEPS = 200  # chosen: more than bisection takes from a range to rounding
CLOSE, ROUNDING = 1e-10, 1e-14
"""Last Newton step relative to the state (error of second order; chosen), and to the range (rounding)."""


@compiled(error_model="numpy")
def find_state(tape, inputs, places, low, high, direction, measured, work, out):
    """Change one of `inputs` until the response equals the measurement; return the flag.

    `places`: index of the state in `inputs`, of response and slope in `out`. It begins at the state in
    `inputs`, or off an end of the range, where that is nearer.
    """
    inputs[places[0]] = off_ends(inputs[places[0]], low, high)
    return find_state_from(tape, inputs, places, low, high, direction, measured, work, out)


@compiled(error_model="numpy")
def off_ends(state, low, high):
    """Return a first guess of the state (its unit): steps near a pole at an end are too small."""
    inset = INSET * (high - low)
    return min(max(state, low + inset), high - inset)


@compiled(error_model="numpy")
def find_state_from(tape, inputs, places, low, high, direction, measured, work, out):
    """Find the state as `find_state`, from one within the range and off its ends.

    Newton's method within a bracket; a step that leaves it or is not halved goes to an end not yet tried,
    else to the middle. Out of reach: the state is clamped. NO_KEY: measurement or response is NaN.
    """
    state, response, slope = places
    x, a, b = inputs[state], low, high
    tried_low, tried_high = False, False
    before, step, rounding = 4.0 * (high - low), 2.0 * (high - low), ROUNDING * (high - low)
    for _ in range(STEPS):
        inputs[state] = x
        run(tape, inputs, work, out)
        miss = direction * (out[response] - measured)
        if np.isnan(miss):
            break
        wanted = _newton(miss, direction * out[slope])
        if x == low and miss >= 0.0:
            return BELOW if miss > 0.0 and not wanted >= -rounding else INSIDE
        if x == high and miss <= 0.0:
            return ABOVE if miss < 0.0 and not wanted <= rounding else INSIDE
        tried_low, tried_high = tried_low or x == low, tried_high or x == high
        a, b = (a, x) if miss > 0.0 else (x, b)
        if a <= x + wanted <= b and abs(wanted) <= 0.5 * before:
            new = x + wanted
            if abs(wanted) <= CLOSE * abs(x) + rounding:
                inputs[state] = new
                return INSIDE
        elif miss > 0.0 and a == low and not tried_low:
            new = low
        elif miss < 0.0 and b == high and not tried_high:
            new = high
        else:
            new = 0.5 * (a + b)
            if not a < new < b:
                return INSIDE
        before, step, x = step, abs(new - x), new
    inputs[state] = np.nan
    return NO_KEY


@compiled(forceinline=True, error_model="numpy")
def _newton(miss, slope):
    """Return the Newton step; NaN without a positive slope."""
    if miss == 0.0:
        return 0.0
    return -miss / slope if 0.0 < slope < np.inf else np.nan


@compiled(error_model="numpy")
def retrieve(packed, controls, measured, out):
    """Fill `out` with hidden state and table columns for a measurement at `controls`; return the flag."""
    counts = packed.view(np.int64)
    n, end = counts[CONTROLS], HEAD + counts[TAPE]
    tape = packed[HEAD:end]
    n_work = work_size(tape)
    room = np.empty(n + 1 + n_work + tape.view(np.int64)[1])
    inputs, work, found = room[: n + 1], room[n + 1 : n + 1 + n_work], room[n + 1 + n_work :]
    for k in range(n):
        inputs[k] = controls[k]
    inputs[n] = packed[GUESS]
    places = (n, counts[RESPONSE], counts[SLOPE])
    flag = find_state_from(
        tape, inputs, places, packed[LOW], packed[HIGH], packed[DIRECTION], measured, work, found
    )
    out[0] = inputs[n]
    outside = look_up(packed[end:], inputs[n], out[1:])
    return flag if flag != INSIDE else outside


class Search(NamedTuple):
    """What an exported inversion knows, in the user's units."""

    tape: Floats  # controls and state to responses, then their slopes by the state
    table: Floats  # packed: columns by the state
    response: int  # places in the output of the tape
    slope: int
    low: float  # range of the state
    high: float
    direction: float  # sign of the slope
    guess: float
    covered: bool  # whether the table spans the range


@compiled(error_model="numpy")
def _searched(search, room, count, inputs, measured, out):
    """Retrieve for the controls in `inputs`; `room`, `count`: numbers and results of the tape."""
    work, found, n = np.empty(room), np.empty(count), inputs.size - 1
    inputs[n] = search.guess
    places = (n, search.response, search.slope)
    flag = find_state_from(
        search.tape, inputs, places, search.low, search.high, search.direction, measured, work, found
    )
    if flag == NO_KEY:
        return -1
    out[0] = inputs[n]
    if search.covered:
        look_up_within(search.table, inputs[n], out[1:])  # between the ends: so is the bracket of the search
        return flag
    outside = look_up(search.table, inputs[n], out[1:])
    return flag if flag != INSIDE else outside


@compiled(error_model="numpy")
def exported_of_one(state, search, room, count, measured, first, out):
    """Fill `out` with hidden state and table columns, of one control; return inside, below, above; or -1."""
    inputs = np.empty(2)
    inputs[0] = first
    return _searched(search, room, count, inputs, measured, out)


@compiled(error_model="numpy")
def exported_of_two(state, search, room, count, measured, first, second, out):
    """Fill `out` as `exported_of_one`, of two controls."""
    inputs = np.empty(3)
    inputs[0], inputs[1] = first, second
    return _searched(search, room, count, inputs, measured, out)


@compiled(error_model="numpy")
def exported_of_three(state, search, room, count, measured, first, second, third, out):
    """Fill `out` as `exported_of_one`, of three controls."""
    inputs = np.empty(4)
    inputs[0], inputs[1], inputs[2] = first, second, third
    return _searched(search, room, count, inputs, measured, out)
