"""Controllers of fixed sections, compiled: the printed cycle (Dong, Danai, Malkin 2004), and stages."""

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control.state import (
    BALANCE,
    BALANCED,
    COMMAND,
    COMMANDED,
    FULL_RATE,
    MISSED,
    MISSED_MAX,
    PRINTED,
    RATE,
    REMAINING,
    RETRACT,
    SECTION,
    SPARK_OUT,
    Y,
)
from sdpgrind.plunge._model.kernels import (
    _deflected,
    _rate_near,
    _worn,
    beyond,
    burn_depth,
    rate_of_burn,
)


@compiled(error_model="numpy")
def _section_step(state, law, size, usable):
    """Update by a size (mm) that is usable or not; return the command rate (mm/s)."""
    core = _worn(law, 1.0)
    _predict(state, law, core)
    if usable and state[COMMANDED] == 0.0:  # a part may come with more or less stock
        state[REMAINING] = law.stock - size
    elif usable:
        state[REMAINING] += law.gain * (law.stock - size - state[REMAINING])
    if state[REMAINING] <= 0.0 or state[MISSED] >= MISSED_MAX:
        state[SECTION] = RETRACT
    state[BALANCED] = 0.0
    if state[SECTION] == RETRACT:
        return 0.0
    return _printed(state, law, core) if law.form == PRINTED else _staged(state, law, core)


@compiled(error_model="numpy", inline="always")
def _predict(state, law, core):
    """Predict the state after a sample at the last command."""
    u, dt, before = state[COMMAND], law.sample_time, state[Y]
    state[COMMANDED] += u * dt
    if law.form == PRINTED:
        _predict_printed(state, law)
        return
    lost = 1.0 + law.wheel_wear  # of work and wheel: y' = u - lost v, that of no wear at u/lost for lost dt
    state[Y], state[RATE] = _deflected(before, state[RATE], u / lost, lost * dt, 1, core)
    state[REMAINING] -= (u * dt - (state[Y] - before)) / lost


@compiled(error_model="numpy", inline="always")
def _predict_printed(state, law):
    """Predict by (5), after the delay of touch-in."""
    u, dt = state[COMMAND], law.sample_time
    state[REMAINING] -= state[RATE] * dt
    beyond_touch = state[COMMANDED] - law.K0
    if beyond_touch > 0.0:
        pole = law.pole ** min(beyond_touch / (u * dt), 1.0) if u > 0.0 else law.pole
        state[RATE] = pole * state[RATE] + (1.0 - pole) * u


@compiled(error_model="numpy")
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
    depth = left - v * law.sample_time - law.safety_margin  # of damage at the next sample, less the margin
    aim = _balanced_rate(depth, law, core)
    state[BALANCED] = 1.0 if depth > 0.0 and not first else 0.0
    return min(max((aim - law.pole * v) / (1.0 - law.pole), 0.0), law.rate_max)


@compiled(error_model="numpy")
def _balanced_rate(depth, law, core):
    """Rate (mm/s) whose damage is as deep as allowed (mm; <= 0: no damage is)."""
    if law.burn_rate >= law.rate_max:
        return law.rate_max
    if law.no_burn or depth <= 0.0:
        return law.burn_rate
    return rate_of_burn(depth, law.burn_rate, law.rate_max, core)


@compiled(error_model="numpy", inline="always")
def _spark_out_printed(state, law):
    """Begin spark-out by (2) in (3): q_k = tau (v_k - v_f), only above the final rate."""
    v, last = state[RATE], min(law.final_rate, law.burn_rate)
    armed = state[SECTION] < SPARK_OUT and v > last
    if armed and state[REMAINING] <= law.time_constant * (v - last):
        state[SECTION] = SPARK_OUT


@compiled(error_model="numpy")
def _spark_out(state, law):
    """Command of spark-out: 0 until the final rate is reached, then that rate until size."""
    last = min(law.final_rate, law.burn_rate)
    return last if state[RATE] <= last else 0.0


@compiled(error_model="numpy")
def _staged(state, law, core):
    """Rough rate, stage rate, spark-out; a weighted mean in the sample that crosses a switch."""
    lost = 1.0 + law.wheel_wear
    if state[SECTION] == SPARK_OUT:
        return lost * _spark_out(state, law)
    command = _stage(state, law, core)
    kept = beyond(min(law.final_rate, law.burn_rate), core)
    allowed = lost * law.stock + law.K0 + kept - state[COMMANDED]  # until the deflection left ends at size
    if command * law.sample_time < allowed:
        return command
    state[SECTION] = SPARK_OUT
    return max(allowed, 0.0) / law.sample_time


@compiled(error_model="numpy", inline="always")
def _stage(state, law, core):
    """Rough rate, then the stage rate."""
    if state[SECTION] == BALANCE:
        return law.stage_rate
    swells = law.rough_rate - (1.0 + law.wheel_wear) * state[RATE]  # rate of the deflection, mm/s
    reach = _rate_near(state[Y] + swells * law.sample_time, state[RATE], core)
    ahead = 0.5 * (state[RATE] + reach) * law.sample_time
    left = state[REMAINING] - law.stage_remaining
    if left >= ahead:
        return law.rough_rate
    state[SECTION] = BALANCE
    share = max(left, 0.0) / ahead if ahead > 0.0 else 0.0
    return share * law.rough_rate + (1.0 - share) * law.stage_rate
