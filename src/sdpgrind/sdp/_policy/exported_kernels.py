"""Action of a policy at one state, compiled, as exports have it."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.sdp._policy.single_kernels import OUTSIDE
from sdpgrind.sdp._policy.small_kernels import (
    act_small_at,
    act_small_log_at,
    tell_small_at,
    tell_small_log_at,
)


@compiled(error_model="numpy")
def _filled(table, lists, level, stops, code, control, out):
    """Fill `out` by the controls of a code; return the number of the stop, or of the move behind them."""
    for k in range(lists.shape[1]):
        out[k] = np.nan if code < 0 else lists[code, k]
    if code < 0:
        return -1 - code
    if level[code] >= 0:
        out[level[code]] = control
    return stops + int(table.move[code])


@compiled(error_model="numpy")
def action_at(state, table, lists, level, stops, mode, time, x, y, z, out):
    """Fill `out`: the controls. Return the number of the action, stops first; -1: outside.

    `table`: `SmallTable`; `lists[code, control]`: listed values, `level[code]`: number of the continuous
    control, -1: none.
    """
    if not 0.0 <= mode < table.code.shape[1] or mode != np.floor(mode):  # guard of its range
        return -1
    found, code, control = act_small_at(table, int(mode), time, x, y, z)
    if found > OUTSIDE:  # guard
        return -1
    return _filled(table, lists, level, stops, code, control, out)


@compiled(error_model="numpy")
def action_log_at(state, table, lists, level, stops, mode, time, x, y, z, out):
    """`action_at` where axes are logarithmic."""
    if not 0.0 <= mode < table.code.shape[1] or mode != np.floor(mode):  # guard of its range
        return -1
    found, code, control = act_small_log_at(table, int(mode), time, x, y, z)
    if found > OUTSIDE:  # guard
        return -1
    return _filled(table, lists, level, stops, code, control, out)


@compiled(error_model="numpy")
def action_told_at(state, table, told, lists, level, stops, mode, time, x, y, z, out):
    """`action_at`, then what `told` (`ToldTable`) tells, $."""
    status = action_at(state, table, lists, level, stops, mode, time, x, y, z, out)
    if status >= 0:  # guard
        tell_small_at(table, told, int(mode), time, x, y, z, out[lists.shape[1] :])
    return status


@compiled(error_model="numpy")
def action_told_log_at(state, table, told, lists, level, stops, mode, time, x, y, z, out):
    """`action_told_at` where axes are logarithmic."""
    status = action_log_at(state, table, lists, level, stops, mode, time, x, y, z, out)
    if status >= 0:  # guard
        tell_small_log_at(table, told, int(mode), time, x, y, z, out[lists.shape[1] :])
    return status
