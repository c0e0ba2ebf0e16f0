"""Wear flat area of the wheel from the power: what is left of it after chips and ploughing, Dong (6)."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sdpgrind import identify as idf
from sdpgrind.base.checks import Floats
from sdpgrind.plunge._contact import course, fitted
from sdpgrind.plunge._model import PlungeModel
from sdpgrind.plunge._problem import CycleProblem
from sdpgrind.plunge._records import MOVING, Cycle, fault, not_identified

Mask: TypeAlias = npt.NDArray[np.bool_]
NAME, UNIT = "wear_flat_area", "1"
SLIDING = 0.25
"""Least share of sliding in the power of a sample that is used."""
CLIPPED = 0.99
"""Of the greatest power that a monitor shows: from there on a reading says nothing."""
_NEAR = 0.95  # and a sample whose power is expected above this share may have been cut
_PLATEAU = 3  # equal readings of the greatest power, by which a clipping monitor is known
_LEAST, _MOST = 1e-6, 1.0


def wear_flat_area(cycle: Cycle, problem: CycleProblem, power_max: float | None) -> idf.Estimate:
    """Mean over the samples in which sliding matters, at the rates that the model has; size, where read, corrects them."""
    clipped = _clipped(cycle.grinding_power, power_max)
    top = float(np.min(cycle.grinding_power[clipped], initial=np.inf)) if power_max is None else power_max
    model, usable = problem.model, np.isfinite(cycle.grinding_power) & ~clipped
    if not np.any(usable):
        few = f"all {int(clipped.sum())} readings of the power are clipped" if np.any(clipped) else "there is no power"
        return not_identified(NAME, UNIT, few)
    area, each = model.wear_flat_area, np.empty(0)
    corrected = bool(np.any(cycle.read)) and not fault(cycle)
    for _ in range(20):
        trial = model.replace(wear_flat_area=float(np.clip(area, _LEAST, _MOST)))
        rate = course(cycle, trial, *(fitted(cycle, trial).value if corrected else ())).infeed_rate
        each = samples(cycle, trial, rate, usable, _NEAR * top)
        if each.size < MOVING:
            few = f"{each.size} readings of a power that slides and is not clipped are too few: {MOVING} are needed"
            return not_identified(NAME, UNIT, few)
        before, area = area, float(each.mean())
        if abs(area - before) <= 1e-5 * abs(area):
            break
    if not _LEAST < area <= _MOST:
        return not_identified(NAME, UNIT, f"the power means a wear flat area of {area:.3g}: look for a wrong zero or unit")
    return idf.Estimate((NAME,), np.array([area]), np.full((1, 1), _of_mean(each)), units=(UNIT,), freedom=each.size - 1.0)


def samples(cycle: Cycle, model: PlungeModel, rate: Floats, usable: Mask, most: float) -> Floats:
    """Wear flat area of each sample in which sliding is expected to be a quarter of the power, and the power below `most`."""
    depth = model.depth_of_cut(rate)
    wheel = {"work_speed": model.work_speed, "wheel_speed": model.wheel_speed, "equivalent_diameter": model.equivalent_diameter}
    expected = model.grinding_power(rate)
    rest = model.power.power(depth_of_cut=depth, **wheel, wear_flat_area=0.0, width=model.width)
    used = usable & (rate > 0) & (expected - rest > SLIDING * expected) & (expected < most)
    full = model.power.power(depth_of_cut=depth[used], **wheel, wear_flat_area=1.0, width=model.width) - rest[used]
    return np.asarray((cycle.grinding_power[used] - rest[used]) / full)


def _clipped(power: Floats, power_max: float | None) -> Mask:
    """Readings that the monitor cut: near its greatest power, or on the plateau that it leaves."""
    if power_max is not None:
        return power >= CLIPPED * power_max
    read = power[np.isfinite(power)]
    if not read.size or np.sum(read == read.max()) < _PLATEAU:
        return np.zeros(power.shape, dtype=bool)
    return power >= CLIPPED * float(read.max())


def _of_mean(each: Floats) -> float:
    """Variance of a mean whose samples resemble their neighbours."""
    off = each - each.mean()
    square = float(off @ off)
    alike = min(max(float(off[1:] @ off[:-1]) / square, 0.0), 0.95) if square > 0 else 0.0
    return square / (each.size - 1) / each.size * (1 + alike) / (1 - alike)
