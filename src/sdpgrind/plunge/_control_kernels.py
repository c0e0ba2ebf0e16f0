"""One sample of the controllers of plunge cycles, compiled: `CycleController.step` and whole parts run through here."""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from sdpgrind.plunge._kernels import Core, beyond, burn_depth, burning_begins, deflected, rate_near, rate_of_burn, worn

_OPTIONS: Any = {"cache": True, "nogil": True}
PRINTED, GAUGE, P_END = range(3)
"""How the begin of spark-out is found."""
FULL_RATE, BALANCE, SPARK_OUT, RETRACT = range(1, 5)
"""Sections of a cycle."""
SECTION, RATE, REMAINING, COMMANDED, Y, COMMAND, TARGET, BALANCED, MISSED, STILL, SIZE = range(11)
"""State: v_hat, r_hat, p, deflection beyond ploughing, last command, z*, whether it counts for the slack; of the gauge: readings
that are missing, what should have been ground off (mm) since it moved, and the last reading."""
TOUCHED, SILENT, BLANK, READ, ZERO, SCALE, SHARPNESS, BURNING, COVARIANCE = range(11, 20)
"""Estimated on line: whether the wheel has touched, readings of power that are missing, mean and number of sizes before contact,
contact zero, deflection and wear flat area over those of the model, where burning begins; covariance of deflection, zero, scale
and area."""
STATES = COVARIANCE + 16
NO, YES, BELIEVED = range(3)
"""Whether the wheel has touched; believed: by the command, as power is missing."""
MISSED_MAX = 5
"""Readings of size that are missing one after the other when the part is broken off; of power, when it is done without."""
OUTLYING = 5.0
"""Standard deviations of size that a gauge does not err by."""
TOUCHING = 5.0
"""Standard deviations of power that tell contact."""
DEFLECTION_DRIFT, SHARPNESS_DRIFT = 5e-6, 5e-4
"""What the model may be wrong by in a sample: deflection, mm; wear flat area, relative."""


class Law(NamedTuple):
    """What a controller knows."""

    core: Core
    form: int
    no_burn: bool
    online: bool
    sample_time: float
    stock: float
    safety_margin: float
    rate_max: float
    final_rate: float
    burn_rate: float
    pole: float
    time_constant: float
    gain: float  # of the observer of the size, where nothing is estimated on line
    size_sd: float
    power_sd: float  # relative
    zero_sd: float
    scale_sd: float
    sharpness_sd: float  # relative
    growth: float  # of the wear flat area, relative, 1/mm
    staged: bool  # three stages
    rough_rate: float  # of the first, mm/s
    stage_remaining: float  # stock at which the second begins, mm
    stage_rate: float  # and its rate, mm/s


@njit(**_OPTIONS)
def start_control(state, law):
    """Make the state of the next part."""
    state[:] = 0.0
    state[SECTION], state[REMAINING], state[Y] = FULL_RATE, law.stock, -law.core.K0
    state[SIZE], state[BURNING] = np.nan, law.burn_rate
    _know_nothing(state, law)


@njit(**_OPTIONS)
def _know_nothing(state, law):
    """Of the contact, as before it."""
    state[SCALE] = state[SHARPNESS] = 1.0
    cov = state[COVARIANCE:].reshape(4, 4)
    cov[:] = 0.0
    cov[:2, :2] = law.zero_sd**2
    cov[2, 2], cov[3, 3] = law.scale_sd**2, law.sharpness_sd**2


@njit(**_OPTIONS)
def control_step(state, law, size, power):
    """Take readings of size (mm) and power (W), NaN where there is none, decide, and return the command rate (mm/s)."""
    core = worn(law.core, state[SHARPNESS]) if law.online else law.core
    _predict(state, law, core)
    usable = _usable(state, law, size)
    if usable and state[COMMANDED] == 0.0:  # a part may come with more or less stock
        state[REMAINING] = law.stock - size
    if law.online:
        core = estimated(state, law, size if usable else np.nan, power)
    elif usable:
        state[REMAINING] += law.gain * (law.stock - size - state[REMAINING])
    if state[REMAINING] <= 0.0 or state[MISSED] >= MISSED_MAX:
        state[SECTION] = RETRACT
    state[COMMAND] = _decide(state, law, core)
    return state[COMMAND]


@njit(**_OPTIONS)
def _decide(state, law, core):
    state[BALANCED] = 0.0
    if state[SECTION] == RETRACT:
        return 0.0
    if law.form == PRINTED:
        return _printed(state, law)
    if state[SECTION] == SPARK_OUT:
        return _creep(state, law)
    command = _staged(state, law) if law.staged else _balance(state, law, core)
    return _until_spark_out(state, law, core, command)


@njit(**_OPTIONS)
def _predict(state, law, core):
    """Where the wheel is after a sample of the last command."""
    u, dt, scale, before = state[COMMAND], law.sample_time, state[SCALE], state[Y]
    state[COMMANDED] += u * dt
    if law.form == PRINTED:
        _predict_printed(state, law)
        return
    if law.online and state[TOUCHED] == NO:
        return
    state[Y], state[RATE] = deflected(before, state[RATE], u, dt / scale, 1, core)
    removed = u * dt - scale * (state[Y] - before)
    state[REMAINING] -= removed
    if law.online:
        _spread(state, law, core, u, removed / dt)


@njit(**_OPTIONS)
def _predict_printed(state, law):
    """(5), after the delay of touch-in."""
    u, dt = state[COMMAND], law.sample_time
    state[REMAINING] -= state[RATE] * dt
    beyond_touch = state[COMMANDED] - law.core.K0
    if beyond_touch > 0.0:
        pole = law.pole ** min(beyond_touch / (u * dt), 1.0) if u > 0.0 else law.pole
        state[RATE] = pole * state[RATE] + (1.0 - pole) * u


@njit(**_OPTIONS)
def _spread(state, law, core, u, v):
    """Covariance after a sample of the last command, u and v in mm/s; the wear that the model knows."""
    dt, scale, cov = law.sample_time, state[SCALE], state[COVARIANCE:].reshape(4, 4)
    own, by_scale, by_area = 1.0, -u * dt / scale**2, 0.0
    if state[Y] > 0.0 and v > 0.0:
        slope = core.K1 + core.p * core.K2 * v ** (core.p - 1.0)
        own = np.exp(-dt / (scale * slope))
        by_scale = -(u - v) * dt / scale**2
        by_area = law.core.K2 * v**core.p / slope * dt / scale
        state[SHARPNESS] *= 1.0 + law.growth * v * dt
        cov[3, 3] += SHARPNESS_DRIFT**2
    for j in range(4):
        cov[0, j] = own * cov[0, j] + by_scale * cov[2, j] + by_area * cov[3, j]
    for j in range(4):
        cov[j, 0] = own * cov[j, 0] + by_scale * cov[j, 2] + by_area * cov[j, 3]
    cov[0, 0] += DEFLECTION_DRIFT**2


@njit(**_OPTIONS)
def _usable(state, law, size):
    """Whether a reading of size is one: there, not frozen, no jump beyond noise or feed; count those that are not."""
    last, noise = state[SIZE], OUTLYING * law.size_sd
    state[STILL] = state[STILL] + state[RATE] * law.sample_time if size == last else 0.0
    farthest = law.rate_max * law.sample_time * (state[MISSED] + 1.0)
    jumps = size < last - np.sqrt(2.0) * noise - 1e-12 or size > last + farthest + np.sqrt(2.0) * noise + 1e-12
    if np.isnan(size) or jumps or state[STILL] > noise:
        state[MISSED] += 1.0
        return False
    state[MISSED], state[SIZE] = 0.0, size
    return True


@njit(**_OPTIONS)
def estimated(state, law, size, power):
    """Correct by both readings and return the core of the wheel as it is now: Kalman's filter about the last estimate.

    Power is in proportion to the deflection of the model; size is zero + p - scale x, once the wheel cuts.
    """
    base = law.core
    watts = base.power1 / base.K1
    noise = law.power_sd * (power / watts + base.K0)
    state[SILENT] = state[SILENT] + 1.0 if np.isnan(power) else 0.0
    if state[TOUCHED] == BELIEVED and power / watts < base.K0:  # it is heard now: the wheel does not cut yet
        state[TOUCHED], state[RATE], state[REMAINING] = NO, 0.0, law.stock - state[BLANK]
        _know_nothing(state, law)
    if state[TOUCHED] == NO and size == size:
        state[READ] += 1.0
        state[BLANK] += (size - state[BLANK]) / state[READ]
    if state[TOUCHED] == NO and not _touched(state, law, power / watts, noise):
        return worn(base, state[SHARPNESS])
    x = state[Y] + base.K0
    if power >= 0.0 and x > 0.0:
        x = _correct(state, x, power / watts - x, 1.0, 0.0, 0.0, noise**2)
    if size == size:
        off = size - (state[ZERO] + state[COMMANDED] - state[SCALE] * x)
        x = _correct(state, x, off, -state[SCALE], 1.0, -x, law.size_sd**2)
    state[Y] = x - base.K0
    core = worn(base, state[SHARPNESS])
    state[RATE] = rate_near(state[Y], state[RATE], core)
    state[BURNING] = burning_begins(core, state[BURNING], law.rate_max)
    state[REMAINING] = law.stock - (state[ZERO] + state[COMMANDED] - state[SCALE] * x)
    return core


@njit(**_OPTIONS)
def _touched(state, law, x, noise):
    """Whether the wheel touches: power says so, and how far it is in; long without power the command must be believed."""
    known = x == x
    if (x <= TOUCHING * noise) if known else (state[COMMANDED] <= 0.0 or state[SILENT] < MISSED_MAX):
        return False
    state[TOUCHED] = YES if known else BELIEVED
    cov = state[COVARIANCE:].reshape(4, 4)
    if not known:
        x = state[COMMANDED]
    variance = noise**2 if known else law.zero_sd**2
    state[Y], state[ZERO] = x - law.core.K0, state[BLANK] + x - state[COMMANDED]
    cov[:2, :2] = variance
    cov[1, 1] += law.size_sd**2 / max(state[READ], 1.0) + (x * law.scale_sd) ** 2
    cov[1, 2] = cov[2, 1] = x * law.scale_sd**2
    return True


@njit(**_OPTIONS)
def _correct(state, x, off, h0, h1, h2, variance):
    """One correction, of a reading that depends on deflection x, zero and scale by h0, h1 and h2; return x."""
    cov = state[COVARIANCE:].reshape(4, 4)
    gain = np.empty(4)
    for j in range(4):
        gain[j] = h0 * cov[j, 0] + h1 * cov[j, 1] + h2 * cov[j, 2]
    total = h0 * gain[0] + h1 * gain[1] + h2 * gain[2] + variance
    if total <= 0.0:  # all is known already
        return x
    for i in range(4):
        for j in range(4):
            cov[i, j] -= gain[i] * gain[j] / total
    off /= total
    state[ZERO] += gain[1] * off
    state[SCALE] = min(max(state[SCALE] + gain[2] * off, 0.2), 5.0)
    state[SHARPNESS] = min(max(state[SHARPNESS] + gain[3] * off, 0.2), 5.0)
    return x + gain[0] * off


@njit(**_OPTIONS)
def _balanced_rate(state, law, core, ahead, reach):
    """The rate up to `reach` (mm/s) whose damage is as deep as the stock at the next sample, less the margin."""
    state[TARGET] = state[REMAINING] - ahead - law.safety_margin
    if state[BURNING] >= reach:
        return reach
    if law.no_burn or state[TARGET] <= 0.0:
        return state[BURNING]
    return rate_of_burn(state[TARGET], state[BURNING], reach, core)


@njit(**_OPTIONS)
def _printed(state, law):
    """Sections by (2), (3) and (5) as printed, with a constant time constant."""
    v, left, first = state[RATE], state[REMAINING], False
    if state[SECTION] == FULL_RATE:
        burn = burn_depth(v, law.core) if v > law.burn_rate else 0.0
        burning = v >= law.burn_rate if law.no_burn else burn > 0.0 and burn >= left - law.safety_margin
        if burning:
            state[SECTION], first = BALANCE, True
    _spark_out_printed(state, law)
    if state[SECTION] == FULL_RATE:
        return law.rate_max
    if state[SECTION] == SPARK_OUT:
        return _creep(state, law)
    aim = _balanced_rate(state, law, law.core, v * law.sample_time, law.rate_max)
    state[BALANCED] = 1.0 if state[TARGET] > 0.0 and not first else 0.0
    return min(max((aim - law.pole * v) / (1.0 - law.pole), 0.0), law.rate_max)


@njit(**_OPTIONS)
def _spark_out_printed(state, law):
    """(2) in (3): q_k = tau (v_k - v_f); armed above the final rate only."""
    v, last = state[RATE], _final_rate(state, law)
    armed = state[SECTION] < SPARK_OUT and v > last
    if armed and state[REMAINING] <= law.time_constant * (v - last):
        state[SECTION] = SPARK_OUT


@njit(**_OPTIONS)
def _creep(state, law):
    """Nothing is commanded until the final rate is reached; where size is not, that rate is kept."""
    last = _final_rate(state, law)
    return last if state[RATE] <= last else 0.0


@njit(**_OPTIONS)
def _final_rate(state, law):
    """Infeed rate at size, mm/s: round enough, and without damage."""
    return min(law.final_rate, state[BURNING])


@njit(**_OPTIONS)
def _balance(state, law, core):
    """Full rate until the damage would be deeper than the stock at the next sample, then just as deep."""
    v, dt, scale = state[RATE], law.sample_time, state[SCALE]
    reach = rate_near(state[Y] + (law.rate_max - v) * dt / scale, v, core)
    aim = _balanced_rate(state, law, core, 0.5 * (v + reach) * dt, reach)
    command = law.rate_max
    if aim < reach:
        aim = _balanced_rate(state, law, core, 0.5 * (v + aim) * dt, reach)
        needed = scale * (beyond(aim, core) - state[Y]) / dt + 0.5 * (v + aim)
        command = min(max(needed, 0.0), law.rate_max)
    if state[SECTION] == BALANCE:
        state[BALANCED] = 1.0 if state[TARGET] > 0.0 else 0.0
    elif command < law.rate_max and state[Y] > 0.0:
        state[SECTION] = BALANCE
    return command


@njit(**_OPTIONS)
def _staged(state, law):
    """A rough rate, then a slower one: the sample in which the stock is reached gets of both, so that it is exact between."""
    if state[SECTION] == BALANCE:
        return law.stage_rate
    reach = rate_near(state[Y] + (law.rough_rate - state[RATE]) * law.sample_time, state[RATE], law.core)
    ahead = 0.5 * (state[RATE] + reach) * law.sample_time
    left = state[REMAINING] - law.stage_remaining
    if left >= ahead:
        return law.rough_rate
    state[SECTION] = BALANCE
    share = max(left, 0.0) / ahead if ahead > 0.0 else 0.0
    return share * law.rough_rate + (1.0 - share) * law.stage_rate


@njit(**_OPTIONS)
def _until_spark_out(state, law, core, command):
    """The command, or the last of it before spark-out: exact between samples."""
    allowed = _allowed(state, law, core)
    if command * law.sample_time < allowed:
        return command
    state[SECTION] = SPARK_OUT
    return max(allowed, 0.0) / law.sample_time


@njit(**_OPTIONS)
def _allowed(state, law, core):
    """How much may still be commanded (mm) so that the deflection that is given back leaves the final rate at size."""
    kept = beyond(_final_rate(state, law), core)
    if law.form == GAUGE or law.online:
        return state[REMAINING] - state[SCALE] * (state[Y] - kept)
    return law.stock + core.K0 + kept - state[COMMANDED]
