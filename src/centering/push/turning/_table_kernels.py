"""Compiled push on a turning table along the contact normal: speed of the tip against the table, loads.

A load adds to the friction that holds the part (before breakaway) or slows it (while it slides): centrifugal
force along the normal, and friction lost and Coriolis force gained by sideways slip. Lengths mm, times s,
forces N.
"""

from math import ceil, hypot, sqrt

import numpy as np

from centering.push._contact.reaction_kernels import (
    DONE,
    FORCE,
    _blank,
    _end_speed,
    _finish,
    _segment,
)
from centering.push._contact.sample_kernels import _write_state
from centering.push.turning._plane_kernels import RESTS, TIP, V_X, V_Y, X, Y, _push_on_table
from sdpgrind.base.compiling.compiled import compiled

DURATION, VELOCITY, ACCELERATION, HELD, SLID, PIECE_COLUMNS = range(6)
"""Columns of a piece: s, mm/s, mm/s^2 of the tip on the normal; loads on friction at rest, in motion, N."""

_LEAST = 0.05  # chosen: share of the friction in motion that loads leave at least
_SHORTEST = 1e-9  # s, chosen: allowance for rounding in the ends of pieces


@compiled
def _seen(parameters, w, v, state):
    """Speed of the tip along the normal (mm/s), loads on friction at rest and in motion (N)."""
    m, f_s, f_k = parameters[0], parameters[3], parameters[4]
    x, y = state[X] - state[TIP], state[Y]
    away = hypot(x, y)
    n_x, n_y = x / away, y / away
    closing = -w * (n_y * state[X] - n_x * state[Y]) - v * n_x
    outward = m * w * w * (state[X] * n_x + state[Y] * n_y)
    across = m * w * w * (state[Y] * n_x - state[X] * n_y)
    held = sqrt(max(f_s * f_s - across * across, 0.0)) - outward - f_s
    u_x, u_y = state[V_X] + w * state[Y], state[V_Y] - w * state[X]
    along, side, slip = u_x * n_x + u_y * n_y, u_y * n_x - u_x * n_y, hypot(u_x, u_y)
    if state[RESTS] > 0.5 or slip < 1e-9:
        return closing, held, -outward
    turn = ((state[V_Y]) * n_x - (state[V_X] + v) * n_y) / away
    share = max(along, 0.0) / slip
    return closing, held, -f_k * (1.0 - share) - outward - m * (w + turn) * side


@compiled
def follow(parameters, radius, w, segments, tolerance, longest, state, out):
    """Push the ring of `state` by `segments`, in pieces of at most `longest` (s); return their number.

    Each piece goes into a row of `out`, as far as there are rows: motion of the tip along the normal, mean
    loads.
    """
    row, count = np.empty((1, 3)), 0
    for k in range(segments.shape[0]):
        pieces = max(ceil(segments[k, 0] / longest - 1e-9), 1)
        length = segments[k, 0] / pieces
        for j in range(pieces):
            v = segments[k, 1] + segments[k, 2] * length * j
            first, held, slid = _seen(parameters, w, v, state)
            row[0, 0], row[0, 1], row[0, 2] = length, v, segments[k, 2]
            _push_on_table(parameters, radius, w, row, tolerance, state)
            last, held_after, slid_after = _seen(parameters, w, v + segments[k, 2] * length, state)
            if count < out.shape[0]:
                out[count, 0], out[count, 1], out[count, 2] = length, first, (last - first) / length
                out[count, 3], out[count, 4] = 0.5 * (held + held_after), 0.5 * (slid + slid_after)
            count += 1
    return count


@compiled
def _law(parameters, held, slid):
    """Parameters of the reaction model under loads."""
    slows = max(parameters[4] + slid, _LEAST * parameters[4])
    return parameters[0], parameters[1], parameters[2], max(parameters[3] + held, slows), slows, parameters[5]


@compiled
def loaded_push(parameters, pieces, start, out, log, asked):
    """Simulate a push as `reaction_kernels.push`, with loads on the friction of each piece."""
    sums = _blank(out, asked)
    law = _law(parameters, 0.0, 0.0)
    tip, gap, speed, tip_speed, status = start, start, 0.0, 0.0, DONE
    for k in range(pieces.shape[0]):
        law = _law(parameters, pieces[k, HELD], pieces[k, SLID])
        tip_speed = pieces[k, VELOCITY]
        tip, gap, speed, status = _segment(
            law,
            pieces[k, DURATION],
            tip,
            tip_speed,
            pieces[k, ACCELERATION],
            gap,
            speed,
            out,
            log,
            sums,
            asked,
        )
        tip_speed += pieces[k, ACCELERATION] * pieces[k, DURATION]
        if status != DONE:
            return status
    tip_speed = _end_speed(pieces, tip_speed)
    if tip_speed <= 0.0:
        tip, gap, speed, status = _segment(
            law, np.inf, tip, tip_speed, 0.0, gap, speed, out, log, sums, asked
        )
        speed = 0.0 if status == DONE else speed
    _finish(law, tip, tip_speed, gap, speed, out, log, sums, asked)
    return status


@compiled
def loaded_pushes(parameters, pieces, start, out, status):
    """Simulate the same push with each row of parameters, without its energy balance."""
    nothing = np.empty((0, 7))
    for i in range(parameters.shape[0]):
        status[i] = loaded_push(parameters[i], pieces, start, out[i], nothing, FORCE)


@compiled
def loaded_sample(parameters, pieces, log, times, out):
    """Write tip and part position (mm), part speed (mm/s), contact force (N) at rising times (s), (n, 4)."""
    row, last, piece, until = 0, log.shape[0] - 1, 0, pieces[0, DURATION]
    for i in range(times.size):
        while row < last and log[row + 1, 0] <= times[i]:
            row += 1
            while piece < pieces.shape[0] - 1 and until <= log[row, 0] + _SHORTEST:
                piece += 1
                until += pieces[piece, DURATION]
        law = _law(parameters, pieces[piece, HELD], pieces[piece, SLID])
        _write_state(law, log[row], times[i] - log[row, 0], out[i])
