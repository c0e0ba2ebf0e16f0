"""Where the spindle is: what readings cover, what is forgotten on the way, angles that cannot be. Compiled."""

import numpy as np

from centering.circle._estimator import slots as at
from sdpgrind.base.compiled import compiled

TAKEN, REFUSED, COMPLETE, MOVED, SHIFTED = range(5)
"""What became of a reading; or whether it completes the start, or shows that the part has moved: as most of the latest are
refused, or as the latest differ from those before as a whole."""
NOT_FINITE, TOO_FAR, COARSE_STEPS, NOT_POSITIVE = -1, -2, -3, -4
"""Why a reading is not taken at all."""
PIVOT = 1e-13
"""Least diagonal of the triangle; that of a row is 1."""

_TURN = 2.0 * np.pi
_GAP = 4.0  # usual steps from which on a step is a gap,
_SMALL_GAP = np.pi / 36  # if it is more than that, rad
_COARSE = 0.75  # rad: steps of degrees that were taken for rad are coarse and even
_MANY = 12  # of them in a row


@compiled(error_model="numpy")
def _objection(state, angle, reading):
    """Why a reading cannot be taken; 0 if it can."""
    if not (np.isfinite(angle) and np.isfinite(reading)):
        return NOT_FINITE
    if state[at.LIMACON] == 0.0 and reading <= 0.0:
        return NOT_POSITIVE
    if state[at.INDEX] > 0.0:
        step = angle - state[at.LAST_ANGLE]
        if abs(step) > 1.001 * _TURN:
            return TOO_FAR
        if state[at.COARSE] >= _MANY - 1 and _is_coarse(state, step):
            return COARSE_STEPS
    return TAKEN


@compiled(error_model="numpy")
def _is_coarse(state, step):
    """Whether a step is coarse and much like the one before."""
    return abs(step) > _COARSE and abs(step - state[at.LAST_STEP]) < 0.25 * abs(step)


@compiled(error_model="numpy")
def _travel(state, array, angle):
    """Go on to an angle: way travelled, what of the part has been seen, what is forgotten."""
    if state[at.INDEX] > 0.0:
        step = angle - state[at.LAST_ANGLE]
        state[at.COARSE] = state[at.COARSE] + 1.0 if _is_coarse(state, step) else 0.0
        state[at.LAST_STEP] = step
        step = _way_of(state, step)
        _cover(state, step)
        if state[at.LOG_FORGETTING] != 0.0 and step != 0.0:
            _forget(state, array, np.exp(state[at.LOG_FORGETTING] * abs(step)))
    state[at.LAST_ANGLE] = angle


@compiled(error_model="numpy")
def _way_of(state, step):
    """Way of a step: one of more than half a turn goes on in the sense of rotation, whether turns are counted or not."""
    if abs(step) <= 0.5 * _TURN:
        return step
    onward = step * state[at.DIRECTION] >= 0.0
    return step if onward and state[at.DIRECTION] != 0.0 else step - np.copysign(_TURN, step)


@compiled(error_model="numpy")
def _cover(state, step):
    """Widen what has been seen by a step, of a gap by a usual step only."""
    state[at.POSITION] += step
    way = abs(step)
    state[at.TRAVEL] += way
    if state[at.SEEN] == 0.0:
        state[at.LOW] = state[at.HIGH] = state[at.POSITION]
        return
    if way > 0.0:
        state[at.PATH] += way
        state[at.MOVES] += 1.0
        state[at.DIRECTION] = 1.0 if step > 0.0 else -1.0
    wider = max(state[at.POSITION] - state[at.HIGH], state[at.LOW] - state[at.POSITION])
    if wider <= 0.0:
        return
    count = state[at.WIDENINGS]
    if wider > _SMALL_GAP and count > 0.0 and wider * count > _GAP * state[at.COVERED]:
        state[at.COVERED] += state[at.COVERED] / count
    else:
        state[at.COVERED] += wider
    state[at.WIDENINGS] += 1.0
    state[at.LOW], state[at.HIGH] = min(state[at.LOW], state[at.POSITION]), max(state[at.HIGH], state[at.POSITION])


@compiled(error_model="numpy")
def _forget(state, array, weight):
    """Let all readings before count for less."""
    for i in range(at.SUM, at.SUM + at.SUMS):
        state[i] *= weight
    root = np.sqrt(weight)
    for i in range(3):
        for j in range(i, array.shape[1]):
            array[i, j] *= root
        if abs(array[i, i]) < PIVOT:
            array[i, i] = PIVOT
