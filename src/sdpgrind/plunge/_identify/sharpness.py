"""Wear flat area from the power that remains after chips and ploughing: Dong (6)."""

import dataclasses
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sdpgrind import identify as idf
from sdpgrind.base.checks import Floats
from sdpgrind.plunge._identify.contact import course, fitted
from sdpgrind.plunge._identify.cycles import MOVING, Cycle, another_part, concluded, fault, not_identified
from sdpgrind.plunge._model.model import PlungeModel
from sdpgrind.plunge._model.problem import CycleProblem

Mask: TypeAlias = npt.NDArray[np.bool_]
NAME, UNIT = "wear_flat_area", "1"
SLIDING = 0.25  # chosen: least share of sliding in the power of a sample; less amplifies errors of the rest
CLIPPED = 0.99  # chosen: share of the greatest power from which a reading counts as clipped
NEAR = 0.95  # chosen: share of the greatest power above which the expected power may be clipped
_FIT_STEPS = [1e-4, 1e-3]  # chosen: steps of the differences by contact zero, mm, and scale
_PLATEAU = 3  # chosen: equal readings of the greatest power that show a clipping monitor
_SETTLED = 0.02  # chosen: change, in standard deviations, below which rounds of rates and areas end
_ROUNDS = 20  # chosen: rounds of rates and areas at most; more cost time where they never settle
_LEAST, _MOST = 1e-6, 1.0  # chosen: range of the wear flat area


def wear_flat_area(cycle: Cycle, problem: CycleProblem, power_max: float | None) -> idf.Estimate:
    """Mean wear flat area over samples with enough sliding, at the rates of the model corrected by size.

    With wear in the model: the area at the start of the part.
    """
    if others := another_part(cycle):
        return not_identified(NAME, UNIT, others)
    clipped, idle = clipped_rows(cycle, power_max), problem.drive.idle_power
    top = greatest_power(cycle, power_max) - idle
    cycle = dataclasses.replace(cycle, grinding_power=cycle.grinding_power - idle)
    model, usable = problem.model, np.isfinite(cycle.grinding_power) & ~clipped
    if not np.any(usable):
        count = int(clipped.sum())
        few = f"all {count} readings of the power are clipped" if count else "there is no power"
        return not_identified(NAME, UNIT, few)
    corrected = bool(np.any(cycle.read)) and not fault(cycle)
    trial, fit, each, grown = _settled(cycle, model, usable, NEAR * top, corrected)
    if each.size < MOVING:
        held = f"{each.size} of {np.isfinite(cycle.grinding_power).sum()} readings of grinding_power"
        wanted = f"are unclipped with {100 * SLIDING:.0f} % or more of sliding; {MOVING} are needed"
        return not_identified(NAME, UNIT, f"{held} {wanted}")
    first = each - grown
    if not _LEAST < first.mean() <= _MOST:
        few = f"the power means a wear flat area of {first.mean():.3g}: look for a wrong zero or unit"
        return not_identified(NAME, UNIT, few)
    variance = _of_mean(first)
    if fit:
        slope = np.array(
            [_change(cycle, trial, fit, step, usable, NEAR * top) for step in np.diag(_FIT_STEPS)]
        )
        variance += float(slope @ fit.covariance[:2, :2] @ slope)
    found = idf.Estimate(
        (NAME,), first.mean(keepdims=True), np.full((1, 1), variance), units=(UNIT,), freedom=first.size - 1.0
    )
    return concluded(found, "the power says too little of it")


def _settled(
    cycle: Cycle, model: PlungeModel, usable: Mask, most: float, corrected: bool
) -> tuple[PlungeModel, idf.Estimate | None, Floats, Floats]:
    """Model, its fit of the size, areas of the samples and their growth, once rates and areas agree.

    Areas follow from rates, and rates from the area of the model. Fewer than `MOVING` samples end it, too.
    """
    before, mean = np.inf, model.wear_flat_area
    for _ in range(_ROUNDS):
        trial = model.replace(wear_flat_area=float(np.clip(mean, _LEAST, _MOST)))
        fit = fitted(cycle, trial) if corrected else None
        rate = course(cycle, trial, *(fit.value[:2] if fit else ())).infeed_rate
        each, grown = samples(cycle, trial, rate, usable, most)
        if each.size < MOVING:
            break
        earlier, before, mean = before, mean, float(each.mean())
        change = min(abs(mean - before), abs(mean - earlier))  # a sample at a limit may come and go
        if change <= max(_SETTLED * _of_mean(each) ** 0.5, 1e-5 * abs(mean)):
            break
    return trial, fit, each, grown


def _change(
    cycle: Cycle, model: PlungeModel, fit: idf.Estimate, step: Floats, usable: Mask, most: float
) -> float:
    """Derivative of the mean area by contact zero or scale."""
    low, high = (
        samples(cycle, model, course(cycle, model, *at).infeed_rate, usable, most)
        for at in (fit.value[:2] - step, fit.value[:2] + step)
    )
    return float((high[0].mean() - low[0].mean()) / (2 * step.sum())) if low[0].size and high[0].size else 0.0


def samples(
    cycle: Cycle, model: PlungeModel, rate: Floats, usable: Mask, most: float
) -> tuple[Floats, Floats]:
    """Wear flat area of each sample with enough sliding and power below `most`; growth since the start."""
    depth = model.depth_of_cut(rate)
    wheel = {
        "work_speed": model.work_speed,
        "wheel_speed": model.wheel_speed,
        "equivalent_diameter": model.equivalent_diameter,
    }
    expected = model.grinding_power(rate)
    rest = model.power.power(depth_of_cut=depth, **wheel, wear_flat_area=0.0, width=model.width)
    used = usable & (rate > 0) & (expected - rest > SLIDING * expected) & (expected < most)
    worn = model.power.power(depth_of_cut=depth[used], **wheel, wear_flat_area=1.0, width=model.width)
    full = worn - rest[used]
    growth = np.zeros(rate.size)
    if model.wear is not None:
        growth[1:] = np.cumsum(model.wear.rate(0.5 * (rate[1:] + rate[:-1])) * cycle.step)
    return (cycle.grinding_power[used] - rest[used]) / full, growth[used]


def clipped_rows(cycle: Cycle, power_max: float | None) -> Mask:
    """Return the readings that the monitor clipped: flagged, near its greatest power, or on its plateau."""
    power, flagged = cycle.grinding_power, cycle.power_saturated > 0
    if power_max is not None:
        return (power >= CLIPPED * power_max) | flagged
    read = power[np.isfinite(power)]
    if not read.size or np.sum(read == read.max()) < _PLATEAU:
        return flagged
    return (power >= CLIPPED * float(read.max())) | flagged


def greatest_power(cycle: Cycle, power_max: float | None) -> float:
    """Return the power that the monitor can show, W; inf: none was clipped."""
    if power_max is not None:
        return power_max
    return float(np.min(cycle.grinding_power[clipped_rows(cycle, None)], initial=np.inf))


def _of_mean(each: Floats) -> float:
    """Variance of the mean of autocorrelated samples."""
    off = each - each.mean()
    square = float(off @ off)
    alike = min(max(float(off[1:] @ off[:-1]) / square, 0.0), 0.95) if square > 0 else 0.0
    return square / (each.size - 1) / each.size * (1 + alike) / (1 - alike)
