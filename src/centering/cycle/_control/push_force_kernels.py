"""Contact forces of a push on a turning table, at the times of samples."""

import numpy as np

from centering.push.turning._plane_kernels import FORCE, _push_on_table
from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def force_sum(parameters, radius, spindle_speed, rows, times, tolerance, most, state):
    """Sum of the contact forces (N) at rising times (s) from the start of the motion `rows` of the tip.

    A sensor shows at most `most` (N).
    """
    total, clock, gone, row, piece = 0.0, 0.0, 0.0, 0, np.empty((1, 3))
    for k in range(times.size):
        while row < rows.shape[0] and clock < times[k]:
            left = rows[row, 0] - gone
            take = min(left, times[k] - clock)
            piece[0, 0], piece[0, 2] = take, rows[row, 2]
            piece[0, 1] = rows[row, 1] + rows[row, 2] * gone
            _push_on_table(parameters, radius, spindle_speed, piece, tolerance, state)
            clock, gone = clock + take, gone + take
            if take == left:
                row, gone = row + 1, 0.0
        total += min(state[FORCE], most)
    return total
