"""Extended Kalman filter of a plunge cycle: size, contact, deflection, sharpness, wheel wear, power gain.

The wheel touches where (1 + gamma) q + x/k = c' + p: q the stock removed, gamma the wear of the wheel, x the
deflection of the model at the rate v and sharpness a, k the stiffness over the model's, c' the contact, p the
position of the axis. The states are q, the load w = k c', k, a, gamma, g (gain of the power monitor less 1)
and the power that a slow monitor shows; the axis is known, as lag and dead time are exact recursions. Size
reads q, power (1 + g) of the power, which is in proportion to x = w + k (p - (1 + gamma) q): linear in w and
k, so their doubts may be wide. By the scale of the deflection, 1/k, a filter diverges where it is half of
what is believed.
"""

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control.filter_state import GAIN, LOAD, SHARPNESS, SHOWN, STATES, STIFFNESS, WEAR, Q
from sdpgrind.plunge._model.kernels import _rate_near, _worn

# Process noise of q, mm^2/s, as a variance over time, so that no doubt hangs on how often one looks. chosen:
# 2 nm in 0.04 s. That of the sharpness is declared, over stock: a wheel changes by grinding, not by waiting
SIZE_WALK = 1e-10


@compiled(error_model="numpy", inline="always")
def deflected(s, p):
    """Deflection x of the model, mm, at a position of the axis, mm."""
    return s.mean[LOAD] + s.mean[STIFFNESS] * (p - (1.0 + s.mean[WEAR]) * s.mean[Q])


@compiled(error_model="numpy")
def slopes(s, law, x, v):
    """Write the derivatives of deflection (mm) and rate (mm/s) by the states into ``by_x`` and ``by_v``."""
    stiff, growth, area = s.mean[STIFFNESS], 1.0 + s.mean[WEAR], s.mean[SHARPNESS]
    for j in range(STATES):
        s.by_x[j] = s.by_v[j] = 0.0
    s.by_x[Q], s.by_x[LOAD] = -growth * stiff, 1.0
    s.by_x[STIFFNESS], s.by_x[WEAR] = (x - s.mean[LOAD]) / stiff, -s.mean[Q] * stiff
    if v <= 0.0:
        return
    w = v**law.p
    slope = law.K1 + law.p * law.K2 * area * w / v  # dx/dv
    for j in range(STATES):
        s.by_v[j] = s.by_x[j] / slope
    s.by_v[SHARPNESS] = -law.K2 * w / slope


@compiled(error_model="numpy")
def predict(s, law, before, middle):
    """Mean and covariance a sample later; positions of the axis (mm) before and in the middle of it."""
    core, dt = _worn(law, s.mean[SHARPNESS]), law.sample_time
    x = deflected(s, before)
    v = _rate_near(x - law.K0, s.rate, core)
    half = deflected(s, middle) - (1.0 + s.mean[WEAR]) * s.mean[STIFFNESS] * 0.5 * dt * v
    at = _rate_near(half - law.K0, v, core)
    slopes(s, law, half, at)
    stiff = 1.0 / (1.0 - 0.5 * dt * s.by_v[Q])  # the rate in the middle moves with the size at the beginning
    power = law.power1 / law.K1 * max(half, 0.0)
    s.mean[Q] += at * dt
    s.mean[SHARPNESS] += law.growth * at * dt
    _spread(s, law, stiff * dt)
    s.cov[Q * STATES + Q] += SIZE_WALK * dt
    s.cov[SHARPNESS * STATES + SHARPNESS] += law.sharpness_walk * at * dt
    s.mean[SHOWN] = law.power_pole * s.mean[SHOWN] + (1.0 - law.power_pole) * power
    s.rate = at


@compiled(error_model="numpy")
def _spread(s, law, dt):
    """Covariance a sample later: F C F', with F the identity but for q and the shown power."""
    watts, pole = law.power1 / law.K1, law.power_pole
    for along, across in ((STATES, 1), (1, STATES)):  # rows by F, then columns by F'
        for j in range(STATES):
            by_q, by_shown = 0.0, 0.0
            for i in range(STATES):
                by_q += s.by_v[i] * s.cov[i * along + j * across]
                by_shown += s.by_x[i] * s.cov[i * along + j * across]
            s.row[j] = s.cov[Q * along + j * across] + dt * by_q
            s.cross[j] = pole * s.cov[SHOWN * along + j * across] + (1.0 - pole) * watts * by_shown
        for j in range(STATES):
            s.cov[Q * along + j * across], s.cov[SHOWN * along + j * across] = s.row[j], s.cross[j]


@compiled(error_model="numpy")
def _read_size(s, law, size):
    """Correct by a size, mm."""
    for j in range(STATES):
        s.by_x[j] = 0.0
    s.by_x[Q] = 1.0
    _correct(s, size - s.mean[Q], law.size_sd**2)


@compiled(error_model="numpy")
def read_power(s, law, power, position):
    """Correct by a power, W, with the axis at a position, mm."""
    watts, gain = law.power1 / law.K1, 1.0 + s.mean[GAIN]
    if law.power_pole > 0.0:
        shown = s.mean[SHOWN]
        for j in range(STATES):
            s.by_x[j] = 0.0
        s.by_x[SHOWN] = gain
    else:
        x = deflected(s, position)
        shown = watts * x
        slopes(s, law, x, 0.0)
        for j in range(STATES):
            s.by_x[j] *= gain * watts
    s.by_x[GAIN] = shown
    # by the predicted power: noise by the reading would give low readings more weight
    most = max(gain * shown, watts * law.K0) + law.idle_power  # the monitor's noise is of all that it shows
    _correct(s, power - gain * shown, (law.power_sd * most) ** 2)


@compiled(error_model="numpy")
def _correct(s, off, variance):
    """Correct by one reading with innovation `off` and slopes ``by_x``."""
    total = variance
    for i in range(STATES):
        s.cross[i] = 0.0
        for j in range(STATES):
            s.cross[i] += s.cov[i * STATES + j] * s.by_x[j]
        total += s.by_x[i] * s.cross[i]
    if total <= 0.0:  # guard: no uncertainty left
        return
    for i in range(STATES):
        s.mean[i] += s.cross[i] * off / total
        for j in range(STATES):
            s.cov[i * STATES + j] -= s.cross[i] * s.cross[j] / total
    for k in (STIFFNESS, SHARPNESS):
        s.mean[k] = min(max(s.mean[k], 0.2), 5.0)
