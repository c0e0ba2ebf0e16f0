"""Greatest position of the axis that is safe whatever follows: the rule of the confident controller.

If nothing more is commanded, the deflection falls and the stock removed rises along a line. So a commanded
position p is safe if p <= E(q) = (1 + gamma) q + s x(V(stock - q)) - c' at all q still to come, with V(r) the
greatest rate whose damage exceeds the stock r with the chance allowed only.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control.confident import GAIN, SCALE, SHARPNESS, STATES, WEAR, ZERO, Q
from sdpgrind.plunge._model.kernels import _worn, beyond

RATES = 56  # chosen: rates between which E is linear: 0.05 um
SLOWEST = 0.25  # chosen: least of them over the final rate


@compiled
def quantile_depth(s, law, core, v):
    """Depth of damage (mm) at a rate (mm/s) that is exceeded with the chance allowed."""
    scale, growth = s.mean[SCALE], 1.0 + s.mean[WEAR]
    root, w = np.sqrt(np.sqrt(v)), v**core.p
    heat = core.heat0 + core.heat1 * v + core.heat2 * w
    reach = core.reach * root
    depth = reach * np.log(heat / root)
    slope = core.K1 + core.p * core.K2 * w / v  # dx/dv
    steep = 0.25 * depth / v + reach * ((core.heat1 + core.p * core.heat2 * w / v) / heat - 0.25 / v)  # dz/dv
    x = core.K0 + core.K1 * v + core.K2 * w
    area = s.mean[SHARPNESS]
    by_rate = -steep / (slope * scale)
    s.row[Q], s.row[ZERO] = -1.0 - by_rate * growth, by_rate
    s.row[SCALE], s.row[WEAR] = -by_rate * x, -by_rate * s.mean[Q]
    s.row[SHARPNESS] = (steep * core.K2 * w / slope - reach * core.heat2 * w / heat) / area
    variance = 0.0
    for i in range(GAIN):
        for j in range(GAIN):
            variance += s.row[i] * s.cov[i * STATES + j] * s.row[j]
    static = (reach * law.burning_sd) ** 2 + (0.5 * depth * law.diffusivity_sd) ** 2
    return depth + np.sqrt(law.k_static**2 * static + law.k_filter**2 * max(variance, 0.0))


@compiled
def safe_position(s, law, ahead):
    """Greatest commanded position (mm), and the rate at size (mm/s); `ahead` (mm): removed before it acts."""
    core = _worn(law, s.mean[SHARPNESS])
    scale, growth, zero = s.mean[SCALE], 1.0 + s.mean[WEAR], s.mean[ZERO]
    now = max(law.stock - s.mean[Q] - ahead, 0.0)
    slowest = min(max(SLOWEST * law.final_rate, law.coolest_rate), law.rate_max)
    step = (law.rate_max / slowest) ** (1.0 / (RATES - 1))
    v, before, last, end = slowest, 0.0, 0.0, 0.0
    least = np.inf
    for k in range(RATES):
        remaining = quantile_depth(s, law, core, v) + law.safety_margin
        if remaining > 0.0 and end <= 0.0:  # the greatest rate that is safe without stock
            share = 1.0 if k == 0 else -before / (remaining - before)
            end = v if k == 0 else last + share * (v - last)
        if remaining > now:
            at = (
                v if k == 0 else last + (v - last) * min(max((now - before) / (remaining - before), 0.0), 1.0)
            )
            least = min(least, growth * (law.stock - now) + scale * (core.K0 + beyond(at, core)) - zero)
            break
        if remaining > 0.0:
            least = min(least, growth * (law.stock - remaining) + scale * (core.K0 + beyond(v, core)) - zero)
        before, last = remaining, v
        if k == RATES - 1:  # every rate is safe here
            least = min(least, growth * (law.stock - now) + scale * (core.K0 + beyond(v, core)) - zero)
        v *= step
    final = law.final_rate if end <= 0.0 else min(law.final_rate, end)
    least = min(least, growth * law.stock + scale * (core.K0 + beyond(final, core)) - zero)
    return least, final
