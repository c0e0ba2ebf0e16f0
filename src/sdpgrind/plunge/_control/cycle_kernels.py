"""One sample of the controller whose axis keeps to the safe position, compiled."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control.envelope_kernels import keeps_reserve, safe_position
from sdpgrind.plunge._control.filter_kernels import _read_size, deflected, predict, read_power
from sdpgrind.plunge._control.filter_state import GAIN, SHOWN, WEAR, Q
from sdpgrind.plunge._control.filter_state import LOAD as C
from sdpgrind.plunge._control.filter_state import SHARPNESS as A
from sdpgrind.plunge._control.filter_state import STATES as SIZE_OF
from sdpgrind.plunge._control.filter_state import STIFFNESS as K
from sdpgrind.plunge._control.state import (
    BALANCE,
    BALANCED,
    BELIEVED,
    COMMAND,
    COMMANDED,
    GROWN,
    MISSED,
    MISSED_MAX,
    NO,
    OUTLYING,
    RATE,
    READ,
    REMAINING,
    RETRACT,
    SATURATED,
    SCALE,
    SECTION,
    SHARPNESS,
    SIZE_OFFSET,
    SPARK_OUT,
    TOUCHED,
    TOUCHING,
    UNPOWERED,
    YES,
    ZERO,
)
from sdpgrind.plunge._model.kernels import _rate_near, _worn

CREEP = 0.9  # chosen: share of the final rate below which the wheel is fed on
# Greatest way beyond size over the gauge's noise. measured, at 0.5 um of noise: 2880 parts on wheels that
# wear end up to 0.37 um beyond size, all round; 0.75 and a RESERVE of 1: up to 0.47 um; 0.5 and 1: 3 out
WAITED = 0.6
WAIT = 1.004  # chosen: rate at the end over the final rate; a smaller value waits longer at size


@compiled(error_model="numpy")
def _start_cycle(state, s, law):
    """Reset axis and filter for the next part."""
    state[TOUCHED] = NO if law.online else YES  # without estimation the wheel touches where it should
    s.queue[:] = 0.0
    s.axis = s.trail = s.sent = 0.0
    believe(s, law)


@compiled(error_model="numpy")
def believe(s, law):
    """Set the estimates of the filter to what is believed before contact."""
    s.mean[:] = 0.0
    s.cov[:] = 0.0
    s.mean[K], s.mean[A], s.mean[WEAR], s.rate = 1.0, 1.0, law.wheel_wear, 0.0
    s.cov[C * SIZE_OF + C] = law.zero_sd**2
    s.cov[K * SIZE_OF + K], s.cov[A * SIZE_OF + A] = law.scale_sd**2, law.sharpness_sd**2
    s.cov[WEAR * SIZE_OF + WEAR], s.cov[GAIN * SIZE_OF + GAIN] = law.wear_sd**2, law.gain_sd**2


@compiled(error_model="numpy")
def moved(trail, u, duration, lag):
    """Way (mm) of the axis in a duration (s) at a command (mm/s): exact for a ramp through a lag (s)."""
    if lag <= 0.0:
        return u * duration
    return u * duration + (trail - u * lag) * -np.expm1(-duration / lag)


@compiled(error_model="numpy")
def _advance_axis(state, s, law):
    """Send the last command; move the axis by the one that is due; predict the part."""
    u, dt, delay = state[COMMAND], law.sample_time, int(law.feed_delay)
    state[COMMANDED] += u * dt
    if delay > 0:
        place = int(s.sent) % delay
        u, s.queue[place] = s.queue[place], u
        s.sent += 1.0
    before = s.axis
    middle = before + moved(s.trail, u, 0.5 * dt, law.feed_lag)
    s.axis += moved(s.trail, u, dt, law.feed_lag)
    s.trail += u * dt - (s.axis - before)
    if state[TOUCHED] != NO:
        predict(s, law, before, middle)


@compiled(error_model="numpy")
def in_air(state, s, law, size, power):
    """Average sizes before contact; look for the contact by power, or by the command without power.

    While the power shows none, the wheel may touch at once, not earlier: what is commanded is safe for that.
    Sizes that grow without power, as of a monitor that is off, end the part.
    """
    known, watts = power == power, law.power1 / law.K1
    if size == size and _grown(state, law, size) and known:
        state[GROWN] += 1.0  # of a work that no power shows to be ground
        state[MISSED] = MISSED_MAX if state[GROWN] >= MISSED_MAX else state[MISSED]
    elif size == size:
        state[GROWN] = 0.0
        state[READ] += 1.0
        state[SIZE_OFFSET] += (size - state[SIZE_OFFSET]) / state[READ]
    of_size = law.size_sd**2 / max(state[READ], 1.0)
    s.mean[Q] = state[SIZE_OFFSET]
    s.cov[Q * SIZE_OF + Q] = s.cov[C * SIZE_OF + Q] = s.cov[Q * SIZE_OF + C] = of_size
    way = (s.axis if known else 0.0) - (1.0 + s.mean[WEAR]) * s.mean[Q]
    load(s, law, -way, way, of_size + (0.0 if known else law.zero_sd**2))
    state[UNPOWERED] = 0.0 if known else state[UNPOWERED] + 1.0
    if known and power > TOUCHING * law.power_sd * (watts * law.K0 + law.idle_power):
        state[TOUCHED] = YES
        noise = law.power_sd * (max(power / watts, law.K0) + law.idle_power / watts)
        _touch_by_power(s, law, power / watts, noise, power)
    elif not known and s.axis > 0.0 and state[UNPOWERED] >= MISSED_MAX:
        state[TOUCHED] = BELIEVED


@compiled(error_model="numpy")
def load(s, law, mean, way, variance):
    """Set the load (mm) and its variance where the axis is a way (mm) beyond the stock: w = x - k way."""
    s.mean[C] = mean
    s.cov[C * SIZE_OF + C] = variance + (way * law.scale_sd) ** 2
    s.cov[C * SIZE_OF + K] = s.cov[K * SIZE_OF + C] = -way * law.scale_sd**2


@compiled(error_model="numpy", inline="always")
def _grown(state, law, size):
    """Whether a size (mm) is beyond the mean of those before, noise and the feed of a sample."""
    return (
        state[READ] > 0.0
        and size > state[SIZE_OFFSET] + OUTLYING * law.size_sd + law.rate_max * law.sample_time
    )


@compiled(error_model="numpy")
def _touch_by_power(s, law, x, noise, power):
    """Set the contact by a deflection x of the model and its noise (mm), which a power (W) shows."""
    late = law.sample_time + law.feed_lag + 2.0 * law.power_lag
    lagged = law.rate_max * late if law.feed_lag + law.power_lag > 0.0 else 0.0
    of_size, watts = s.cov[Q * SIZE_OF + Q], law.power1 / law.K1
    way = s.axis - (1.0 + s.mean[WEAR]) * s.mean[Q]
    load(s, law, x - way, way, noise**2 + lagged**2 + of_size + (x * law.gain_sd) ** 2)
    s.cov[C * SIZE_OF + GAIN] = s.cov[GAIN * SIZE_OF + C] = -x * law.gain_sd**2
    s.mean[SHOWN] = power
    s.cov[SHOWN * SIZE_OF + SHOWN] = (watts * noise) ** 2


@compiled(error_model="numpy")
def observe(state, s, law, size):
    """Correct stock and contact by a size (mm) with a constant gain; the deflection is that of the model."""
    gain = 1.0 if state[COMMANDED] == 0.0 else law.gain  # a part may come with more or less stock
    off = gain * (size - s.mean[Q])
    s.mean[Q] += off
    s.mean[C] += (1.0 + s.mean[WEAR]) * off


@compiled(error_model="numpy")
def _read_all(state, s, law, size, power, usable):
    """Correct the estimates by size (mm) and power (W), NaN: no reading."""
    if not law.online:
        if usable:
            observe(state, s, law, size)
        return
    if state[TOUCHED] == BELIEVED and power < law.power0:  # power is back: the wheel does not cut yet
        state[TOUCHED] = NO
        believe(s, law)
    if state[TOUCHED] == NO:
        in_air(state, s, law, size if usable else np.nan, power)
    else:
        if usable:
            _read_size(s, law, size)
        if power > 0.0:
            read_power(s, law, power, s.axis)


@compiled(error_model="numpy")
def ahead(s, law, x, core):
    """Stock (mm) that goes at least before the next command acts: at a deflection x (mm), nothing fed."""
    until = law.sample_time * (law.feed_delay + 1.0)
    half = x - 0.5 * until * s.rate * (1.0 + s.mean[WEAR]) * s.mean[K]
    return until * _rate_near(half - law.K0, s.rate, core)


@compiled(error_model="numpy")
def at_size(state, s, law, waits):
    """Whether the part is at size, or as far beyond it as it may wait to be round."""
    beyond = -state[REMAINING]
    if beyond < 0.0 or not waits:
        return beyond >= 0.0
    if keeps_reserve(law):  # few parts wait, and none for a sample that would be too much
        return beyond + s.rate * law.sample_time >= WAITED * law.size_sd
    return beyond >= law.size_sd


@compiled(error_model="numpy")
def estimate(state, s, law, size, power, usable):
    """Update the estimates by size (mm) and power (W), NaN: no reading; return the wheel as it is now."""
    _read_all(state, s, law, size, power - law.idle_power, usable)
    x, core = deflected(s, s.axis), _worn(law, s.mean[A])
    s.rate = 0.0 if state[TOUCHED] == NO else _rate_near(x - law.K0, s.rate, core)
    state[RATE], state[REMAINING], state[BALANCED] = s.rate, law.stock - s.mean[Q], 0.0
    state[ZERO], state[SCALE], state[SHARPNESS] = s.mean[C] / s.mean[K], 1.0 / s.mean[K], s.mean[A]
    return core


@compiled(error_model="numpy")
def cycle_step(state, s, law, size, power, usable):
    """Update by size (mm) and power (W), NaN: no reading; return the command rate (mm/s)."""
    if s.mean[K] <= 0.0:  # guard: a state that was never started
        state[SECTION] = RETRACT
        return 0.0
    core = estimate(state, s, law, size, power, usable)
    gone = ahead(s, law, deflected(s, s.axis), core) if state[TOUCHED] != NO else 0.0
    most, final, state[SATURATED] = safe_position(s, law, gone)
    waits = state[SECTION] == SPARK_OUT and s.rate > WAIT * final
    if at_size(state, s, law, waits) or state[MISSED] >= MISSED_MAX:
        state[SECTION] = RETRACT
        return 0.0
    return command_of(state, law, most, final)


@compiled(error_model="numpy")
def command_of(state, law, most, final):
    """Command (mm/s) up to the safe position; section, and whether damage and stock are balanced."""
    command = min(max((most - state[COMMANDED]) / law.sample_time, 0.0), law.rate_max)
    if state[TOUCHED] != NO and max(command, state[RATE]) < CREEP * final:
        command = final
    if command < law.rate_max and state[TOUCHED] != NO:
        state[SECTION] = SPARK_OUT if command <= 0.0 or state[SECTION] == SPARK_OUT else BALANCE
        deep = state[SECTION] == BALANCE and state[REMAINING] > law.safety_margin
        state[BALANCED] = 1.0 if deep else 0.0
    return command
