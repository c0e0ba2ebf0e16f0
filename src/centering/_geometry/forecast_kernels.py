"""The arc still to be turned: what further readings of the fitted circle would tell, added to what is known. Compiled."""

import numpy as np
from numba import njit

from centering._geometry import estimator_slots as at
from centering._geometry.estimator_row_kernels import write_lobes
from centering._geometry.validity_kernels import block, conclude, form_bound, judge, known_quantile, quantile, ratio_of, worst
from sdpgrind.identify.kernels import rotate

_STEPS = 180  # of a turn
_TURNS = 1e6  # as many as are looked ahead
_TURN = 2.0 * np.pi


@njit(cache=True, nogil=True, error_model="numpy")
def arc_needed(state):
    """Arc (rad) until the estimate is sure enough, at the noise and density of readings so far; inf when none will do."""
    if judge(state):
        return 0.0
    if state[at.MOVES] == 0.0 or state[at.USED] < 4.0 or not (state[at.FREEDOM] > 0.0 or state[at.NOISE] > 0.0):
        return np.inf
    each = _TURN / _STEPS
    usual = state[at.PATH] / state[at.MOVES]
    count = each / usual * state[at.USED] / state[at.SEEN]
    array, turn, row = block(state, 0, 3).copy(), np.zeros_like(block(state, 0, 3)), np.empty(block(state, 0, 3).shape[1])
    back_to_edge = state[at.HIGH] - state[at.POSITION] if state[at.DIRECTION] > 0.0 else state[at.POSITION] - state[at.LOW]
    covered = state[at.COVERED] - back_to_edge
    for n in range(1, _STEPS + 1):
        _expected_row(state, state[at.LAST_ANGLE] + state[at.DIRECTION] * each * n, row)
        row *= np.sqrt(count)
        rotate(turn, row.copy())
        rotate(array, row)
        if _will_do(state, array, state[at.WEIGHT] + count * n, covered + each * n):
            return each * n
    return _further_turns(state, turn, count * _STEPS)


@njit(cache=True, nogil=True, error_model="numpy")
def _further_turns(state, turn, count):
    """The same for more than a turn: the number of turns by halving."""
    few, many = 1.0, 2.0
    while not _after_turns(state, turn, count, many):
        few, many = many, 2.0 * many
        if many > _TURNS:
            return np.inf
    while many - few > 1e-3 * many:
        middle = 0.5 * (few + many)
        if _after_turns(state, turn, count, middle):
            many = middle
        else:
            few = middle
    return many * _TURN


@njit(cache=True, nogil=True, error_model="numpy")
def _after_turns(state, turn, count, turns):
    """Whether the estimate is sure enough after some turns more."""
    array, row = block(state, 0, 3).copy(), np.empty(turn.shape[1])
    for i in range(3):
        row[:] = turn[i]
        row[:i] = 0.0
        row *= np.sqrt(turns)
        rotate(array, row)
    return _will_do(state, array, state[at.WEIGHT] + count * turns, state[at.COVERED] + turns * _TURN)


@njit(cache=True, nogil=True, error_model="numpy")
def _will_do(state, array, weight, covered):
    """Whether a triangle of readings, which stays, is sure enough at the noise and correlation of now."""
    if covered < state[at.ARC_MIN]:
        return False
    value, information = np.empty(3), np.empty((3, 3))
    room = array.copy()
    conclude(state, room, array.copy(), value, information)
    inflation = state[at.INFLATION]
    seen = quantile(state, weight / inflation**2 - 3.0) * state[at.FIT_NOISE] if state[at.FREEDOM] > 0.0 else 0.0
    reach = max(seen, known_quantile(state) * state[at.NOISE])
    band = reach * worst(information[1, 1], information[1, 2], information[2, 2]) * inflation + form_bound(state, room)
    return band * ratio_of(state, value) <= state[at.TOLERANCE]


@njit(cache=True, nogil=True, error_model="numpy")
def _expected_row(state, angle, row):
    """The row of a reading that lies on the fitted curve."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, start = state[at.FIT_X], state[at.FIT_Y], state[at.REFERENCE]
    if state[at.LIMACON] != 0.0:
        row[0], row[1], row[2] = 1.0, c, s
        row[3] = state[at.RADIUS] + state[at.TIP] - start + x * c + y * s
        write_lobes(state, c, s, 1.0, row)
        return
    radius = state[at.RADIUS] + state[at.TIP]
    across = np.sqrt(max(radius**2 - (x * s - y * c) ** 2, 0.01 * radius**2))
    r, cosine = x * c + y * s + across, across / radius
    row[0], row[1], row[2] = 1.0 / cosine, r * c / (start * cosine), r * s / (start * cosine)
    row[3] = 0.5 * (r - start) * (r + start) / (start * cosine)
    write_lobes(state, (r * c - x) / radius, (r * s - y) / radius, 1.0 / cosine, row)
