"""Restart after a move of the part, with the known radius and the readings since the move."""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.kernels import _cover, _remember, _signed_step, _write_row
from centering.circle._estimator.move_kernels import _move_by
from centering.circle._estimator.noise_kernels import _arrays, _copy, _known_quantile
from centering.circle._estimator.start_kernels import _end_start, _replay, _ring, clear
from centering.circle._estimator.validity_kernels import holds_axis, judge
from sdpgrind.base.compiling.compiled import compiled

_OWN_NOISE = 0.1  # chosen: largest root share of noise in the information on the radius


@compiled(error_model="numpy")
def _restart(state, shifted):
    """Restart from the readings since the move, with the known radius.

    The move is the reading from which most are refused or, with `shifted`, from which a move explains them
    better.
    """
    evidence = np.empty(at.RING)
    _write_evidence(state, shifted, evidence)
    if state[at.SEEN] > 2.0 * at.RING:
        _go_back(state)
        _carry_radius(state)
    latest = np.empty((at.RING, at.CELL))
    length = _since_moved(state, evidence, latest)
    way = state[at.TRAVEL]
    clear(state)
    state[at.TRAVEL] = way
    state[at.RESTARTS] += 1.0
    number = state[at.INDEX]
    for i in range(length):
        state[at.INDEX] = latest[i, 4]
        _again(state, latest[i], latest[max(i - 1, 0)])
    state[at.INDEX] = number
    if state[at.SEEN] == at.RING:
        _end_start(state)
    else:
        for i in range(at.RING):
            evidence[i] = 1.0  # all readings are taken alike
        _replay(state, evidence)


@compiled(error_model="numpy")
def _again(state, cell, before):
    """Replay a reading of the ring buffer: arc covered and place in the buffer."""
    _cover(state, _signed_step(state, cell[0] - before[0]))
    state[at.TRAVEL] = cell[3]
    _remember(state, cell[0], cell[1])
    state[at.SEEN] += 1.0


@compiled(error_model="numpy")
def _write_evidence(state, shifted, evidence):
    """Write the evidence of each reading of the ring buffer, newest first, that it follows the move."""
    cells, newest = _ring(state), int(state[at.SEEN]) - 1
    if not shifted:
        for k in range(at.RING):
            evidence[k] = 1.0 if cells[(newest - k) % at.RING, 2] != 0.0 else -1.0
        return
    value, row = np.empty(3), _arrays(state)[15]
    x, y = _move_by(state, value)
    first = -(value[1] * x + value[2] * y) * state[at.PER_REFERENCE]
    for k in range(at.RING):
        cell = cells[(newest - k) % at.RING]
        _write_row(state, cell[0], cell[1], row)
        error = row[3] - row[0] * value[0] - row[1] * value[1] - row[2] * value[2]
        step = row[0] * first + row[1] * x + row[2] * y
        evidence[k] = step * (2.0 * error - step) if cell[2] == 0.0 else 0.0


@compiled(error_model="numpy")
def _since_moved(state, evidence, out):
    """Write the latest readings whose summed evidence is largest, oldest first; return their number."""
    cells, newest = _ring(state), int(state[at.SEEN]) - 1
    best, total, length = -np.inf, 0.0, 1
    for k in range(at.RING):
        total += evidence[k]
        if total >= best:
            best, length = total, k + 1
    for k in range(length):
        for j in range(at.CELL):
            out[k, j] = cells[(newest - length + 1 + k) % at.RING, j]
    return length


@compiled(error_model="numpy")
def _go_back(state):
    """Restore the older of the two stored triangles and its sums."""
    rows = _arrays(state)
    _copy(rows[6:9], rows)
    kept = at.KEPT + at.KEPT_SIZE
    for k in range(at.SUMS):
        state[at.SUM + k] = state[kept + k]
    state[at.COVERED] = state[kept + at.KEPT_COVERED]


@compiled(error_model="numpy")
def carry_radius(state):
    """`_carry_radius`, open to Python."""
    _carry_radius(state)


@compiled(error_model="numpy")
def _carry_radius(state):
    """Keep radius and noise as prior knowledge."""
    judge(state, 0.0)
    # with the quantile: a radius from few readings is less certain than one from known noise
    reach = state[at.REACH] / _known_quantile(state)
    sd = reach * np.sqrt(state[at.SHAPE]) * state[at.INFLATION] + state[at.FORM_BOUND]
    if state[at.FREEDOM] < 1.0 or not sd > 0.0 or not _tells_radius(state):
        return
    state[at.PRIOR_RADIUS], state[at.PRIOR_SD] = state[at.RADIUS] + state[at.TIP], sd
    state[at.PRIOR_NOISE], state[at.PRIOR_FREEDOM] = state[at.FIT_NOISE], min(state[at.FREEDOM], 10.0)


@compiled(error_model="numpy")
def _tells_radius(state):
    """Whether the turning determines the radius, not only noise in the rows of a spindle at rest.

    Noise s in m rows adds m (s/R)^2 to the information 1/shape of the radius. Differences of readings bound s
    from above.
    """
    if not holds_axis(state):
        return False
    radius = state[at.RADIUS] + state[at.TIP]
    noise = np.sqrt(0.5 * state[at.LAG + 9] * state[at.SHAPE]) * state[at.REFERENCE] / radius
    return state[at.LIMACON] != 0.0 or state[at.COVERED] >= np.pi or noise <= _OWN_NOISE * radius
