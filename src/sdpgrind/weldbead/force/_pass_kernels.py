"""A sample of a force controller along a plan, compiled, as exports have it: see `ForceController.step`."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.base.states import record
from sdpgrind.weldbead.force._kernels import control_step

PASS = record("samples 1, time s, clock s, demand N, begun 1")
"""State behind that of `control_step`: samples and time in the pass, its clock, force demanded, whether it
has begun."""
SETTINGS = record(
    "feedforward 1, datum mm, lag s, period s, face_leaves s, has_place 1, place_trust 1, first_demand N"
)
"""Of the controller; `first_demand`: that of the first settled state."""
_TIME, _FORCE, _HEIGHT, _PLACE = range(4)  # rows of the plan


@compiled(error_model="numpy")
def _last_at(row, x):
    """Return the place of the last entry <= x, as `bisect_right` less 1."""
    low, high = 0, row.size
    while low < high:  # at most 64
        middle = (low + high) // 2
        if x < row[middle]:
            high = middle
        else:
            low = middle + 1
    return low - 1


@compiled(error_model="numpy")
def _between(x, k, key, values):
    """Return the value at a point from entry `k` on."""
    if k + 1 == key.size or x == key[k]:
        return values[k]
    return (values[k + 1] - values[k]) / (key[k + 1] - key[k]) * (x - key[k]) + values[k]


@compiled(error_model="numpy")
def _planned(plan, time):
    """Return planned force (N) and height (mm); outside the plan 0 N, at the height of its end."""
    times, last = plan[_TIME], plan.shape[1] - 1
    if times[0] <= time <= times[last]:
        k = _last_at(times, time)
        return _between(time, k, times, plan[_FORCE]), _between(time, k, times, plan[_HEIGHT])
    return 0.0, plan[_HEIGHT, 0] if time < times[0] else plan[_HEIGHT, last]


@compiled(error_model="numpy")
def _when(plan, center_x):
    """Return the planned time of a disc center, s; extrapolated at the speeds of the ends."""
    times, x, last = plan[_TIME], plan[_PLACE], plan.shape[1] - 1
    if center_x < x[0]:
        return times[0] + (center_x - x[0]) * (times[1] - times[0]) / (x[1] - x[0])
    if center_x > x[last]:
        return times[last] + (center_x - x[last]) * (times[last] - times[last - 1]) / (x[last] - x[last - 1])
    return _between(center_x, _last_at(x, center_x), x, times)


@compiled(error_model="numpy")
def _now(plan, known, s, pass_time, center_x):
    """Return the time in the plan, s; a clock that goes back starts a new pass."""
    if pass_time < s.clock:
        s.samples, s.time, s.clock, s.demand, s.begun = 0.0, np.nan, np.nan, np.nan, 0.0
    if not np.isnan(pass_time):
        s.clock = pass_time
    if known.has_place != 0.0 and not np.isnan(center_x):
        place, counted = _when(plan, center_x), s.time + known.period
        return place if np.isnan(counted) else counted + known.place_trust * (place - counted)
    return s.samples * known.period if np.isnan(pass_time) else pass_time


@compiled(error_model="numpy")
def _ahead(plan, known, time):
    """Return force, N, and platform position, mm, to act on now."""
    if known.feedforward == 0.0:
        return _planned(plan, time)[0], known.datum - plan[_HEIGHT, 0]
    force, height = _planned(plan, time + known.lag)
    return force, known.datum - height


@compiled(error_model="numpy")
def _settle(state, settled, first_demand, demand):
    """Write the state after an endless demand, N: exact for the first one, else that for 1 N times it."""
    for k in range(state.size):
        state[k] = (
            settled[0, k] if demand == first_demand or k >= settled.shape[1] - 4 else settled[1, k] * demand
        )


@compiled(error_model="numpy")
def exported_pass(state, core, plan, settings, settled, force, pass_time, center_x, out):
    """Take one sample; `out`: platform command (mm).

    `plan`: time (s), force (N), height (mm), center (mm), a row each; `settled`: state of `control_step` at
    the first demand, and for a demand of 1 N.
    """
    n = settled.shape[1]
    inner, s, known = state[:n], state[n:].view(PASS)[0], settings.view(SETTINGS)[0]
    time = _now(plan, known, s, pass_time, center_x)
    demand, position = _ahead(plan, known, time)
    if s.begun == 0.0:
        _settle(inner, settled, known.first_demand, demand)
        s.begun = 1.0
    leaves = time + known.lag >= known.face_leaves
    reading = np.nan if leaves or not np.isfinite(force) else force
    out[0] = control_step(core, inner, np.empty(n), reading, demand, position)
    s.samples, s.time, s.demand = s.samples + 1.0, time, demand
    return 0
