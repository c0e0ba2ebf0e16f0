"""Deflection and depth of damage as functions of the infeed rate, compiled."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# Decay of the logarithm of the peak temperature per depth sqrt(alpha l_c/v_w) below a moving band.
DECAY = 0.915  # measured: Jaeger's integrals give 0.869 to 0.925 at Peclet numbers of 10 to 30
SERIES = 0.2  # chosen: relative step up to which its series converges


class PlungeCore(NamedTuple):
    """Coefficients of a model over the infeed rate v: deflection x = K0 + K1 v + K2 v^p, mm.

    Heat relative to that of burning is (heat0 + heat1 v + heat2 v^p)/v^(1/4), the depth of damage reach
    v^(1/4) times its logarithm, mm; power is power0 + power1 v + power2 v^p, W.
    """

    K0: float
    K1: float
    K2: float
    p: float
    heat0: float
    heat1: float
    heat2: float
    reach: float
    power0: float
    power1: float
    power2: float


class DeflectionLaw(NamedTuple):
    """Coefficients of the deflection beyond ploughing, y = K1 v + K2 v^p, mm."""

    K1: float
    K2: float
    p: float


@compiled(error_model="numpy", inline="always")
def beyond(v, core):
    """Deflection beyond that of ploughing, y = x - K0, mm."""
    return core.K1 * v + core.K2 * v**core.p


@compiled
def deflections_beyond(v, core):
    """Deflections beyond that of ploughing, mm, of an array of rates."""
    out = np.empty(v.size)
    for k in range(v.size):
        out[k] = beyond(v[k], core)
    return out


@compiled(error_model="numpy", inline="always")
def burn_depth(v, core):
    """Depth of damage, mm, at a rate v > 0; negative: distance to damage."""
    root = np.sqrt(np.sqrt(v))
    return core.reach * root * np.log((core.heat0 + core.heat1 * v + core.heat2 * v**core.p) / root)


@compiled(inline="always")
def reserve(v, remaining, coldest, core):
    """Rise of ln of the temperature that damages the finished surface, at a rate v (mm/s) and a stock (mm).

    inf up to the `coldest` rate, below which burning is an artefact of the ploughing force.
    """
    if v > coldest:
        left = max(remaining, 0.0) - burn_depth(v, core)
        return left / (core.reach * np.sqrt(np.sqrt(v)))
    return np.inf


@compiled(error_model="numpy")
def _worn(core, ratio):
    """Coefficients, of a core or a record with its fields, of a wheel whose area has grown by `ratio`."""
    k2, heat2, power2 = core.K2 * ratio, core.heat2 * ratio, core.power2 * ratio
    return PlungeCore(
        core.K0,
        core.K1,
        k2,
        core.p,
        core.heat0,
        core.heat1,
        heat2,
        core.reach,
        core.power0,
        core.power1,
        power2,
    )


@compiled
def _heat_slope(t, core):
    """Derivative of heat less heat of burning by t = v^(1/4)."""
    return 4.0 * (core.heat1 * t**4 + core.p * core.heat2 * t ** (4.0 * core.p)) / t - 1.0


@compiled
def _least_heat(high, core):
    """Value of t = v^(1/4) <= high at which heat less heat of burning is least, by bisection."""
    if _heat_slope(high, core) <= 0.0:
        return high
    low = 0.0
    for _ in range(60):
        t = 0.5 * (low + high)
        if _heat_slope(t, core) > 0.0:
            high = t
        else:
            low = t
    return low


@compiled
def _damage(v, core):
    """Depth of damage, mm; 0 below the rate at which burning begins, an artefact of the ploughing force."""
    if v <= 0.0:
        return 0.0
    depth = burn_depth(v, core)
    if depth <= 0.0 or _heat_slope(np.sqrt(np.sqrt(v)), core) > 0.0:  # above the lower root of burning
        return max(depth, 0.0)
    t = _least_heat(1.0, core)
    everywhere = core.heat0 + core.heat1 * t**4 + core.heat2 * t ** (4.0 * core.p) > t
    return depth if everywhere else 0.0


@compiled(error_model="numpy", inline="always")
def _solved(y, v, w, core, enough):
    """Infeed rate v (mm/s) of a deflection y > 0 beyond ploughing, and w = v^p, from those of another.

    y = K1 w^(1/p) + K2 w is convex in w. Each step is its inverse series to third order, and the last one
    needs no power: the relative error is the fourth power of that step, which is at most `enough`.
    """
    q = 1.0 / core.p
    for _ in range(60):
        linear, bent = core.K1 * v, core.K2 * w
        slope = 1.0 / (q * linear + bent)  # dln w/dy
        step = (y - linear - bent) * slope
        if abs(step) <= SERIES:
            curve = 0.5 * (q - 1.0) * q * linear * slope
            step *= 1.0 - step * (curve - step * curve * (2.0 * curve - (q - 2.0) / 3.0))
            if abs(step) <= enough:
                rise = 1.0 + 0.5 * (q - 1.0) * step * (1.0 + (q - 2.0) / 3.0 * step)
                return v * (1.0 + q * step * rise), w * (1.0 + step)
        w *= 1.0 + step if step > -1.0 else 0.5  # guard
        v = w**q
    return v, w


@compiled(error_model="numpy")
def rate(y, core):
    """Infeed rate (mm/s) of a deflection y beyond ploughing; 0 where the wheel only ploughs."""
    if y <= 0.0:
        return 0.0
    w = 1.0 / (core.K2 / y + (core.K1 / y) ** core.p)  # that of either term alone, or less
    return _solved(y, w ** (1.0 / core.p), w, core, 1e-4)[0]


@compiled(error_model="numpy", inline="always")
def _pair_near(y, v, w, core):
    """Infeed rate v (mm/s) of a deflection y to 1e-11, and w = v^p, from those of a deflection near it."""
    if y <= 0.0:
        return 0.0, 0.0
    if v <= 0.0:
        v = rate(y, core)
        return v, v**core.p
    return _solved(y, v, w, core, 5e-4)


@compiled(error_model="numpy")
def _rate_near(y, near, core):
    """Infeed rate (mm/s) of a deflection y to 1e-11, from a rate near it: fewer powers than `rate`."""
    return _pair_near(y, near, near**core.p, core)[0]


@compiled
def rates(y, core):
    """Infeed rates (mm/s) of an array of deflections."""
    out = np.empty(y.size)
    for k in range(y.size):
        out[k] = rate(y[k], core)
    return out


@compiled(error_model="numpy")
def rate_of_burn(depth, low, high, core):
    """Greatest rate in [low, high] (mm/s) with at most `depth` (mm) of damage: Illinois rule."""
    below, above = burn_depth(low, core) - depth, burn_depth(high, core) - depth
    if above <= 0.0 or below >= 0.0:
        return high if above <= 0.0 else low
    side = 0
    for _ in range(80):
        v = (low * above - high * below) / (above - below)
        off = burn_depth(v, core) - depth
        if off > 0.0:
            high, above = v, off
            below *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            low, below = v, off
            above *= 0.5 if side < 0 else 1.0
            side = -1
        if abs(off) <= 1e-15 or high - low <= 1e-15 * high:
            break
    return v


@compiled(error_model="numpy")
def _deflected(y, near, command_rate, duration, steps, core):
    """Deflection beyond ploughing (mm) and rate (mm/s) after a duration (s); `near`: rate before.

    y' = u - v(y) by Runge and Kutta. At y < 0 the wheel has not touched or only ploughs, and y' = u.
    """
    if y < 0.0:
        reached = y + command_rate * duration
        if reached <= 0.0:
            return reached, 0.0
        duration, y = reached / command_rate, 0.0
    h = duration / steps
    v, w = _pair_near(y, near, near**core.p, core)
    for _ in range(steps):
        a = command_rate - v
        v, w = _pair_near(y + 0.5 * h * a, v, w, core)
        b = command_rate - v
        v, w = _pair_near(y + 0.5 * h * b, v, w, core)
        c = command_rate - v
        v, w = _pair_near(y + h * c, v, w, core)
        y += h / 6.0 * (a + 2.0 * b + 2.0 * c + command_rate - v)
        v, w = _pair_near(y, v, w, core)
    return y, v
