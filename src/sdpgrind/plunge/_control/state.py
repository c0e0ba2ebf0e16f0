"""Parameters of the plunge controllers, the layout of their state, and what is reported of it."""

from collections.abc import Mapping
from math import exp

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.states import floats, record
from sdpgrind.plunge._control.filter_state import FILTER
from sdpgrind.plunge._model.problem import CycleProblem

PRINTED, STAGED, ENVELOPE = range(3)  # the printed cycle, stages of constant rate, the safe position
FULL_RATE, BALANCE, SPARK_OUT, RETRACT = range(1, 5)  # sections of a cycle
# Section, v_hat, r_hat, commanded infeed p, deflection beyond ploughing, last command, whether the sample
# counts for the slack; rejected sizes in a row, stock removed since the size changed (mm), last size.
SECTION, RATE, REMAINING, COMMANDED, Y, COMMAND, BALANCED, MISSED, FROZEN, SIZE = range(10)
# Contact, missing powers in a row, mean and number of sizes before contact, sizes in a row that grow without
# power; contact zero, deflection and wear flat area over the model as estimated, whether no infeed rate keeps
# the confidence at size. Then the filter of the part.
TOUCHED, UNPOWERED, SIZE_OFFSET, READ, GROWN, ZERO, SCALE, SHARPNESS, SATURATED, FILTERED = range(10, 20)
STATES = FILTERED + FILTER.itemsize // 8
NO, YES, BELIEVED = range(3)  # contact; BELIEVED: by the command, as power is missing
MISSED_MAX = 5  # chosen: rejected sizes in a row that end the part; missing powers before contact is assumed
OUTLYING = 5.0  # chosen: standard deviations; rejects one good Gaussian size in 1.7 million
TOUCHING = 5.0  # chosen: standard deviations of power that show contact

REPORTS: Mapping[str, str] = {
    "section": "",
    "infeed_rate": "mm/s",
    "remaining": "mm",
    "wear_flat_area": "",
    "contact_zero": "mm",
    "deflection_scale": "",
    "saturated": "",
}  # name -> unit, in the order of `SampledCycle.report` and of the table of a simulated part


# Parameters of a controller's compiled core: coefficients of the model (`PlungeCore`), flags, settings.
LAW = record(
    "K0 mm, K1 s, K2 mm (s/mm)^p, p 1, heat0 (mm/s)^0.25, heat1 (s/mm)^0.75, heat2 (mm/s)^(0.25 - p),"
    " reach mm (s/mm)^0.25, power0 W, power1 W s/mm, power2 W (s/mm)^p, form 1, no_burn 1, online 1,"
    " sample_time s, stock mm, safety_margin mm, rate_max mm/s, final_rate mm/s, burn_rate mm/s, pole 1,"
    " time_constant s, gain 1, size_sd mm, power_sd 1, zero_sd mm, scale_sd 1, sharpness_sd 1, growth 1/mm,"
    " rough_rate mm/s, stage_remaining mm, stage_rate mm/s,"
    " k_static 1, k_filter 1, burning_sd 1, diffusivity_sd 1, gain_sd 1, wheel_wear 1, wear_sd 1,"
    " coolest_rate mm/s, sharpness_walk 1/mm, feed_lag s, feed_delay 1, power_lag s, power_pole 1,"
    " idle_power W"
)


def law_of(problem: CycleProblem, final_rate: float, **settings: float) -> Floats:
    """Row of `LAW` for a controller. Default: the printed cycle, exact gauge, no margin."""
    assert problem.time_constant is not None
    values = problem.model.core._asdict() | {
        "form": PRINTED,
        "sample_time": problem.sample_time,
        "stock": problem.stock,
        "rate_max": problem.command_rate_max,
        "final_rate": final_rate,
        "burn_rate": min(problem.model.burn_rate, problem.command_rate_max),
        "pole": exp(-problem.sample_time / problem.time_constant),
        "time_constant": problem.time_constant,
        "gain": 1.0,
        "rough_rate": problem.command_rate_max,
    }
    law = floats(LAW)
    row = law.view(LAW)
    for name, value in (values | settings).items():
        row[name] = value
    return law


def staged_law(problem: CycleProblem, remaining: float, rate: float, **settings: float) -> Floats:
    """Row of `LAW` for three stages: switching stock (mm) and stage rate (mm/s)."""
    wear = problem.model.wheel_wear
    stages = {"form": STAGED, "stage_remaining": remaining, "stage_rate": rate, "wheel_wear": wear}
    return law_of(problem, **({"final_rate": final_rate(problem, 0.0)} | stages | settings))


def final_rate(problem: CycleProblem, margin: float) -> float:
    """Infeed rate (mm/s) at an out-of-roundness `margin` (mm) below its limit; raises ValueError."""
    model = problem.model
    least = problem.roundness_max - model.roundness_base
    if margin >= least:
        raise checks.refuse("roundness_margin", f"< roundness_max - roundness_base = {least:g}", margin, "mm")
    return float(model.turns * (least - margin) / model.roundness_gain)
