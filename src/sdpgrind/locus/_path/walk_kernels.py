"""One sample of a controller on the locus, compiled: waiting, the law, saturation."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.locus._path.law_kernels import (
    ACTUAL,
    HELD,
    LAST,
    PLACE,
    SAMPLES,
    UPDATES,
    WAITED,
    advance,
    follow,
)
from sdpgrind.locus._problem.tape_kernels import output_size, run, work_size
from sdpgrind.locus._trace.table_kernels import look_up

SETTLED = 0.05  # chosen: relative distance to the command; less would let a slow axis wait for `PATIENCE`
PATIENCE = 20  # chosen: samples; a coordinate that never settles must not stop the control of the response
ALL, NEAR, AFTER = range(3)
"""Readings that are used: all; those with the coordinate near its command; those after a time."""
WAITING, MOVED, EXHAUSTED = range(3)
"""Result of a sample: the reading waits; it was used; and patience with a saturated coordinate ends."""


class Walk(NamedTuple):
    """What a sample needs beside the law, in the user's units."""

    table: Floats  # packed: controls, hidden state, limit, loop slope by the coordinate
    tape: Floats  # cost, responses and limits by controls and hidden state; of size 0: not known
    limit: int  # place of the limit among these
    column: int  # of the coordinate among the controls; -1: the hidden state
    least: float  # ends of the table
    greatest: float
    margin: float
    hold: int  # ALL, NEAR or AFTER
    time: float  # s, of AFTER
    period: float  # s
    lagging: bool  # whether the coordinate lags its command, by a known time constant
    at_command: bool  # whether the limit is that at the command


@compiled(error_model="numpy")
def place_of(state, walk, measured):
    """Return the coordinate at which a reading was taken (its command where nothing else is known).

    `measured` (NaN: not measured) counts for a control only.
    """
    if walk.column >= 0 and not np.isnan(measured):
        return measured
    return state[ACTUAL] if walk.lagging else state[PLACE]


@compiled(error_model="numpy")
def counts(state, walk, actual):
    """Return whether the law uses the reading of this sample; count the samples waited."""
    used = True
    if walk.hold == AFTER:
        used = (state[SAMPLES] - 1.0) * walk.period > walk.time + 1e-9 * walk.period
    elif walk.hold == NEAR:
        near = abs(actual - state[PLACE]) <= SETTLED * abs(state[PLACE])
        used = near or state[WAITED] >= PATIENCE
    state[WAITED] = 0.0 if used else state[WAITED] + 1.0
    return used


@compiled(error_model="numpy")
def row_at(walk, place, row):
    """Fill `row` (n + 3) with the columns of the table at a coordinate, clamped."""
    look_up(walk.table, place, row)
    if walk.column >= 0:
        row[walk.column] = min(max(place, walk.least), walk.greatest)


@compiled(error_model="numpy")
def limit_at(walk, row, base):
    """Return the limit at the controls of a row with the coordinate at `base`."""
    inputs, work, out = (
        np.empty(row.size - 2),
        np.empty(work_size(walk.tape)),
        np.empty(output_size(walk.tape)),
    )
    for k in range(inputs.size):
        inputs[k] = row[k]
    if walk.column >= 0:
        inputs[walk.column] = base
    run(walk.tape, inputs, work, out)
    return out[walk.limit]


@compiled(error_model="numpy")
def saturated(state, law):
    """Whether the last used reading demanded a coordinate beyond the end of the stretch."""
    onward = law.direction * state[LAST] if state[UPDATES] != 0.0 else 0.0
    return (state[PLACE] <= law.low and onward < 0.0) or (state[PLACE] >= law.high and onward > 0.0)


@compiled(error_model="numpy")
def watch(state, law, margin):
    """Count readings beyond the limit at an end of the stretch; return the result of the sample."""
    beyond = state[UPDATES] != 0.0 and state[LAST] + margin < 0.0
    state[HELD] = state[HELD] + 1.0 if beyond and saturated(state, law) else 0.0
    return EXHAUSTED if state[HELD] == PATIENCE else MOVED


@compiled(error_model="numpy")
def move(state, law, walk, reading, base, limit):
    """Use a reading taken at `base`, where the limit is known; return the result of the sample."""
    # fixed gains add up commands, as Koren (36) does
    onward = base if law.scheduled else state[PLACE]
    advance(state, law, limit - walk.margin - reading, onward)
    return watch(state, law, walk.margin)


@compiled(error_model="numpy")
def walk_step(state, law, walk, reading, measured, row):
    """Take a sample; fill `row` with the columns at its coordinate, controls first; return its result."""
    follow(state, law)
    actual, told = place_of(state, walk, measured), WAITING
    if counts(state, walk, actual):
        base = state[PLACE] if walk.at_command else actual
        row_at(walk, state[PLACE], row)
        limit = row[row.size - 2] if base == state[PLACE] else limit_at(walk, row, base)
        told = move(state, law, walk, reading, base, limit)
    row_at(walk, state[PLACE], row)
    return told


@compiled(error_model="numpy")
def exported_step(state, law, walk, reading, measured, out):
    """Take a sample; `out`: controls, coordinate, hidden state, slack of the last reading, saturation."""
    row = np.empty(out.size - 1)  # with the limit and the loop slope
    told = walk_step(state, law, walk, reading, measured, row)
    count = out.size - 4
    for k in range(count):
        out[k] = row[k]
    out[count], out[count + 1] = state[PLACE], row[count]
    out[count + 2] = state[LAST] + walk.margin if state[UPDATES] != 0.0 else np.nan
    out[count + 3] = 1.0 if saturated(state, law) else 0.0
    return told
