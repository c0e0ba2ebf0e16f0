"""Cycles for several tests: nominal and random parameters; commands integrated by scipy."""

import warnings
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

from sdpgrind import physics, plunge, units

NOMINAL = plunge.preset("simulation")


@cache
def drawn():
    """Eight problems with random parameters and a rate that does not burn."""
    rng, found = np.random.default_rng(0), []
    while len(found) < 8:
        share = rng.uniform(size=7)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found.append(_changed(share))
        except ValueError:
            continue
    return found


def _changed(share):
    return NOMINAL.replace(
        command_rate_max=0.03 + 0.06 * share[0], burning=physics.BurningLimit(6.205, 3 + 4.2 * share[1]),
        stock=0.15 + 0.25 * share[2], stiffness=4e3 + 26e3 * share[3], wear_flat_area=0.008 + 0.024 * share[4],
        roundness_max=units.um(2 + 4 * share[5]), work_rotation=units.hz(3 + 3 * share[6]), sample_time=1e-3,
        time_constant=None,
    )  # fmt: skip


def problem(number):
    """0: the nominal one; else a random one."""
    return NOMINAL if number == 0 else drawn()[number - 1]


def play(best):
    """Deflection, remaining stock (mm) and wear flat area where each command ends, from the model alone."""
    t, model = best.trajectory, best.problem.model
    time, command, rotation = t.time.values, t.command_rate.values, t.work_rotation.values
    wear = model.wear or plunge.Wear(0.0)
    state = [0.0, best.problem.stock, model.wear_flat_area]
    changes = np.flatnonzero(np.diff(time) == 0)  # a place is told twice where the command changes
    ends = [*changes, time.size - 1]
    begin, states = 1, []
    for end in ends:
        here = model.replace(wear=None, work_rotation=float(rotation[begin]))

        def slope(now, y, here=here, u=float(command[begin])):
            v = float(_rate(here, max(y[0], 0.0), y[2]))
            return [u - v, -v, wear.rate(v)]

        done = solve_ivp(slope, (time[begin], time[end]), state, rtol=1e-8, atol=1e-11)
        state = done.y[:, -1].tolist()
        states.append(state)
        begin = end + 1
    return np.array(ends), np.array(states)


def _rate(model, y, area):
    """Rate (mm/s) of a deflection beyond ploughing at another area: the sliding part of it grows with the
    area.
    """
    c = model.core
    scaled = c._replace(K2=c.K2 * area / model.wear_flat_area)
    high = max(y / scaled.K1, 1e-30)
    for _ in range(60):
        w = high**scaled.p
        step = (scaled.K1 * high + scaled.K2 * w - y) / (scaled.K1 + scaled.p * scaled.K2 * w / high)
        high = max(high - step, 0.1 * high)
        if abs(step) <= 1e-13 * high:
            break
    return high if y > 0 else 0.0
