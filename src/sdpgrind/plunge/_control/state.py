"""Parameters of the plunge controllers and the layout of their state."""

from math import exp
from typing import NamedTuple

from sdpgrind.base import checks
from sdpgrind.plunge._model.kernels import PlungeCore
from sdpgrind.plunge._model.problem import CycleProblem

PRINTED, GAUGE, P_END = range(3)  # begin of spark-out
FULL_RATE, BALANCE, SPARK_OUT, RETRACT = range(1, 5)  # sections of a cycle
# State: section, v_hat, r_hat, commanded infeed p, deflection beyond ploughing, last command, z*, whether
# the sample counts for the slack; rejected sizes in a row, stock removed by the model since the size changed
# (mm), last size.
SECTION, RATE, REMAINING, COMMANDED, Y, COMMAND, TARGET, BALANCED, MISSED, FROZEN, SIZE = range(11)
# Estimated online: contact, missing powers in a row, mean and number of sizes before contact, contact zero,
# deflection and wear flat area over the model, burn rate; 4 x 4 covariance of deflection, zero, scale, area.
TOUCHED, UNPOWERED, SIZE_OFFSET, READ, ZERO, SCALE, SHARPNESS, BURNING, COVARIANCE = range(11, 20)
STATES = COVARIANCE + 16
NO, YES, BELIEVED = range(3)  # contact; BELIEVED: by the command, as power is missing
MISSED_MAX = 5  # chosen: rejected sizes in a row that end the part; missing powers before contact is assumed
OUTLYING = 5.0  # chosen: standard deviations; rejects one good Gaussian size in 1.7 million
TOUCHING = 5.0  # chosen: standard deviations of power that show contact
# chosen: process noise per sample of deflection, mm, and wear flat area, relative; 0 would stop the learning
DEFLECTION_DRIFT, SHARPNESS_DRIFT = 5e-6, 5e-4


class SectionLaw(NamedTuple):
    """Parameters of a controller's compiled core."""

    core: PlungeCore
    form: int
    no_burn: bool
    online: bool
    sample_time: float
    stock: float
    safety_margin: float
    rate_max: float
    final_rate: float
    burn_rate: float
    pole: float
    time_constant: float
    gain: float  # of the size observer, without online estimation
    size_sd: float
    power_sd: float  # relative
    zero_sd: float
    scale_sd: float
    sharpness_sd: float  # relative
    growth: float  # of the wear flat area, relative, 1/mm
    staged: bool  # stages of constant rate in place of the balance
    rough_rate: float  # of the first, mm/s
    stage_remaining: float  # stock at which the second stage begins, mm
    stage_rate: float  # of the second, mm/s


def law_of(problem: CycleProblem, final_rate: float) -> SectionLaw:
    """Parameters common to all controllers of a problem: no online estimation, the gauge is exact."""
    assert problem.time_constant is not None
    return SectionLaw(
        core=problem.model.core,
        form=P_END,
        no_burn=False,
        online=False,
        sample_time=float(problem.sample_time),
        stock=float(problem.stock),
        safety_margin=0.0,
        rate_max=float(problem.command_rate_max),
        final_rate=final_rate,
        burn_rate=float(min(problem.model.burn_rate, problem.command_rate_max)),
        pole=exp(-problem.sample_time / problem.time_constant),
        time_constant=float(problem.time_constant),
        gain=1.0,
        size_sd=0.0,
        power_sd=0.0,
        zero_sd=0.0,
        scale_sd=0.0,
        sharpness_sd=0.0,
        growth=0.0,
        staged=False,
        rough_rate=float(problem.command_rate_max),
        stage_remaining=0.0,
        stage_rate=0.0,
    )


def staged_law(problem: CycleProblem, remaining: float, rate: float) -> SectionLaw:
    """Parameters of a cycle of three stages: switching stock (mm) and stage rate (mm/s)."""
    law = law_of(problem, final_rate(problem, 0.0))
    return law._replace(staged=True, stage_remaining=float(remaining), stage_rate=float(rate))


def final_rate(problem: CycleProblem, margin: float) -> float:
    """Infeed rate (mm/s) at an out-of-roundness `margin` (mm) below its limit; raises ValueError."""
    model = problem.model
    least = problem.roundness_max - model.roundness_base
    if margin >= least:
        raise checks.refuse("roundness_margin", f"< roundness_max - roundness_base = {least:g}", margin, "mm")
    return float(model.turns * (least - margin) / model.roundness_gain)
