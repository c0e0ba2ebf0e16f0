"""What residuals and readings tell: noise, step, clipping, bends, and which law of the lag fits."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sdpgrind.base import serial
from sdpgrind.base.doubts import gauge
from sdpgrind.base.doubts.words import amount, in_one_unit
from sdpgrind.plunge._doubts.lag import LagFit
from sdpgrind.plunge._identify import contact
from sdpgrind.plunge._identify.cycles import Cycle
from sdpgrind.plunge._model.problem import CycleProblem

_WORSE = 1.2  # chosen: ratio of residuals; noise of 100 readings alone makes 1.1
_FITTED = 3  # derived: contact zero, scale and offset of the gauge


class Deflected(NamedTuple):
    """Residuals of the deflection of the model: standard deviation (mm), correlation of neighbours."""

    noise_sd: float
    correlation: float


def of_model(problem: CycleProblem, each: Sequence[Cycle]) -> Deflected | None:
    """Residuals of the model's deflection, scaled for each part; None: its lag is linear."""
    if problem.model.linear_time_constant is not None or not each:
        return None
    square, count, alike = 0.0, 0, []
    for cycle in each:
        values = contact.fitted(cycle, problem.model).value
        left = contact.residual(cycle, problem.model, values)
        square, count = square + float(left @ left), count + left.size - _FITTED
        alike.append(serial.correlation(left, _FITTED, serial.gaps(cycle.time[cycle.read], left.size)))
    return Deflected(float(np.sqrt(square / max(count, 1))), float(np.mean(alike)))


def of_readings(each: Sequence[Cycle], fit: LagFit, deflected: Deflected | None) -> list[str]:
    """Sentences on noise and step of the gauge, and on clipped powers."""
    best = deflected or fit
    size = np.concatenate([cycle.size[cycle.read] for cycle in each])
    power = np.concatenate([cycle.grinding_power for cycle in each])
    found = [gauge.noise_sentence("size", "mm", best.noise_sd, best.correlation, size)]
    found.append(gauge.clipped_sentence("grinding_power", "W", power))
    return [sentence for sentence in found if sentence]


def of_models(each: Sequence[Cycle], fit: LagFit, deflected: Deflected | None) -> list[str]:
    """Sentences on where the linear lag bends, and on which law fits the sizes."""
    noise = deflected or fit
    rho = noise.correlation if noise.noise_sd < fit.noise_sd else fit.correlation  # a bend is no noise
    found = [_bend(each, fit, rho), misfit(fit, deflected)]
    return [sentence for sentence in found if sentence]


def misfit(fit: LagFit, deflected: Deflected | None) -> str:
    """Sentence where the linear lag fits the sizes better than the deflection of the model; else empty."""
    if deflected is None or deflected.noise_sd <= _WORSE * fit.noise_sd:
        return ""
    linear, model = in_one_unit((fit.noise_sd, deflected.noise_sd), "mm")
    return (
        "A linear lag fits the sizes better than the deflection of the model (sd of the residuals"
        f" {linear} against {model}), on which contact_zero, normal_force_ratio and wear_flat_area rest: the"
        " data do not tell these."
    )


def _bend(each: Sequence[Cycle], fit: LagFit, rho: float) -> str:
    """Sentence on the first part whose residuals bend."""
    for cycle, time, left in zip(each, fit.times, fit.residuals, strict=True):
        if found := gauge.bend(left, time, rho):
            begin, end = time[found.first], time[found.last]
            rate = float(cycle.command_rate[(cycle.time >= begin) & (cycle.time <= end)].mean())
            where = f"from {begin:.1f} to {end:.1f} s{f' of {cycle.label}' if cycle.label else ''}"
            return (
                f"A linear lag does not fit all rates: {where} (command {amount(rate, 'mm/s')}) its residuals"
                f" average {amount(found.mean, 'mm')}. Its time constant depends on the infeed rate."
            )
    return ""
