"""What a controller of plunge cycles knows, and the places of its state."""

from math import exp
from typing import NamedTuple

from sdpgrind.base import checks
from sdpgrind.plunge._model.kernels import PlungeCore
from sdpgrind.plunge._model.problem import CycleProblem

PRINTED, GAUGE, P_END = range(3)
"""How the begin of spark-out is found."""
FULL_RATE, BALANCE, SPARK_OUT, RETRACT = range(1, 5)
"""Sections of a cycle."""
SECTION, RATE, REMAINING, COMMANDED, Y, COMMAND, TARGET, BALANCED, MISSED, STILL, SIZE = range(11)
"""State: v_hat, r_hat, p, deflection beyond ploughing, last command, z*, whether it counts for the slack; of the gauge: readings
that are missing, what should have been ground off (mm) since it moved, and the last reading."""
TOUCHED, SILENT, BLANK, READ, ZERO, SCALE, SHARPNESS, BURNING, COVARIANCE = range(11, 20)
"""Estimated on line: whether the wheel has touched, readings of power that are missing, mean and number of sizes before contact,
contact zero, deflection and wear flat area over those of the model, where burning begins; covariance of deflection, zero, scale
and area."""
STATES = COVARIANCE + 16
NO, YES, BELIEVED = range(3)
"""Whether the wheel has touched; believed: by the command, as power is missing."""
MISSED_MAX = 5
"""Readings of size that are missing one after the other when the part is broken off; of power, when it is done without."""
OUTLYING = 5.0
"""Standard deviations of size that a gauge does not err by."""
TOUCHING = 5.0
"""Standard deviations of power that tell contact."""
DEFLECTION_DRIFT, SHARPNESS_DRIFT = 5e-6, 5e-4
"""What the model may be wrong by in a sample: deflection, mm; wear flat area, relative."""


class SectionLaw(NamedTuple):
    """What a controller knows."""

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
    gain: float  # of the observer of the size, where nothing is estimated on line
    size_sd: float
    power_sd: float  # relative
    zero_sd: float
    scale_sd: float
    sharpness_sd: float  # relative
    growth: float  # of the wear flat area, relative, 1/mm
    staged: bool  # three stages
    rough_rate: float  # of the first, mm/s
    stage_remaining: float  # stock at which the second begins, mm
    stage_rate: float  # and its rate, mm/s


def law_of(problem: CycleProblem, final_rate: float) -> SectionLaw:
    """What every controller of a problem knows; nothing is learned and the gauge is believed."""
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
    """What the compiled core needs of a cycle of three stages, mm and mm/s."""
    law = law_of(problem, final_rate(problem, 0.0))
    return law._replace(staged=True, stage_remaining=float(remaining), stage_rate=float(rate))


def final_rate(problem: CycleProblem, margin: float) -> float:
    model = problem.model
    least = problem.roundness_max - model.roundness_base
    if margin >= least:
        raise checks.refuse("roundness_margin", f"< roundness_max - roundness_base = {least:g}", margin, "mm")
    return float(model.turns * (least - margin) / model.roundness_gain)
