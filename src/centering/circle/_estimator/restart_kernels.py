"""A part that has moved: what is kept of the radius, and of the latest readings those since the move. Compiled."""

import numpy as np

from centering.circle._estimator import slots as at
from centering.circle._estimator.kernels import _cover, _remember, _way_of, _write_row
from centering.circle._estimator.look_kernels import _move_by
from centering.circle._estimator.noise_kernels import _arrays, _copy, _known_quantile
from centering.circle._estimator.start_kernels import _replay, _ring, clear, end_start
from centering.circle._estimator.validity_kernels import holds_axis, judge
from sdpgrind.base.compiled import compiled

_OWN_NOISE = 0.1  # largest root of what noise in the rows may add to the information of the radius, in that information


@compiled(error_model="numpy")
def restart(state, shifted):
    """Begin anew with the latest readings, from the move on; what is known of R stays.

    The move is where most readings are refused from or, `shifted`, where they are better explained by a move from.
    """
    evidence = np.empty(at.RING)
    _write_evidence(state, shifted, evidence)
    if state[at.SEEN] > 2.0 * at.RING:
        _go_back(state)
        carry_radius(state)
    latest = _since_moved(state, evidence)
    way = state[at.TRAVEL]
    clear(state)
    state[at.TRAVEL] = way
    state[at.RESTARTS] += 1.0
    number = state[at.INDEX]
    for i in range(latest.shape[0]):
        state[at.INDEX] = latest[i, 4]
        _again(state, latest[i], latest[i - 1] if i > 0 else latest[i])
    state[at.INDEX] = number
    if state[at.SEEN] == at.RING:
        end_start(state)
    else:
        _replay(state, np.ones(at.RING))


@compiled(error_model="numpy")
def _again(state, cell, before):
    """Go over a reading of the ring once more: what it covers and where it stands in the ring."""
    _cover(state, _way_of(state, cell[0] - before[0]))
    state[at.TRAVEL] = cell[3]
    _remember(state, cell[0], cell[1])
    state[at.SEEN] += 1.0


@compiled(error_model="numpy")
def _write_evidence(state, shifted, evidence):
    """Write how much each reading of the ring, from the newest on, speaks for that it was read after the move."""
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
def _since_moved(state, evidence):
    """The latest readings from that one on since which the evidence is most; oldest first."""
    cells, newest = _ring(state), int(state[at.SEEN]) - 1
    best, total, length = -np.inf, 0.0, 1
    for k in range(at.RING):
        total += evidence[k]
        if total >= best:
            best, length = total, k + 1
    out = np.empty((length, at.CELL))
    for k in range(length):
        for j in range(at.CELL):
            out[k, j] = cells[(newest - length + 1 + k) % at.RING, j]
    return out


@compiled(error_model="numpy")
def _go_back(state):
    """Be as it was some readings before: the older of the two triangles that are kept, and its sums."""
    rows = _arrays(state)
    _copy(rows[6:9], rows)
    kept = at.KEPT + at.KEPT_SIZE
    for k in range(at.SUMS):
        state[at.SUM + k] = state[kept + k]
    state[at.COVERED] = state[kept + at.KEPT_COVERED]


@compiled(error_model="numpy")
def carry_radius(state):
    """Keep the radius and the noise as known beforehand."""
    judge(state, 0.0)
    # the quantile is in it: what is told by few readings would else be used as if the noise were known
    reach = state[at.REACH] / _known_quantile(state)
    sd = reach * np.sqrt(state[at.SHAPE]) * state[at.INFLATION] + state[at.FORM_BOUND]
    if state[at.FREEDOM] < 1.0 or not sd > 0.0 or not _tells_radius(state):
        return
    state[at.PRIOR_RADIUS], state[at.PRIOR_SD] = state[at.RADIUS] + state[at.TIP], sd
    state[at.PRIOR_NOISE], state[at.PRIOR_FREEDOM] = state[at.FIT_NOISE], min(state[at.FREEDOM], 10.0)


@compiled(error_model="numpy")
def _tells_radius(state):
    """Whether a judged radius comes of the way turned: rows hold the readings, and those of a spindle that stands differ too.

    Noise s in m rows adds m (s/R)^2 to the information 1/shape of the radius. Differences of readings bound s from above.
    """
    if not holds_axis(state):
        return False
    radius = state[at.RADIUS] + state[at.TIP]
    noise = np.sqrt(0.5 * state[at.LAG + 9] * state[at.SHAPE]) * state[at.REFERENCE] / radius
    return state[at.LIMACON] != 0.0 or state[at.COVERED] >= np.pi or noise <= _OWN_NOISE * radius
