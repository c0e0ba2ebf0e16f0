"""Koren's (36) on the closed-form locus, written down once more from its page, for tests of the grinder it
walks on.
"""

import numpy as np
from scipy.optimize import brentq

from sdpgrind import locus

PROBLEM = locus.preset("grinding")
NOMINAL = PROBLEM.model
U_B, B, U_CH, PLOUGH, C2, C3, WIDTH, WHEEL, WORK, WIDE = (
    6.2,
    7.2,
    13.8,
    0.962,
    7.55,
    2.1e6,
    9.3,
    30e3,
    60.0,
    50.0,
)


def burning(rate, rotation):
    """Burning power, W."""
    speed, depth = rotation * WORK / 2, 2 * np.pi * rate / rotation
    return WIDTH * (U_B * speed * depth + B * (WIDE * depth) ** 0.25 * speed**0.5)


def needed(rate, rotation, area):
    """Grinding power, W."""
    speed, depth = rotation * WORK / 2, 2 * np.pi * rate / rotation
    force = PLOUGH + (C2 + C3 * speed / (WHEEL * WIDE)) * (WIDE * depth) ** 0.5 * area
    return WIDTH * (U_CH * speed * depth + force * WHEEL / 1000)


def rotation_on_locus(rate):
    """Work rotation of the locus, rad/s: R > 3 with B (D_e Z' v_w)^(1/4) (R - 3)/(2 (R - 1)) = (u_ch - u_b)
    Z' + F_pl V_s.
    """
    removal, unit = np.pi * WORK * rate, C2 * WHEEL * WIDE / C3

    def excess(ratio):
        heat = B * (WIDE * removal * ratio * unit) ** 0.25 * (ratio - 3) / (2 * (ratio - 1))
        return heat - (U_CH - U_B) * removal - PLOUGH * WHEEL / 1000

    return 2 / WORK * unit * brentq(excess, 3.0, 1e5, xtol=1e-12)


def best_rate(area):
    """Infeed rate of the locus at an area, mm/s: where nothing is left of the slack."""

    def slack(rate):
        rotation = rotation_on_locus(rate)
        return burning(rate, rotation) - needed(rate, rotation, area)

    return brentq(slack, 5e-4, 0.1, xtol=1e-15)


class Printed:
    """Koren (36): v += K1 e + K2 (e - e before), e = burning power of the command less the measured power."""

    period = 0.5

    def __init__(self, rate=1e-3, *, hold=3.0, factor=1.0):
        self.first, self.hold, self.factor = rate, hold, factor

    def reset(self):
        self.rate, self.error, self.samples = self.first, None, 0

    def step(self, *, grinding_power, **others):
        rotation = rotation_on_locus(self.rate)
        if self.samples * self.period > self.hold:
            error = burning(self.rate, rotation) - grinding_power
            change = 3.3e-6 * error + (0.0 if self.error is None else 5.3e-6 * (error - self.error))
            self.rate, self.error = max(8e-4, self.rate + self.factor * change), error
            rotation = rotation_on_locus(self.rate)
        self.samples += 1
        return {"infeed_rate": self.rate, "work_rotation": rotation}


class Learned:
    """The next part begins where the last one ended."""

    def next(self, controller, part_log):
        rates = part_log.column("controller", "infeed_rate_command")
        return Printed(float(rates[np.isfinite(rates)][-1]), hold=controller.hold, factor=controller.factor)
