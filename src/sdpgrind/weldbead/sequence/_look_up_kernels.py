"""Next pass of a plan at one state, compiled, as exports have it."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.sdp.kernels import OUTSIDE, act_linear_at, act_small_at, tell_small_at


@compiled(error_model="numpy")
def next_pass_at(
    state, frame, shape, best, entry, control, gap, at, start, lines, durations, feeds, height, time_left, out
):
    """Fill `out`: duration (s), feed (mm/s), force (N), gap ($). Return 1 where grinding stops; -1: outside.

    Constants up to `lines` are those of `act_linear_at`; `durations` (s) and `feeds` (mm/s): of the moves.
    """
    found, move, _, force, gained = act_linear_at(
        frame, shape, best, entry, control, gap, at, start, lines, np.int64(0), time_left, height, 0.0, 0.0
    )
    if found > OUTSIDE:  # guard
        return -1
    out[0], out[1], out[2], out[3] = 0.0, np.nan, np.nan, gained
    if move < 0:
        return 1
    out[0], out[1], out[2] = durations[move], feeds[move], force
    return 0


@compiled(error_model="numpy")
def next_pass_small_at(state, table, durations, feeds, height, time_left, out):
    """`next_pass_at` with small tables, without the gap."""
    found, move, force = act_small_at(table, np.int64(0), time_left, height, 0.0, 0.0)
    if found > OUTSIDE:  # guard
        return -1
    out[0], out[1], out[2] = 0.0, np.nan, np.nan
    if move < 0:
        return 1
    out[0], out[1], out[2] = durations[move], feeds[move], force
    return 0


@compiled(error_model="numpy")
def next_pass_told_at(state, table, told, durations, feeds, height, time_left, out):
    """`next_pass_small_at` with what `told` tells beside the pass: gap, value, $."""
    status = next_pass_small_at(state, table, durations, feeds, height, time_left, out)
    if status >= 0:
        tell_small_at(table, told, np.int64(0), time_left, height, 0.0, 0.0, out[3:])
    return status
