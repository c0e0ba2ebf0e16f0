"""Recorded commissioning cycles for tests: the plant of the simulated grinder, and an integrator."""

from functools import cache

import numpy as np
from scipy import signal
from scipy.integrate import solve_ivp

from sdpgrind import plunge
from sdpgrind.plunge import kernels

PROBLEM = plunge.preset("simulation").replace(
    drive=plunge.Drive(feed_lag=0.05, power_lag=0.1, idle_power=300.0), grinding_ratio=40.0
)
MODEL, STEP, MOST = PROBLEM.model, PROBLEM.sample_time, PROBLEM.command_rate_max
TRUTH = {
    "normal_force_ratio": 11.5, "wear_flat_area": 0.032, "specific_energy": 11.0, "ploughing_force": 0.9,
    "idle_power": 220.0, "wheel_wear": 0.02, "feed_lag": 0.07, "power_lag": 0.15, "contact_zero": -0.07,
}  # fmt: skip
RATES = ((1.0, 9.0), (0.3, 7.0), (0.1, 7.0), (0.0, 4.0))  # shares of the greatest rate, s


def model_of(truth, problem=PROBLEM):
    return problem.model.replace(
        normal_force_ratio=truth["normal_force_ratio"], wear_flat_area=truth["wear_flat_area"],
        power=problem.model.power.replace(
            specific_energy=truth["specific_energy"], ploughing_force=truth["ploughing_force"]
        ),
    )  # fmt: skip


def commands(rates=RATES):
    return np.concatenate([np.full(round(seconds / STEP), share * MOST) for share, seconds in rates])


def ground(truth, rate, model=None, delay=0):
    """Sizes (mm) and powers (W) of the plant."""
    known = {name: truth[name] for name in ("feed_lag", "power_lag", "idle_power")}
    exact = kernels.rig(model_of(truth) if model is None else model, 1.0, STEP)
    rig = kernels.driven(exact, plunge.Drive(feed_delay=delay * STEP, **known))._replace(
        contact_zero=-truth["contact_zero"], wheel_wear=truth["wheel_wear"]
    )
    state, out = kernels.part_state(rig), np.empty((rate.size, 2))
    kernels.start_part(state, rig)
    for k, each in enumerate(rate.tolist()):
        out[k] = kernels.read(state, rig, 0.0, 0.0)[:2]
        kernels.advance(state, rig, each)
    return out


def noise(rng, count, rho=0.0):
    """First-order noise of variance 1."""
    white = rng.standard_normal(count) * np.append(1.0, np.full(count - 1, np.sqrt(1 - rho**2)))
    return signal.lfilter([1.0], [1.0, -rho], white)


@cache
def _clean(truth, rates):
    rate = commands(rates)
    return rate, ground(dict(truth), rate)


def recorded(seed=0, rates=RATES, rho=0.0, size_sd=5e-4, power_sd=0.01, **truth):
    """Arrays of a cycle of the machine `TRUTH`, some of its values changed."""
    rate, clean = _clean(tuple((TRUTH | truth).items()), rates)
    rng = np.random.default_rng(seed)
    size = clean[:, 0] + size_sd * noise(rng, rate.size, rho)
    power = clean[:, 1] * (1 + power_sd * noise(rng, rate.size, rho))
    return {"time": STEP * np.arange(rate.size), "command_rate": rate, "size": size, "grinding_power": power}


@cache
def commissioned(seed=0, rho=0.0):
    """Estimate of the machine `TRUTH`."""
    return plunge.identify(recorded(seed, rho=rho), "machine", problem=PROBLEM)


def integrated(model, truth, time, rate, delay=0.0):
    """Sizes and powers by an integrator of the equations as they stand: axis, size, area, monitor."""
    infeed = np.concatenate([[0.0], np.cumsum(rate[:-1] * np.diff(time))])
    lag, late, wear = truth["feed_lag"], truth["power_lag"], model.wear

    def power(v, x, area):
        k0 = model.core.K0
        if x > k0:
            return float(model.grinding_power(v)) + (area / model.wear_flat_area - 1) * model.core.power2 * (
                v**model.core.p
            )
        return model.core.power0 * max(x, 0.0) / k0 if k0 else 0.0

    def slopes(now, state):
        axis, size, area, shown = state
        target = float(np.interp(now - delay, time, infeed))
        place = axis if lag else target
        x = place + truth["contact_zero"] - (1 + truth["wheel_wear"]) * size
        v = rate_at(model, x - model.core.K0, area / model.wear_flat_area)
        return [
            (target - axis) / lag if lag else 0.0, v, wear.rate(v) if wear else 0.0,
            (power(v, x, area) - shown) / late,
        ]  # fmt: skip

    done = solve_ivp(
        slopes, (time[0], time[-1]), [0.0, 0.0, model.wear_flat_area, 0.0], t_eval=time, rtol=1e-8,
        atol=[1e-10, 1e-10, 1e-10, 1e-5], max_step=0.02,
    )  # fmt: skip
    return np.stack([done.y[1], done.y[3] + truth["idle_power"]], axis=1)


def rate_at(model, y, growth):
    """Rate (mm/s) of a deflection beyond ploughing with a grown area, by bisection of its logarithm."""
    if y <= 0.0:
        return 0.0
    core = model.core
    low, high = 1e-12, 10.0
    for _ in range(60):
        middle = (low * high) ** 0.5
        if core.K1 * middle + growth * core.K2 * middle**core.p < y:
            low = middle
        else:
            high = middle
    return middle
