"""Greatest position of the axis that is safe whatever follows: the one rule of `CycleController`.

If nothing more is commanded, the deflection falls and the stock removed rises along a line. So a commanded
position p is safe if p <= E(q) = (1 + gamma) q + s x(V(stock - q)) - c' at all q still to come, with V(r) the
greatest rate whose damage exceeds the stock r with the chance allowed only.
"""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.plunge._control.filter_state import GAIN, LOAD, SHARPNESS, STATES, STIFFNESS, WEAR, Q
from sdpgrind.plunge._model.kernels import DeflectionLaw, _rate_near, _worn

RATES = 56  # chosen: rates between which E is linear: 0.05 um
LEAP = 5  # measured: step to the last of some 24 rates that damage nothing; with it the fewest are looked at
SLOWEST = 0.25  # chosen: least of them over the final rate, where that is safe at size
RESERVE = 1.5  # chosen: standard deviations of the end position that are kept; see WAITED
# Standard deviations of the end position that are kept beyond what the wait at size makes up for, where wear
# is known. chosen: one part of 700 goes further. measured: 1000 parts of a job of a time constant of 0.39 s,
# all doubted: 6 out of round by up to 2.5 um without it, 2 by up to 0.13 um with it, for 0.03 % of the time
SURE = 3.0
STEPS, CLOSE = 8, 1e-3  # chosen: steps to a rate, and the change of it that is the last; most need one
SLOWER = 0.01  # chosen: else least of them over that, where no rate is the coolest


@compiled(error_model="numpy")
def _variance_of_row(s):
    """Variance of the sum of the estimates times `row`, of all but those of the power monitor."""
    variance = 0.0
    for i in range(GAIN):
        across = 0.5 * s.cov[i * STATES + i] * s.row[i]
        for j in range(i):
            across += s.cov[i * STATES + j] * s.row[j]
        variance += 2.0 * s.row[i] * across
    return variance


class DepthDoubt(NamedTuple):
    """Coefficients of the variance of a depth less the stock (mm^2), by its derivatives.

    They are b by the deflection, of `load_off` its excess over the load, and c by ln of the sharpness.
    """

    one: float
    by_b: float
    by_b_off: float
    by_c: float
    bb: float
    bb_off: float
    bb_off_off: float
    bc: float
    bc_off: float
    cc: float


@compiled(error_model="numpy")
def _depth_doubt(s):
    """Return the coefficients for the estimates as they are."""
    stiff, area = s.mean[STIFFNESS], s.mean[SHARPNESS]
    q, wear = (1.0 + s.mean[WEAR]) * stiff, s.mean[Q] * stiff
    load_q, load_load = s.cov[LOAD * STATES + Q], s.cov[LOAD * STATES + LOAD]
    wear_q, wear_load = s.cov[WEAR * STATES + Q], s.cov[WEAR * STATES + LOAD]
    stiff_q, area_q = s.cov[STIFFNESS * STATES + Q] / stiff, s.cov[SHARPNESS * STATES + Q] / area
    q_q = s.cov[Q * STATES + Q]
    x_q = load_q - q * q_q - wear * wear_q  # covariances of the deflection
    x_load = load_load - q * load_q - wear * wear_load
    x_wear = wear_load - q * wear_q - wear * s.cov[WEAR * STATES + WEAR]
    x_stiff = s.cov[STIFFNESS * STATES + LOAD] / stiff - q * stiff_q
    x_stiff -= wear * s.cov[WEAR * STATES + STIFFNESS] / stiff
    x_area = s.cov[SHARPNESS * STATES + LOAD] / area - q * area_q
    x_area -= wear * s.cov[WEAR * STATES + SHARPNESS] / area
    return DepthDoubt(
        q_q,
        -2.0 * x_q,
        -2.0 * stiff_q,
        -2.0 * area_q,
        x_load - q * x_q - wear * x_wear,
        2.0 * x_stiff,
        s.cov[STIFFNESS * STATES + STIFFNESS] / stiff**2,
        2.0 * x_area,
        2.0 * s.cov[SHARPNESS * STATES + STIFFNESS] / (stiff * area),
        s.cov[SHARPNESS * STATES + SHARPNESS] / area**2,
    )


@compiled(error_model="numpy")
def _quantile_depth(s, law, doubt, core, v, root, w):
    """Depth of damage (mm) that is exceeded with the chance allowed, by the wheel `core`.

    The rate v (mm/s) comes with its powers, root = v^(1/4) and w = v^p.
    """
    bent, warm = core.K2 * w, core.heat2 * w
    heat = core.heat0 + core.heat1 * v + warm
    reach = core.reach * root
    depth, relative = reach * np.log(heat / root), reach / heat
    slope = core.K1 * v + core.p * bent  # dx/dln v
    steep = 0.25 * (depth - reach) + relative * (core.heat1 * v + core.p * warm)  # dz/dln v
    b = -steep / slope
    c = -b * bent - relative * warm
    off = core.K0 + core.K1 * v + bent - s.mean[LOAD]
    variance = doubt.one + c * (doubt.by_c + c * doubt.cc)
    variance += b * (doubt.by_b + off * doubt.by_b_off + c * (doubt.bc + off * doubt.bc_off))
    variance += b * b * (doubt.bb + off * (doubt.bb_off + off * doubt.bb_off_off))
    static = (reach * law.burning_sd) ** 2 + (0.5 * depth * law.diffusivity_sd) ** 2
    return depth + np.sqrt(law.k_static**2 * static + law.k_filter**2 * max(variance, 0.0))


@compiled(error_model="numpy")
def _worn_until(s, law, remaining):
    """Wheel at a remaining stock, mm: the wear flat area grows by the model until then."""
    ahead = max(law.stock - max(remaining, 0.0) - s.mean[Q], 0.0)
    return _worn(law, s.mean[SHARPNESS] + law.growth * ahead)


@compiled(error_model="numpy")
def _depth_ahead(s, law, doubt, v, root, w):
    """Depth of damage (mm) at a rate with its powers, by the wheel as it will be where the stock is as deep.

    If the wear flat area grows, the wheel of now gives too small a depth, as a duller one burns deeper. The
    growth until the stock is that small is then too great, and so is the depth returned: an error on the safe
    side, as is that of a margin, which leaves more stock.
    """
    depth = _quantile_depth(s, law, doubt, _worn_until(s, law, law.stock), v, root, w)
    if law.growth > 0.0:
        depth = _quantile_depth(s, law, doubt, _worn_until(s, law, depth), v, root, w)
    return depth


@compiled(error_model="numpy")
def _position(s, law, remaining, v, w):
    """Commanded position (mm) that leaves a stock (mm) at a rate (mm/s), w = v^p, if no more is commanded."""
    core, removed = _worn_until(s, law, remaining), (1.0 + s.mean[WEAR]) * (law.stock - remaining)
    return removed + (core.K0 + core.K1 * v + core.K2 * w - s.mean[LOAD]) / s.mean[STIFFNESS]


@compiled(error_model="numpy", inline="always")
def keeps_reserve(law):
    """Whether the wear of the wheel is doubted, and learned."""
    return law.online and law.wear_sd > 0.0


@compiled(error_model="numpy")
def end_position(s, law, v):
    """Commanded position (mm) that ends at size at a rate (mm/s), less what is kept of its doubt.

    The axis never goes back, so a part that was fed too far comes to size too fast. It may wait there: ground
    a length beyond size, the deflection is as much less, which makes up for that length of feed. What may be
    wrong beyond that is kept. A wheel that touches earlier than believed, pressed as at the full rate at
    once, hides the stiffness until spark-out: the end is then known to 1.6 um, after 0.4 of a time constant
    to 0.6 um, after one to 0.2 um, when the axis has followed. In the preset, where it is known to 0.06 um,
    nothing is kept.

    Where the wear of the wheel is doubted, it stays doubted at size, and a share is kept all along, so that
    few parts wait. Nothing is kept where nothing is learned: the doubt then lasts.
    """
    w = v**law.p
    position = _position(s, law, 0.0, v, w)
    if not law.online:
        return position
    core, stiff = _worn_until(s, law, 0.0), s.mean[STIFFNESS]
    by_area = law.K2 * w / stiff
    s.row[Q], s.row[LOAD], s.row[WEAR] = -law.growth * by_area, -1.0 / stiff, law.stock
    s.row[STIFFNESS] = (s.mean[LOAD] - core.K0 - core.K1 * v - core.K2 * w) / stiff**2
    s.row[SHARPNESS] = by_area
    spread = np.sqrt(max(_variance_of_row(s), 0.0))
    if keeps_reserve(law):
        return position - RESERVE * spread
    return position - max(SURE * spread - law.size_sd, 0.0)


@compiled(error_model="numpy")
def _rate_at(s, law, doubt, low, at_low, high, at_high, depth):
    """Rate (mm/s) of a depth (mm) between two rates with theirs: false position, that of Illinois.

    Where the slowest of the rates is hardly safe, the depth rises from its minimum there: one step of plain
    false position then ends up to 1.3 % too slow. The last step is on the safe side: the depth is convex.
    """
    if at_low >= depth or low >= high:  # guard
        return low
    less, more, last = depth - at_low, at_high - depth, 0
    v = low + (high - low) * less / (less + more)
    for _ in range(STEPS):
        off = _depth_ahead(s, law, doubt, v, np.sqrt(np.sqrt(v)), v**law.p) - depth
        if off > 0.0:
            high, at_high, more = v, depth + off, off
            less *= 0.5 if last > 0 else 1.0
            last = 1
        else:
            low, at_low, less = v, depth + off, -off
            more *= 0.5 if last < 0 else 1.0
            last = -1
        if at_high <= at_low:  # guard: both are the depth, to rounding
            return low
        near = low + (high - low) * (depth - at_low) / (at_high - at_low)
        if abs(near - v) <= CLOSE * v:
            break
        v = low + (high - low) * less / (less + more)
    return near


@compiled(error_model="numpy")
def _coolest(s, law):
    """Rate (mm/s) of the least heat over that of burning, by the wheel at the end; slower is no safer."""
    core = _worn_until(s, law, 0.0)
    slopes = DeflectionLaw(3.0 * core.heat1, (4.0 * core.p - 1.0) * core.heat2, core.p)
    return _rate_near(core.heat0, law.coolest_rate, slopes)


@compiled(error_model="numpy")
def _slowest(s, law, doubt):
    """Least of the rates, mm/s: one that is safe at size, or the coolest."""
    coolest = _coolest(s, law)
    v = min(max(SLOWEST * law.final_rate, coolest), law.rate_max)
    if _depth_ahead(s, law, doubt, v, np.sqrt(np.sqrt(v)), v**law.p) <= 0.0:
        return v
    return max(coolest, SLOWER * v)


@compiled(error_model="numpy")
def _harmless(s, law, doubt, v, step, root_step, w_step):
    """Number of rates (mm/s) before one that damages nothing, and that one with its powers; else the first.

    The depth is convex: between two rates that damage nothing, none does.
    """
    root, w, passed = np.sqrt(np.sqrt(v)), v**law.p, 0
    at, root_at, w_at = v, root, w
    for number in range(0, RATES, LEAP):
        if _depth_ahead(s, law, doubt, at, root_at, w_at) > 0.0:
            break
        v, root, w, passed = at, root_at, w_at, number
        for _ in range(LEAP):
            at, root_at, w_at = at * step, root_at * root_step, w_at * w_step
    return passed, v, root, w


@compiled(error_model="numpy")
def safe_position(s, law, ahead):
    """Greatest commanded position (mm), rate at size (mm/s), and whether no rate is safe there.

    `ahead` (mm): removed before the command acts. Where no rate is safe, that at size is the coolest.
    """
    now, margin = max(law.stock - s.mean[Q] - ahead, 0.0), law.safety_margin
    allowed = 0.0 if law.no_burn else max(now - margin, 0.0)  # depth of damage
    doubt = _depth_doubt(s)
    v = _slowest(s, law, doubt)
    step = (law.rate_max / v) ** (1.0 / (RATES - 1))
    root_step, w_step = np.sqrt(np.sqrt(step)), step**law.p
    passed, v, root, w = _harmless(s, law, doubt, v, step, root_step, w_step)
    last, before, end, least, saturated = v, np.inf, 0.0, np.inf, 0.0
    for _ in range(RATES - passed):
        depth = _depth_ahead(s, law, doubt, v, root, w)
        if depth > 0.0 and end <= 0.0:  # the greatest rate that is safe without stock
            saturated = 1.0 if before == np.inf else 0.0
            end = _rate_at(s, law, doubt, last, before, v, depth, 0.0)
            least = min(least, _position(s, law, min(margin, now), end, end**law.p))
        if depth > allowed:
            last = _rate_at(s, law, doubt, last, before, v, depth, allowed)
            break
        if depth > 0.0:
            least = min(least, _position(s, law, depth + margin, v, w))
        last, before = v, depth
        v, root, w = v * step, root * root_step, w * w_step
    least = min(least, _position(s, law, now, last, last**law.p))
    final = law.final_rate if end <= 0.0 else min(law.final_rate, end)
    return min(least, end_position(s, law, final)), final, saturated
