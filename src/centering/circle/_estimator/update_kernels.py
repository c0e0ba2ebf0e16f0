"""A reading with all that follows of it: the screening of the first ones, a restart after a move."""

from centering.circle._estimator import slots as at
from centering.circle._estimator.kernels import COMPLETE, MOVED, SHIFTED, TAKEN, _take
from centering.circle._estimator.noise_kernels import _arrays
from centering.circle._estimator.restart_kernels import _restart
from centering.circle._estimator.start_kernels import _end_start
from centering.circle._estimator.validity_kernels import judge
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.compiling.uncounted import uncounted


@compiled(error_model="numpy")
def update_step(state, angle, reading):
    """Take one reading (rad, mm); return its outcome: negative, it is invalid and nothing has changed."""
    state = uncounted(state)
    rows = _arrays(state)
    code = _take(state, rows[:3], rows[15], angle, reading)
    _follow(state, code)
    return code


@compiled(error_model="numpy")
def _follow(state, code):
    """Screen the first readings once there are enough, or restart after a move."""
    if code == COMPLETE:
        _end_start(state)
    elif code >= MOVED:  # by the number of refused readings, or as a whole
        _restart(state, code == SHIFTED)


@compiled(error_model="numpy")
def exported_step(state, angle, reading, out):
    """Take one reading (rad, mm) as `GeometryEstimator` does; return its outcome, or -1: it is invalid.

    `out`: radius and centre (mm), whether they are valid, band (mm), number of restarts.
    """
    code = update_step(state, angle, reading)
    if code < 0:
        return -1
    out[3] = 1.0 if judge(state, 0.0) else 0.0
    out[0], out[1], out[2] = state[at.RADIUS], state[at.FIT_X], state[at.FIT_Y]
    out[4], out[5] = state[at.BAND], state[at.RESTARTS]
    return code


@compiled(error_model="numpy")
def run(state, angle, reading, start, until_valid):
    """Take readings from index `start` until one needs attention or, if asked, makes the estimate valid.

    Returns the index after the last reading, its outcome, and whether the estimate is valid, if asked.
    """
    state = uncounted(state)
    rows = _arrays(state)
    array, row = rows[:3], rows[15]
    for i in range(start, angle.shape[0]):
        code = _take(state, array, row, angle[i], reading[i])
        _follow(state, code)
        valid = until_valid and code >= TAKEN and judge(state, state[at.ARC_MIN])
        if code != TAKEN or valid:
            return i + 1, code, valid
    return angle.shape[0], TAKEN, False
