"""One sample of the plunge controllers, compiled."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control.cycle_kernels import _advance_axis, _start_cycle, cycle_step, estimate
from sdpgrind.plunge._control.filter_state import FILTER
from sdpgrind.plunge._control.sections_kernels import _section_step
from sdpgrind.plunge._control.state import (
    BALANCED,
    COMMAND,
    ENVELOPE,
    FILTERED,
    FROZEN,
    FULL_RATE,
    LAW,
    MISSED,
    OUTLYING,
    RATE,
    REMAINING,
    RETRACT,
    SCALE,
    SECTION,
    SHARPNESS,
    SIZE,
    STATES,
    Y,
)


@compiled(error_model="numpy")
def start_control(state, parameters):
    """Reset the state for the next part."""
    law = parameters.view(LAW)[0]
    for place in range(STATES):
        state[place] = 0.0
    state[SECTION], state[REMAINING], state[Y] = FULL_RATE, law.stock, -law.K0
    state[SIZE], state[SCALE], state[SHARPNESS] = np.nan, 1.0, 1.0
    if law.form == ENVELOPE:
        _start_cycle(state, state[FILTERED:].view(FILTER)[0], law)


@compiled(error_model="numpy")
def control_step(state, parameters, size, power):
    """Update the state by size (mm) and power (W), NaN: no reading; return the command rate (mm/s)."""
    law = parameters.view(LAW)[0]
    if law.form == ENVELOPE:
        filtered = state[FILTERED:].view(FILTER)[0]
        _advance_axis(state, filtered, law)
        state[COMMAND] = cycle_step(state, filtered, law, size, power, _usable(state, law, size))
    else:
        state[COMMAND] = _section_step(state, law, size, _usable(state, law, size))
    return state[COMMAND]


@compiled(error_model="numpy")
def _follow_step(state, parameters, size, power, command):
    """Update the estimates by size (mm) and power (W), NaN: no reading; the command (mm/s) was given."""
    law = parameters.view(LAW)[0]
    filtered = state[FILTERED:].view(FILTER)[0]
    _advance_axis(state, filtered, law)
    estimate(state, filtered, law, size, power, _usable(state, law, size))
    state[COMMAND] = command


@compiled(error_model="numpy", inline="always")
def _usable(state, law, size):
    """Whether the size is read, not frozen and free of jumps beyond noise and feed; count the rejected."""
    last, noise = state[SIZE], OUTLYING * law.size_sd
    state[FROZEN] = state[FROZEN] + state[RATE] * law.sample_time if size == last else 0.0
    farthest = law.rate_max * law.sample_time * (state[MISSED] + 1.0)
    jumps = (
        size < last - np.sqrt(2.0) * noise - 1e-12 or size > last + farthest + np.sqrt(2.0) * noise + 1e-12
    )
    if np.isnan(size) or jumps or state[FROZEN] > noise:
        state[MISSED] += 1.0
        return False
    state[MISSED], state[SIZE] = 0.0, size
    return True


@compiled(error_model="numpy")
def exported_step(state, parameters, size, grinding_power, power_saturated, out):
    """Take one sample as `SampledCycle.step` does; `out`: command rate (mm/s), balancing. 1: retract."""
    command = control_step(state, parameters, size, grinding_power if power_saturated == 0.0 else np.nan)
    out[0], out[1] = 0.0, 0.0
    if state[SECTION] == RETRACT:
        return 1
    out[0], out[1] = command, state[BALANCED]
    return 0
