"""Forecast of the arc still to be turned: adds the information of readings on the fitted circle."""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.kernels import _write_lobes
from centering.circle._estimator.noise_kernels import _arrays, _copy, _freedom_of, _known_quantile, _quantile
from centering.circle._estimator.validity_kernels import (
    _conclude,
    _form_bound,
    _ratio_of,
    _worst,
    may_have_moved,
)
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.identify.kernels import rotate

_STEPS = 90  # chosen: steps of a turn, the resolution of the forecast (4 deg)
_STRIDE = 15  # chosen: steps taken at once before the search refines to 5 and 1
_TURNS = 1e6  # chosen: turns beyond which no arc helps
_TRIES = 12  # chosen: secant steps, at most
_CLOSE = 2e-3  # chosen: relative error of the squared band, 0.1 % of the band
_TURN = 2.0 * np.pi


@compiled(error_model="numpy")
def arc_needed(state):
    """Arc (rad) until a judged estimate is valid, at today's noise and density of readings; inf: never."""
    arc = _forecast(state)
    return max(arc, _rest_of_turn(state)) if may_have_moved(state) else arc


@compiled(error_model="numpy")
def _forecast(state):
    """Arc (rad) as in `arc_needed`, without the doubt about a move."""
    if (
        state[at.MOVES] == 0.0
        or state[at.USED] < 4.0
        or not (state[at.FREEDOM] > 0.0 or state[at.NOISE] > 0.0)
    ):
        return turn_needed(state)
    each = _TURN / _STEPS
    usual = state[at.PATH] / state[at.MOVES]
    count = each / usual * state[at.USED] / state[at.SEEN]
    width = _arrays(state).shape[1]
    ahead, before, row = np.zeros((3, width)), np.zeros((3, width)), np.empty(width)
    forward = state[at.DIRECTION] > 0.0
    back_to_edge = state[at.HIGH] - state[at.POSITION] if forward else state[at.POSITION] - state[at.LOW]
    covered, stride, n = state[at.COVERED] - back_to_edge, _STRIDE, 0
    while n < _STEPS:
        for k in range(n + 1, n + stride + 1):
            _expected_row(state, state[at.LAST_ANGLE] + state[at.DIRECTION] * each * k, row)
            _scale(row, np.sqrt(count))
            rotate(ahead, row)
        enough = covered + each * (n + stride) >= state[at.ARC_MIN]
        if enough and _closeness(state, ahead, 1.0, count * (n + stride)) >= 1.0:
            if stride == 1:
                return min(each * (n + 1), turn_needed(state))
            _copy(before, ahead)
            stride = stride // 3 if stride > 5 else 1
            continue
        n += stride
        _copy(ahead, before)
    return min(_further_turns(state, ahead, count * _STEPS), turn_needed(state))


@compiled(error_model="numpy")
def _scale(row, root):
    """Multiply a row by a factor, in place."""
    for k in range(row.shape[0]):
        row[k] *= root


@compiled(error_model="numpy")
def turn_needed(state):
    """Arc (rad) to the end of the turn where only the separation of form from noise is missing; else inf."""
    unknown = state[at.TURNS] == 0.0 and state[at.INFLATION] > 1.0
    bent = state[at.FREED] != 0.0 and state[at.BAND] - state[at.FORM_BOUND] <= state[at.TOLERANCE]
    if (unknown or bent) and state[at.MOVES] > 0.0:
        return _rest_of_turn(state)
    return np.inf


@compiled(error_model="numpy")
def _rest_of_turn(state):
    """Arc (rad) until the turn is complete, at least one step."""
    return max(_TURN - (state[at.TRAVEL] - state[at.TURN_BEGIN]), state[at.PATH] / state[at.MOVES])


@compiled(error_model="numpy")
def _further_turns(state, turn, count):
    """Arc (rad) beyond a turn, by secants on the inverse square of the band, nearly linear in turns."""
    last, turns = 0.0, 1.0
    before, now = _closeness(state, turn, last, 0.0), _closeness(state, turn, turns, count)
    for _ in range(_TRIES):
        if not now > before:
            return np.inf
        last, turns, before = turns, turns + (1.0 - now) * (turns - last) / (now - before), now
        if turns > _TURNS:
            return np.inf
        now = _closeness(state, turn, turns, count * turns)
        if abs(now - 1.0) < _CLOSE:
            break
    return turns * _TURN


@compiled(error_model="numpy")
def _closeness(state, ahead, turns, count):
    """Squared ratio of tolerance to band after `count` more readings, `turns` times those of `ahead`."""
    width = ahead.shape[1]
    array, room, row = np.empty((3, width)), np.empty((3, width)), np.empty(width)
    _copy(_arrays(state), array)
    for i in range(3):
        for k in range(width):
            row[k] = ahead[i, k] if k >= i else 0.0
        _scale(row, np.sqrt(turns))
        rotate(array, row)
    value, information = np.empty(3), np.empty((3, 3))
    _conclude(state, array, room, value, information)
    inflation, freedom = state[at.INFLATION], state[at.FREEDOM]
    if state[at.FREED] == 0.0:
        freedom = _freedom_of(state[at.WEIGHT] + count, inflation)
    seen = _quantile(state, freedom) * state[at.FIT_NOISE] * inflation if state[at.FREEDOM] > 0.0 else 0.0
    reach = max(seen, _known_quantile(state) * state[at.NOISE] * max(inflation, 1.0))
    band = reach * _worst(information[1, 1], information[1, 2], information[2, 2]) + _form_bound(state, array)
    return (state[at.TOLERANCE] / (band * _ratio_of(state, value))) ** 2


@compiled(error_model="numpy")
def _expected_row(state, angle, row):
    """Write the row of a reading on the fitted curve."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, start = state[at.FIT_X], state[at.FIT_Y], state[at.REFERENCE]
    if state[at.LIMACON] != 0.0:
        row[0], row[1], row[2] = 1.0, c, s
        row[3] = state[at.RADIUS] + state[at.TIP] - start + x * c + y * s
        _write_lobes(state, c, s, 1.0, row)
        return
    radius = state[at.RADIUS] + state[at.TIP]
    across = np.sqrt(max(radius**2 - (x * s - y * c) ** 2, 0.01 * radius**2))
    r, cosine = x * c + y * s + across, across / radius
    row[0], row[1], row[2] = 1.0 / cosine, r * c / (start * cosine), r * s / (start * cosine)
    row[3] = 0.5 * (r - start) * (r + start) / (start * cosine)
    _write_lobes(state, (r * c - x) / radius, (r * s - y) / radius, 1.0 / cosine, row)
