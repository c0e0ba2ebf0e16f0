"""Kalman filter of contact zero, deflection and sharpness during the part, compiled."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control.state import (
    BELIEVED,
    BURNING,
    COMMANDED,
    COVARIANCE,
    DEFLECTION_DRIFT,
    FILTERED,
    MISSED_MAX,
    NO,
    RATE,
    READ,
    REMAINING,
    SCALE,
    SHARPNESS,
    SHARPNESS_DRIFT,
    SIZE_OFFSET,
    TOUCHED,
    TOUCHING,
    UNPOWERED,
    YES,
    ZERO,
    Y,
)
from sdpgrind.plunge._model.kernels import _burning_begins, _rate_near, _worn


@compiled
def _reset_estimates(state, law):
    """Reset estimates and covariance to those before contact."""
    state[SCALE] = state[SHARPNESS] = 1.0
    for place in range(COVARIANCE, FILTERED):
        state[place] = 0.0
    variance = law.zero_sd**2
    state[COVARIANCE], state[COVARIANCE + 1] = variance, variance
    state[COVARIANCE + 4], state[COVARIANCE + 5] = variance, variance
    state[COVARIANCE + 10], state[COVARIANCE + 15] = law.scale_sd**2, law.sharpness_sd**2  # diagonal


@compiled
def _propagate(state, cov, law, core, u, v):
    """Covariance after a sample at command u and rate v (mm/s); growth of the wear flat area by the model."""
    dt, scale = law.sample_time, state[SCALE]
    own, by_scale, by_area = 1.0, -u * dt / scale**2, 0.0
    if state[Y] > 0.0 and v > 0.0:
        slope = core.K1 + core.p * core.K2 * v ** (core.p - 1.0)
        own = np.exp(-dt / (scale * slope))
        by_scale = -(u - v) * dt / scale**2
        by_area = law.K2 * v**core.p / slope * dt / scale
        state[SHARPNESS] *= 1.0 + law.growth * v * dt
        cov[3, 3] += SHARPNESS_DRIFT**2
    for j in range(4):
        cov[0, j] = own * cov[0, j] + by_scale * cov[2, j] + by_area * cov[3, j]
    for j in range(4):
        cov[j, 0] = own * cov[j, 0] + by_scale * cov[j, 2] + by_area * cov[j, 3]
    cov[0, 0] += DEFLECTION_DRIFT**2


@compiled
def _corrected(state, cov, law, size, power):
    """Correct the state by size (mm) and power (W); return the coefficients of the wheel.

    Extended Kalman filter. Power is proportional to the deflection of the model; once the wheel cuts, the
    size is zero + command - scale x.
    """
    watts = law.power1 / law.K1  # W for 1 mm
    noise = law.power_sd * (power / watts + law.K0)
    state[UNPOWERED] = state[UNPOWERED] + 1.0 if np.isnan(power) else 0.0
    if state[TOUCHED] == BELIEVED and power / watts < law.K0:  # power is back: the wheel does not cut yet
        state[TOUCHED], state[RATE], state[REMAINING] = NO, 0.0, law.stock - state[SIZE_OFFSET]
        _reset_estimates(state, law)
    before = state[TOUCHED] == NO
    if before and size == size:
        state[READ] += 1.0
        state[SIZE_OFFSET] += (size - state[SIZE_OFFSET]) / state[READ]
    if before and not _touched(state, cov, law, power / watts, noise):
        return _worn(law, state[SHARPNESS])
    x = state[Y] + law.K0
    if power >= 0.0 and x > 0.0 and not before:  # the reading that showed the contact is used already
        x = _correct(state, cov, x, power / watts - x, 1.0, 0.0, 0.0, noise**2)
    if size == size and not before:
        off = size - (state[ZERO] + state[COMMANDED] - state[SCALE] * x)
        x = _correct(state, cov, x, off, -state[SCALE], 1.0, -x, law.size_sd**2)
    state[Y] = x - law.K0
    core = _worn(law, state[SHARPNESS])
    state[RATE] = _rate_near(state[Y], state[RATE], core)
    state[BURNING] = _burning_begins(core, state[BURNING], law.rate_max)
    state[REMAINING] = law.stock - (state[ZERO] + state[COMMANDED] - state[SCALE] * x)
    return core


@compiled
def _touched(state, cov, law, x, noise):
    """Whether the wheel touches, by power, or by the command after `MISSED_MAX` samples without power."""
    known = x == x
    if (x <= TOUCHING * noise) if known else (state[COMMANDED] <= 0.0 or state[UNPOWERED] < MISSED_MAX):
        return False
    state[TOUCHED] = YES if known else BELIEVED
    if not known:
        x = state[COMMANDED]
    variance = noise**2 if known else law.zero_sd**2
    state[Y], state[ZERO] = x - law.K0, state[SIZE_OFFSET] + x - state[COMMANDED]
    cov[0, 0] = cov[0, 1] = cov[1, 0] = cov[1, 1] = variance
    cov[1, 1] += law.size_sd**2 / max(state[READ], 1.0) + (x * law.scale_sd) ** 2
    cov[1, 2] = cov[2, 1] = x * law.scale_sd**2
    return True


@compiled
def _correct(state, cov, x, off, h0, h1, h2, variance):
    """Correct by one reading with innovation `off` and slopes h0, h1, h2 by x, zero, scale; return x."""
    gain = np.empty(4)
    for j in range(4):
        gain[j] = h0 * cov[j, 0] + h1 * cov[j, 1] + h2 * cov[j, 2]
    total = h0 * gain[0] + h1 * gain[1] + h2 * gain[2] + variance
    if total <= 0.0:  # no uncertainty left
        return x
    for i in range(4):
        for j in range(4):
            cov[i, j] -= gain[i] * gain[j] / total
    off /= total
    state[ZERO] += gain[1] * off
    state[SCALE] = min(max(state[SCALE] + gain[2] * off, 0.2), 5.0)
    state[SHARPNESS] = min(max(state[SHARPNESS] + gain[3] * off, 0.2), 5.0)
    return x + gain[0] * off
