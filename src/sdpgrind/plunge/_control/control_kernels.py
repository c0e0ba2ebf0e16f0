"""One sample of the plunge controllers, compiled."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control.confident import FILTER
from sdpgrind.plunge._control.confident_kernels import advance_axis, confident_step, start_confident
from sdpgrind.plunge._control.estimator_kernels import _corrected, _propagate, _reset_estimates
from sdpgrind.plunge._control.state import (
    BALANCE,
    BALANCED,
    BURNING,
    COMMAND,
    COMMANDED,
    CONFIDENT,
    COVARIANCE,
    FILTERED,
    FROZEN,
    FULL_RATE,
    GAUGE,
    LAW,
    MISSED,
    MISSED_MAX,
    NO,
    OUTLYING,
    PRINTED,
    RATE,
    REMAINING,
    RETRACT,
    SCALE,
    SECTION,
    SHARPNESS,
    SIZE,
    SPARK_OUT,
    STATES,
    TARGET,
    TOUCHED,
    Y,
)
from sdpgrind.plunge._model.kernels import (
    _deflected,
    _least_over_burn,
    _rate_near,
    _worn,
    beyond,
    burn_depth,
    rate_of_burn,
)

ROUND_ENOUGH = 1.004  # chosen: rate at the end over the final rate; a smaller value waits longer at size


@compiled
def start_control(state, parameters):
    """Reset the state for the next part."""
    law = parameters.view(LAW)[0]
    for place in range(STATES):
        state[place] = 0.0
    state[SECTION], state[REMAINING], state[Y] = FULL_RATE, law.stock, -law.K0
    state[SIZE], state[BURNING] = np.nan, law.burn_rate
    _reset_estimates(state, law)
    if law.form == CONFIDENT:
        start_confident(state[FILTERED:].view(FILTER)[0], law)


@compiled
def control_step(state, parameters, size, power):
    """Update the state by size (mm) and power (W), NaN: no reading; return the command rate (mm/s)."""
    law = parameters.view(LAW)[0]
    if law.form == CONFIDENT:
        filtered = state[FILTERED:].view(FILTER)[0]
        advance_axis(state, filtered, law)
        state[COMMAND] = confident_step(state, filtered, law, size, power, _usable(state, law, size))
        return state[COMMAND]
    covariance = state[COVARIANCE:FILTERED].reshape(4, 4)
    core = _worn(law, state[SHARPNESS])
    _predict(state, covariance, law, core)
    usable = _usable(state, law, size)
    if usable and state[COMMANDED] == 0.0:  # a part may come with more or less stock
        state[REMAINING] = law.stock - size
    if law.online:
        core = _corrected(state, covariance, law, size if usable else np.nan, power)
    elif usable:
        state[REMAINING] += law.gain * (law.stock - size - state[REMAINING])
    if _done(state, law) or state[MISSED] >= MISSED_MAX:
        state[SECTION] = RETRACT
    state[COMMAND] = _decide(state, law, core)
    return state[COMMAND]


@compiled(inline="always")
def _done(state, law):
    """Whether the part is to size and, as learned so far, round; `size_sd` is the tolerance of the wait."""
    waits = law.online > 0.0 and state[SECTION] == SPARK_OUT and state[RATE] > ROUND_ENOUGH * law.final_rate
    return state[REMAINING] <= (-law.size_sd if waits else 0.0)


@compiled(inline="always")
def _decide(state, law, core):
    state[BALANCED] = 0.0
    if state[SECTION] == RETRACT:
        return 0.0
    if law.form == PRINTED:
        return _printed(state, law, core)
    if state[SECTION] == SPARK_OUT:
        return _spark_out(state, law)
    command = _staged(state, law, core) if law.staged else _balance(state, law, core)
    return _until_spark_out(state, law, core, command)


@compiled(inline="always")
def _predict(state, covariance, law, core):
    """Predict the state after a sample at the last command."""
    u, dt, scale, before = state[COMMAND], law.sample_time, state[SCALE], state[Y]
    state[COMMANDED] += u * dt
    if law.form == PRINTED:
        _predict_printed(state, law)
        return
    if law.online and state[TOUCHED] == NO:
        return
    state[Y], state[RATE] = _deflected(before, state[RATE], u, dt / scale, 1, core)
    removed = u * dt - scale * (state[Y] - before)
    state[REMAINING] -= removed
    if law.online:
        _propagate(state, covariance, law, core, u, removed / dt)


@compiled(inline="always")
def _predict_printed(state, law):
    """Predict by (5), after the delay of touch-in."""
    u, dt = state[COMMAND], law.sample_time
    state[REMAINING] -= state[RATE] * dt
    beyond_touch = state[COMMANDED] - law.K0
    if beyond_touch > 0.0:
        pole = law.pole ** min(beyond_touch / (u * dt), 1.0) if u > 0.0 else law.pole
        state[RATE] = pole * state[RATE] + (1.0 - pole) * u


@compiled(inline="always")
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


@compiled
def _balanced_rate(state, law, core, ahead, reach):
    """Rate up to `reach` (mm/s) whose damage equals the stock at the next sample less the margin."""
    state[TARGET] = state[REMAINING] - ahead - law.safety_margin
    if state[BURNING] >= reach:
        return reach
    if law.no_burn or state[TARGET] <= 0.0:
        return state[BURNING]
    return rate_of_burn(state[TARGET], state[BURNING], reach, core)


@compiled
def _printed(state, law, core):
    """Command by (2), (3) and (5) as printed, with a constant time constant."""
    v, left, first = state[RATE], state[REMAINING], False
    if state[SECTION] == FULL_RATE:
        burn = burn_depth(v, core) if v > law.burn_rate else 0.0
        burning = v >= law.burn_rate if law.no_burn else burn > 0.0 and burn >= left - law.safety_margin
        if burning:
            state[SECTION], first = BALANCE, True
    _spark_out_printed(state, law)
    if state[SECTION] == FULL_RATE:
        return law.rate_max
    if state[SECTION] == SPARK_OUT:
        return _spark_out(state, law)
    aim = _balanced_rate(state, law, core, v * law.sample_time, law.rate_max)
    state[BALANCED] = 1.0 if state[TARGET] > 0.0 and not first else 0.0
    return min(max((aim - law.pole * v) / (1.0 - law.pole), 0.0), law.rate_max)


@compiled(inline="always")
def _spark_out_printed(state, law):
    """Begin spark-out by (2) in (3): q_k = tau (v_k - v_f), only above the final rate."""
    v, last = state[RATE], _final_rate(state, law)
    armed = state[SECTION] < SPARK_OUT and v > last
    if armed and state[REMAINING] <= law.time_constant * (v - last):
        state[SECTION] = SPARK_OUT


@compiled
def _spark_out(state, law):
    """Command of spark-out: 0 until the final rate is reached, then that rate until size."""
    last = _final_rate(state, law)
    return last if state[RATE] <= last else 0.0


@compiled
def _final_rate(state, law):
    """Infeed rate at size, mm/s: round enough and without damage."""
    return min(law.final_rate, state[BURNING])


@compiled
def _balance(state, law, core):
    """Full rate until the damage would exceed the stock at the next sample, then the rate of equal depths."""
    v, dt = state[RATE], law.sample_time
    reach = _rate_near(state[Y] + (law.rate_max - v) * dt / state[SCALE], v, core)
    aim = _balanced_rate(state, law, core, 0.5 * (v + reach) * dt, reach)
    command = law.rate_max
    if aim < reach:
        removed = _removed(state, law, core, _to_rate(state, law, core, aim, 0.5 * (v + aim) * dt))
        aim = _balanced_rate(state, law, core, removed, reach)
        command = _to_rate(state, law, core, aim, removed)
    command = min(command, max(_burn_allowance(state, law, core), 0.0) / dt)
    if state[SECTION] == BALANCE:
        state[BALANCED] = 1.0 if state[TARGET] > 0.0 else 0.0
    elif command < law.rate_max and state[Y] > 0.0:
        state[SECTION] = BALANCE
    return command


@compiled
def _removed(state, law, core, command):
    """Stock removed by a command (mm/s) in a sample, mm; the trapezoidal rule errs by 1e-6."""
    y, _ = _deflected(state[Y], state[RATE], command, law.sample_time / state[SCALE], 1, core)
    return command * law.sample_time - state[SCALE] * (y - state[Y])


@compiled
def _to_rate(state, law, core, aim, removed):
    """Command (mm/s) for the rate `aim` at the next sample, with `removed` (mm) until then."""
    needed = (state[SCALE] * (beyond(aim, core) - state[Y]) + removed) / law.sample_time
    return min(max(needed, 0.0), law.rate_max)


@compiled
def _burn_allowance(state, law, core):
    """Greatest command in a sample, mm, after which damage stays shallow enough even without further command.

    Deflection less stock grows by the command alone. It must stay below the limit of burning at all smaller
    stocks: the running minimum of the exact plan. The minimum is at the present stock where the limit falls
    towards it, else at a turning point, found here. Damage no deeper than that at the burn rate needs no
    bound.
    """
    left = state[REMAINING] - law.safety_margin
    if law.no_burn or state[BURNING] >= law.rate_max or left <= max(burn_depth(state[BURNING], core), 0.0):
        return np.inf
    top = rate_of_burn(left, state[BURNING], law.rate_max, core)
    least = _least_over_burn(state[SCALE], state[BURNING], top, core) - law.safety_margin
    return least - (state[SCALE] * state[Y] - state[REMAINING])


@compiled(inline="always")
def _staged(state, law, core):
    """Rough rate, then the stage rate; their weighted mean in the sample that crosses the switch."""
    if state[SECTION] == BALANCE:
        return law.stage_rate
    reach = _rate_near(state[Y] + (law.rough_rate - state[RATE]) * law.sample_time, state[RATE], core)
    ahead = 0.5 * (state[RATE] + reach) * law.sample_time
    left = state[REMAINING] - law.stage_remaining
    if left >= ahead:
        return law.rough_rate
    state[SECTION] = BALANCE
    share = max(left, 0.0) / ahead if ahead > 0.0 else 0.0
    return share * law.rough_rate + (1.0 - share) * law.stage_rate


@compiled(inline="always")
def _until_spark_out(state, law, core, command):
    """The command, or the rest of it before spark-out."""
    allowed = _sparkout_allowance(state, law, core)
    if command * law.sample_time < allowed:
        return command
    state[SECTION] = SPARK_OUT
    return max(allowed, 0.0) / law.sample_time


@compiled(inline="always")
def _sparkout_allowance(state, law, core):
    """Command left, mm, until releasing the deflection ends at size with the final rate."""
    kept = beyond(_final_rate(state, law), core)
    if law.form == GAUGE or law.online:
        return state[REMAINING] - state[SCALE] * (state[Y] - kept)
    return law.stock + core.K0 + kept - state[COMMANDED]
