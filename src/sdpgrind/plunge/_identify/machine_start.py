"""Start of the fit of a machine: readings that are used, first values, scales, the air cut."""

from collections.abc import Sequence

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.plunge._identify import contact
from sdpgrind.plunge._identify.cycles import Cycle
from sdpgrind.plunge._identify.machine_fit import ChannelNoise, FittedPart, MachineFit
from sdpgrind.plunge._identify.machine_model import (
    CONTACT,
    FEED_LAG,
    IDLE,
    OFFSET,
    PLOUGHING,
    POWER_LAG,
    RATIO,
    SHARED,
    WEAR,
    MachineModel,
    timeline,
)
from sdpgrind.plunge._identify.sharpness import NEAR, clipped_rows, greatest_power
from sdpgrind.plunge._model.problem import CycleProblem

_SCALES = {WEAR: 0.1, FEED_LAG: 0.1, POWER_LAG: 0.1, CONTACT: 0.1, OFFSET: 0.1}  # chosen: 1, s, s, mm, mm
_LEAST_PLOUGHING = 0.1  # chosen: N/mm; scale where none is believed
_LEAST_IDLE = 0.05  # chosen: scale of the idle power over the greatest power
_EXACT = (1e-7, 1e-6)  # chosen: mm and relative; noise that is assumed where there is none
_TOUCHED = 1e-9  # derived: share of the greatest power above the rounding of the model


def started(each: Sequence[Cycle], problem: CycleProblem, power_max: float | None) -> MachineFit:
    """Return the fit of parts before its first step, with the idle power free."""
    model = MachineModel(problem)
    believed = model.believed(problem.drive)
    first = _first_values(each, problem, believed)
    parts = [_readings(cycle, problem, power_max) for cycle in each]
    first[:, CONTACT] = np.minimum(first[:, CONTACT], [part.latest for part in parts])
    fit = MachineFit(
        model, parts, first, _scales(each, believed), list(range(SHARED)), declared(each, problem)
    )
    aired = air(fit)
    if aired.size:
        fit.values[:, IDLE] = np.median(aired)
    return fit


def air(fit: MachineFit) -> Floats:
    """Return the powers (W) read before contact or before the first feed."""
    found = []
    for each, values, response in zip(fit.parts, fit.values, fit.responses(), strict=True):
        shown = response[:, 1] - values[IDLE]
        touched = np.flatnonzero(shown > _TOUCHED * shown.max())
        before = np.arange(shown.size) < (touched[0] if touched.size else shown.size)
        found.append(each.cycle.grinding_power[each.usable & (before | each.waiting)])
    return np.concatenate(found)


def declared(each: Sequence[Cycle], problem: CycleProblem) -> ChannelNoise:
    """Return the declared noise; where none is declared, that of the steps between readings."""
    doubts = problem.uncertainty
    size = doubts.size_sd or float(np.median([cycle.noise_sd for cycle in each]))
    power = doubts.power_sd or float(np.median([_relative_noise(cycle.grinding_power) for cycle in each]))
    return ChannelNoise((max(size, _EXACT[0]), max(power, _EXACT[1])))


def _relative_noise(power: Floats) -> float:
    """Noise of a power over itself, from second differences."""
    bends = np.abs(np.diff(power, 2)) / power[1:-1]
    bends = bends[np.isfinite(bends)]
    return float(np.median(bends)) / 0.6745 / 6**0.5 if bends.size else 0.0


def _readings(cycle: Cycle, problem: CycleProblem, power_max: float | None) -> FittedPart:
    line = timeline(cycle, problem.drive, problem.sample_time)
    usable = np.isfinite(cycle.grinding_power) & ~clipped_rows(cycle, power_max)
    usable[:1] = False  # of a wheel that is loaded at the start, a monitor may show any share
    return FittedPart(cycle, line, cycle.read, usable, NEAR * greatest_power(cycle, power_max))


def _first_values(each: Sequence[Cycle], problem: CycleProblem, believed: Floats) -> Floats:
    """Believed values, with contact, offset and scale of the deflection from the sizes alone."""
    found = [contact.fitted(cycle, problem.model) for cycle in each]
    values = np.tile(believed, (len(each), 1))
    values[:, RATIO] *= np.median([fit["scale"] for fit in found])
    values[:, CONTACT] = [fit["contact_zero"] for fit in found]
    values[:, OFFSET] = [fit["offset"] for fit in found]
    return values


def _scales(each: Sequence[Cycle], believed: Floats) -> Floats:
    """Changes of the values of equal importance."""
    scales = believed.copy()
    for place, scale in _SCALES.items():
        scales[place] = scale
    most = max(float(np.nanmax(cycle.grinding_power)) for cycle in each)
    scales[PLOUGHING] = max(scales[PLOUGHING], _LEAST_PLOUGHING)
    scales[IDLE] = max(scales[IDLE], _LEAST_IDLE * most)
    return scales
