"""Best points of the built-in processes by ways that know nothing of a tracer, and the numbers that must come
out.
"""

import math
from types import SimpleNamespace

import numpy as np
from scipy.optimize import brentq, minimize, minimize_scalar

M_PER_MIN = 1000 / 60  # derived: mm/s

GAINS = {  # hidden state of Koren's example -> greatest stable gain, greatest gain without overshoot
    0.5: (0.8, 0.4),
    0.52: (0.8436, 0.4218),
    1.0: (1.3333, 0.6667),
    1.1235: (1.3462, 0.6731),
    2.0: (1.1, 0.55),
    4.0: (0.6078, 0.3039),
    20.0: (0.1086, 0.0543),
}
ON_TURNING_LOCUS = {  # mm -> m/min, mm
    0.2: (176.2621, 0.472266),
    0.3: (198.5496, 0.375368),
    0.4: (232.2730, 0.284185),
    0.5: (284.3223, 0.205416),
}
ON_GRINDING_LOCUS = {  # area -> Z' mm^2/s, v_w mm/s, a um
    0.005: (4.21736, 430.734, 9.791),
    0.0075: (1.49137, 249.660, 5.974),
    0.01: (0.218862, 514.491, 0.4254),
}


def named(**values):
    return SimpleNamespace(**values)


def slacks(problem, hidden, controls):
    """Limit - response of every constraint of a problem at one point."""
    s, c = named(**hidden), named(**controls)
    return [one.limit(s, c) - one.response(s, c) for one in problem.varying]


def turning_rates(wear):
    """Best speed (m/min) and feed (mm) of the turning preset, all in m/min, min, N: one search over the feed."""

    def speed(feed):
        """The Taylor speed, or that at which the force is just small enough."""
        free = 180 * (15 / (3.5 * 3)) ** 0.25 * (0.3 / feed) ** 0.4
        softened = (3400 * feed**0.75 + 1200 * wear - 2860 * feed**0.5) / 1.2
        return max(free, softened)

    def cost(feed):
        v = speed(feed)
        if v > 350:
            return 1 + v  # out of range: dearer than all
        return (1 + 3.5 / (15 * (180 / v) ** 4 * (0.3 / feed) ** 1.6)) / (v * feed)

    feeds = np.linspace(0.02, 0.5, 4801)
    best = feeds[np.argmin([cost(feed) for feed in feeds])]
    found = minimize_scalar(
        cost,
        bounds=(max(best - 2e-4, 0.02), min(best + 2e-4, 0.5)),
        method="bounded",
        options={"xatol": 1e-12},
    )
    feed = found.x if found.fun < cost(best) else best
    return speed(feed), feed


def removal_rate_at(grinding, area, low=1e-4, high=300.0):
    """Z' (mm^2/s) of the locus at an area, from the calibration."""
    return math.exp(
        brentq(
            lambda z: float(grinding.wear_flat_area_on_locus(math.exp(z))) - area,
            math.log(low),
            math.log(high),
            xtol=1e-14,
        )
    )


def excess_power(grinding, removal_rate, work_speed, area):
    """Power less burning power for each width (W/mm), written out from section 6 of the source and Brown
    (4.2), (4.3).
    """
    a, wide = removal_rate / work_speed, grinding.equivalent_diameter
    sliding = (7.55 + 2.1e6 * work_speed / (grinding.wheel_speed * wide)) * math.sqrt(wide * a) * area
    power = 13.8 * work_speed * a + (0.962 + sliding) * grinding.wheel_speed / 1000
    return power - 6.2 * work_speed * a - 7.2 * (wide * a) ** 0.25 * math.sqrt(work_speed)


def fastest_removal(grinding, area, speeds=(12.0, 1890.0)):
    """Greatest Z' (mm^2/s) without burning, and its work speed: one search over the speed, one root at each."""

    def removal(logarithm):
        def excess(root):
            return excess_power(grinding, root**4, math.exp(logarithm), area)

        least = minimize_scalar(excess, bounds=(1e-3, 5.0), method="bounded", options={"xatol": 1e-10}).x
        return brentq(excess, least, 8.0, xtol=1e-15) ** 4 if excess(least) < 0 else 0.0

    ends = [math.log(speed) for speed in speeds]
    grid = np.linspace(*ends, 200)
    best = grid[np.argmax([removal(one) for one in grid])]
    step = grid[1] - grid[0]
    bounds = (max(best - step, ends[0]), min(best + step, ends[1]))
    found = minimize_scalar(
        lambda one: -removal(one), bounds=bounds, method="bounded", options={"xatol": 1e-12}
    )
    return -found.fun, math.exp(found.x)


def last_area(grinding, work_speed):
    """Area beyond which everything burns at a work speed (mm/s): where the least excess power is 0."""

    def least(area):
        found = minimize_scalar(
            lambda root: excess_power(grinding, root**4, work_speed, area),
            bounds=(1e-3, 3.0),
            method="bounded",
            options={"xatol": 1e-11},
        )
        return found.fun

    return brentq(least, 1e-4, 0.5, xtol=1e-15)


def dressed_point(process, dullness, state):
    """Z' (mm^2/s), work speed (mm/s) and lead (mm) of dressed grinding where both limits are active."""
    grinding = process.grinding

    def lead(rate):
        return process.lead_at_roughness(grinding.infeed_rate(rate), state)

    def misfit(logarithm):
        rate = math.exp(logarithm)
        return (
            process.wear_flat_area(lead(rate), dullness) / float(grinding.wear_flat_area_on_locus(rate)) - 1
        )

    rate = math.exp(brentq(misfit, math.log(0.05), math.log(20.0), xtol=1e-14))
    return rate, float(grinding.work_speed_on_locus(rate)), lead(rate)


def slsqp(problem, hidden, start):
    """A best point (controls by name) by SLSQP in logarithms of the controls, from a start."""
    names = problem.names
    ends = np.log([problem.controls[name] for name in names])

    def controls(q):
        return dict(zip(names, np.exp(q), strict=True))

    s = named(**hidden)
    sizes = np.array([abs(one.limit(s, named(**start))) for one in problem.varying])
    size = abs(problem.objective(s, named(**start)))
    limits = {"type": "ineq", "fun": lambda q: np.array(slacks(problem, hidden, controls(q))) / sizes}
    found = minimize(
        lambda q: problem.objective(s, named(**controls(q))) / size,
        np.log([start[name] for name in names]),
        method="SLSQP",
        bounds=ends,
        constraints=[limits],
        options={"ftol": 1e-15, "maxiter": 500},
    )
    return controls(found.x)


def koren_run(x, gain, steps, start=44 / 401):
    """Koren's v(i+1) = v(i) + k e along the circle, with a hidden state that may change: (v, u, e) from the
    start on.
    """
    values = np.broadcast_to(np.asarray(x, dtype=float), (steps + 1,))
    v, out = start, []
    for value in values:
        v = min(max(v, 44 / 401), 4.0)
        u = math.sqrt(5 - (v - 2) ** 2)
        e = 1 + u - value * v
        out.append((v, u, e))
        v += gain * e
    return np.array(out)
