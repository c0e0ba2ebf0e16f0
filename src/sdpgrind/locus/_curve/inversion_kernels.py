"""The hidden state that a measurement tells of, and the best point for it, in one compiled call; see `inversion`."""

import numpy as np

from sdpgrind.base.compiled import compiled
from sdpgrind.locus._problem.tape_kernels import run, work_size
from sdpgrind.locus._trace.table_kernels import ABOVE, BELOW, INSIDE, NO_KEY, look_up

CONTROLS, RESPONSE, SLOPE, TAPE, LOW, HIGH, DIRECTION, GUESS, HEAD = range(9)
"""Head of what is packed: how many controls, places of the response and of its slope in what the tape gives, numbers of the
tape; range of the state, whether the response rises (1) or falls (-1) with it, where to begin. Then the tape, then the table."""
INSET = 1e-3
"""Share of the range by which a first guess stays off its ends."""
STEPS = 200
"""More than halving takes from one end of a range to what numbers can tell apart."""
CLOSE, ROUNDING = 1e-10, 1e-14
"""Last step of Newton's method over the state (what is left is of the order of its square), and over the range: no distance."""


@compiled(error_model="numpy")
def find_state(tape, inputs, places, low, high, direction, measured, work, out):
    """Change one of `inputs` until the response is what was measured, and say where that is.

    `places`: of the state in `inputs`, of the response and its slope in `out`. Newton's method from the state given, within a
    bracket: where a step leaves it or does not halve, next is its end, if nothing is known there, or else its middle. Out of
    reach: the end, and a flag. Without a number measured, or where the response has none: NaN.
    """
    state, response, slope = places
    inset = INSET * (high - low)  # a pole may stand at an end: steps beside it are small, and tell nothing
    x, a, b, tried_low, tried_high = (
        min(max(inputs[state], low + inset), high - inset),
        low,
        high,
        False,
        False,
    )
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
    """The step to the root of the tangent; NaN where the slope tells nothing."""
    if miss == 0.0:
        return 0.0
    return -miss / slope if 0.0 < slope < np.inf else np.nan


@compiled(error_model="numpy")
def retrieve(packed, controls, measured, out):
    """Put the hidden state that a measurement at `controls` (array, or tuple of floats) tells of, and the columns of the table
    for it, into `out`; say whether they are inside.
    """
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
    flag = find_state(
        tape, inputs, places, packed[LOW], packed[HIGH], packed[DIRECTION], measured, work, found
    )
    out[0] = inputs[n]
    outside = look_up(packed[end:], inputs[n], out[1:])
    return flag if flag != INSIDE else outside
