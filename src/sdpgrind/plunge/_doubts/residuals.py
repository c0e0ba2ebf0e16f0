"""What residuals and readings tell: noise, step, clipping, bends, and which law of the lag fits."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sdpgrind.base import serial
from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts import gauge
from sdpgrind.base.doubts.alignment import Alignment
from sdpgrind.base.doubts.words import amount, in_one_unit, share
from sdpgrind.plunge._doubts.lag import LagFit
from sdpgrind.plunge._identify import contact
from sdpgrind.plunge._identify.cycles import Cycle
from sdpgrind.plunge._identify.preference import preferred_law
from sdpgrind.plunge._model.problem import CycleProblem

LINEAR, MODEL = "a linear lag", "the deflection of the model"
FITTED = 3  # derived: contact zero, scale or time constant, offset or first deflection
"""Values fitted in a part."""


class Deflected(NamedTuple):
    """Residuals of the deflection of the model: standard deviation (mm), correlation of neighbours.

    For each part times (s) and residuals (mm); mean scale of the deflection, unit 1.
    """

    noise_sd: float
    correlation: float
    times: tuple[Floats, ...]
    residuals: tuple[Floats, ...]
    scale: float


def of_model(problem: CycleProblem, each: Sequence[Cycle]) -> Deflected | None:
    """Residuals of the model's deflection, scaled for each part; None: its lag is linear."""
    if problem.model.linear_time_constant is not None or not each:
        return None
    times = tuple(cycle.time[cycle.read] for cycle in each)
    values = [contact.fitted(cycle, problem.model).value for cycle in each]
    left = tuple(contact.residual(cycle, problem.model, v) for cycle, v in zip(each, values, strict=True))
    square, count = sum(float(e @ e) for e in left), sum(e.size - FITTED for e in left)
    alike = [serial.correlation(e, FITTED, serial.gaps(t, t.size)) for t, e in zip(times, left, strict=True)]
    scale = float(np.mean([value[1] for value in values]))
    return Deflected(float(np.sqrt(square / max(count, 1))), float(np.mean(alike)), times, left, scale)


def law_of(fit: LagFit, deflected: Deflected) -> Alignment:
    """`LINEAR` or `MODEL`: the law that the sizes prefer; residuals filtered as those of the better one."""
    rho = deflected.correlation if deflected.noise_sd < fit.noise_sd else fit.correlation
    bent = [
        e[np.isin(at, t)] for t, at, e in zip(fit.times, deflected.times, deflected.residuals, strict=True)
    ]
    return preferred_law({LINEAR: fit.residuals, MODEL: bent}, fit.sizes, fit.times, rho, FITTED)


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
    found = [_bend(each, fit, rho), _laws(fit, deflected)]
    return [sentence for sentence in found if sentence]


def _laws(fit: LagFit, deflected: Deflected | None) -> str:
    """Sentence where a linear lag fits the sizes better than the deflection of the model, or as well."""
    if deflected is None:
        return ""
    found, on = law_of(fit, deflected), "contact_zero, normal_force_ratio and wear_flat_area"
    if not found.sure:
        return (
            f"The sizes do not tell {MODEL} from {LINEAR} (the sum of squared residuals differs by"
            f" {share(found.excess)}, and {share(found.needed)} would decide): {on} hold with {MODEL} alone."
        )
    if found.best == MODEL:
        return ""
    linear, model = in_one_unit((fit.noise_sd, deflected.noise_sd), "mm")
    return (
        f"A linear lag fits the sizes better than {MODEL} (sd of the residuals {linear} against {model}, sum"
        f" of squares {share(found.excess)} larger, {share(found.needed)} would decide), on which {on} rest:"
        " the data do not tell these."
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
