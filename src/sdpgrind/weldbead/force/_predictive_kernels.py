"""A sample of the predictive controller: the quadratic program of its limits, the command of its first move.

Room of a program for n moves and a slack: linear term (n + 1), lower and upper bounds (3 n + 1 each), moves
of the law and slack (n + 1), of which the first is replaced by that of the solution; planned force (N) and
position (mm).
"""

from math import inf
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.states import record, width
from sdpgrind.weldbead.force._pass_kernels import PASS, SETTINGS, _ahead, _now, _settle

BIG = 1e20  # chosen: stands for no limit; OSQP takes 1e30 and more for infinite
_WITHIN = 1e-9  # chosen: N, by which the law without limits may miss them
BEHIND = record("demand N, position mm")
"""Behind a program in its room."""
_BEHIND = width(BEHIND)  # derived: entries at the end of a room
_PASS = width(PASS)  # derived: entries between the state of the loop and the estimate


class PredictiveCore(NamedTuple):
    """Models, prediction, limits: `Predictive`, whose offset (N) is the last of the `drift` state; mm, N."""

    model_a: Floats
    model_b: Floats
    model_c: Floats
    drift_a: Floats
    drift_b: Floats
    drift_c: Floats
    corrects: Floats
    free: Floats
    held: Floats
    moves: Floats
    gain: Floats
    stiffness: float
    low: float
    high: float
    rate: float
    contact: float
    patience: float
    approach: float


@compiled(error_model="numpy")
def _dot(row, state):
    total = 0.0
    for k in range(row.size):
        total += row[k] * state[k]
    return total


@compiled(error_model="numpy")
def _advance(A, B, state, value):
    """Advance the state of a model in place."""
    after = np.empty(state.size)
    for i in range(state.size):
        after[i] = B[i] * value + _dot(A[i], state)
    for i in range(state.size):
        state[i] = after[i]


@compiled(error_model="numpy")
def _bounds(core, foreseen, rest, base, demands, positions, low, high):
    """Fill the limits of command, rate, contact and slack over the horizon, N of the correction."""
    n, first = demands.size, np.isnan(rest[1])
    held, room = core.stiffness * rest[0], inf if first else core.stiffness * core.rate
    before = positions[0] if first else rest[1] - rest[0]
    state = np.empty(foreseen.size)
    for i in range(foreseen.size):
        state[i] = foreseen[i]
    for k in range(n):
        low[k] = core.stiffness * (core.low - positions[k]) - held
        high[k] = core.stiffness * (core.high - positions[k]) - held
        shift = core.stiffness * (positions[k] - before)
        low[n + k], high[n + k], before = -room - shift, room - shift, positions[k]
        _advance(core.model_a, core.model_b, state, demands[k])
        free = _dot(core.model_c, state)
        low[2 * n + k] = core.contact - free - base[k] if free > core.contact else -inf
        high[2 * n + k] = inf
    low[3 * n], high[3 * n] = 0.0, inf


@compiled(error_model="numpy")
def _kept(effects, moves, low, high):
    """Whether moves keep all limits; cut these to what OSQP takes.

    Rows of the program: sums of the moves, each move, readings by their `effects` with the slack, the slack.
    """
    n, total, kept = effects.shape[0], 0.0, True
    reached = np.empty(low.size)
    for k in range(n):
        total += moves[k]
        reached[k], reached[n + k] = total, moves[k]
        reached[2 * n + k] = _dot(effects[k], moves) + moves[n]
    reached[3 * n] = moves[n]
    for i in range(low.size):
        kept = kept and low[i] - _WITHIN <= reached[i] <= high[i] + _WITHIN
        low[i], high[i] = max(low[i], -BIG), min(high[i], BIG)
    return kept


@compiled(error_model="numpy")
def ask(core, state, estimate, room, force, demands, positions):
    """Take a reading (N, NaN: none) and fill the room; return 1 where the program is to be solved, else 0.

    `state`: as in `control_step`; `estimate`: state of the model with its offset; `demands` (N) and
    `positions` (mm) of the horizon.
    """
    n, m = demands.size, core.model_b.size
    rest, foreseen = state[state.size - 4 :], state[state.size - 4 - m : state.size - 4]
    wanted = _dot(core.model_c, foreseen)
    rest[2] = rest[2] + 1.0 if force < core.contact < wanted else 0.0
    if not (rest[2] >= core.patience or np.isnan(force)):
        innovation = force - wanted - _dot(core.drift_c, estimate)
        for i in range(estimate.size):
            estimate[i] += core.corrects[i] * innovation
    bounds, unknowns = 3 * n + 1, n + 1
    linear, low = room[:unknowns], room[unknowns : unknowns + bounds]
    high = room[unknowns + bounds : unknowns + 2 * bounds]
    moves, base = room[unknowns + 2 * bounds : 2 * (unknowns + bounds)], np.empty(n)
    for i in range(n):
        base[i] = _dot(core.free[i], estimate) + core.held[i] * (core.stiffness * rest[0])
    for i in range(n):
        moves[i], linear[i] = -_dot(core.gain[i], base), _dot(core.moves[:, i], base)
    moves[n], linear[n] = 0.0, 0.0
    _bounds(core, foreseen, rest, base, demands, positions, low, high)
    behind = room[room.size - _BEHIND :].view(BEHIND)[0]
    behind.demand, behind.position = demands[0], positions[0]
    if _kept(core.moves, moves, low, high):
        return 0
    return 1


@compiled(error_model="numpy")
def answer(core, state, estimate, room):
    """Return the platform command, mm, of the first move in the room, and go on to the next sample."""
    n, m = core.held.size, core.model_b.size
    rest, foreseen = state[state.size - 4 :], state[state.size - 4 - m : state.size - 4]
    first = room[room.size - _BEHIND - n - 1]  # of n moves and a slack
    behind = room[room.size - _BEHIND :].view(BEHIND)[0]
    if rest[2] >= core.patience:
        command = rest[1] + min(core.approach, core.rate)
    else:
        command = behind.position + (core.stiffness * rest[0] + first) / core.stiffness
    if not np.isnan(rest[1]):
        command = min(max(command, rest[1] - core.rate), rest[1] + core.rate)
    command = min(max(command, core.low), core.high)
    _advance(core.model_a, core.model_b, foreseen, behind.demand)
    _advance(core.drift_a, core.drift_b, estimate, core.stiffness * (command - behind.position))
    rest[0], rest[1] = command - behind.position, command
    return command


@compiled(error_model="numpy")
def exported_ask(state, core, plan, settings, settled, force, pass_time, center_x, room):
    """Take one sample as `exported_pass` does, up to its program: see `ask`.

    State: as there, then the estimate.
    """
    n, horizon = settled.shape[1], core.held.size
    end = n + _PASS
    inner, s, known = state[:n], state[n:end].view(PASS)[0], settings.view(SETTINGS)[0]
    time = _now(plan, known, s, pass_time, center_x)
    demands, positions = np.empty(horizon), np.empty(horizon)
    for k in range(horizon):
        demands[k], positions[k] = _ahead(plan, known, time + k * known.period)
    if s.begun == 0.0:
        _settle(inner, settled, known.first_demand, demands[0])
        for k in range(end, state.size):
            state[k] = 0.0
        s.begun = 1.0
    leaves = time + known.lag >= known.face_leaves
    reading = np.nan if leaves or not np.isfinite(force) else force
    s.samples, s.time, s.demand = s.samples + 1.0, time, demands[0]
    return ask(core, inner, state[end:], room, reading, demands, positions)


@compiled(error_model="numpy")
def exported_answer(state, core, plan, settings, settled, room, out):
    """Fill `out` by the platform command (mm) of the sample that `exported_ask` has taken."""
    n = settled.shape[1]
    out[0] = answer(core, state[:n], state[n + _PASS :], room)
    return 0
