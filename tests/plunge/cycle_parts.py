"""Simulated parts for tests of controllers."""

import math

import hwsim
from sdpgrind import plunge
from sdpgrind.base.rng import children

PROBLEM = plunge.preset("simulation")
# all is known, nothing is noisy; with a wheel that may not change at all, none would be learned
EMPTY = plunge.Uncertainty(burning_sd=0.0, sharpness_change_sd=0.0013, **dict.fromkeys(
    ("sharpness_sd", "deflection_sd", "contact_zero_sd", "size_sd", "power_sd", "threshold_scatter"), 0.0
))  # fmt: skip
KNOWN = PROBLEM.replace(uncertainty=EMPTY)
MODEL, SAMPLE = PROBLEM.model, PROBLEM.sample_time
SHARP = PROBLEM.replace(wear_flat_area=0.9 * 0.026)  # as it is believed to be, 10 % low
PRINTED = {"sparkout": "printed", "roundness_margin": 0.0, "observer_gain": 1.0}
EXACT = {"roundness_margin": 0.0, "observer_gain": 1.0}
WORN = MODEL.replace(wear=plunge.Wear(growth=(0.032 - 0.026) / 0.282))
DRIFT = 2e-4
"""Stock (mm) kept where all is known: the filter lets the sharpness wander.

Derived: 3.7 standard deviations of 2.4e-3 a root of a mm over 0.282 mm are 0.5 % of the area, of which 1 %
is 0.3 um of damage at most. A sharpness that does not wander leaves 1e-6 mm.
"""
nan = math.nan


def run(controller, problem=PROBLEM, rng=0, noise=None, **options):
    return hwsim.run(hwsim.PlungeGrinder(problem, noise=noise, **options), controller, rng=rng)


def became(controller, **options):
    """Outcome of one part, name -> number."""
    return {
        str(name): float(value[0]) for name, value in run(controller, **options).outcome.data_vars.items()
    }


def zero_at(contact_zero):
    """Options of a contact that is late by an offset (mm; negative: early)."""
    for seed in range(20):
        drawn = float(children(seed, 1)[0].spawn(2)[0].standard_normal())
        if drawn * contact_zero > 0:
            return {"rng": seed, "contact_zero_sd": contact_zero / drawn}
    raise AssertionError
