"""Alignment of the commands of a plunge cycle: the law of the lag is fitted to each, the residuals compared.

A law that does not fit would tell the alignment that hides its misfit: a linear lag that bends tells none.
"""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sdpgrind.base import serial
from sdpgrind.base.columns.commands import ALIGNMENTS, read_as
from sdpgrind.base.doubts import gauge
from sdpgrind.base.doubts.alignment import NOT_SURE, Alignment
from sdpgrind.plunge._doubts.lag import LagFit, LagPart, fitted
from sdpgrind.plunge._doubts.residuals import FITTED, Deflected, of_model
from sdpgrind.plunge._identify import time_constant
from sdpgrind.plunge._identify.cycles import MOVING, Cycle
from sdpgrind.plunge._identify.preference import preferred_law
from sdpgrind.plunge._model.problem import CycleProblem
from sdpgrind.plunge._model.time_constants import of_deflection

_AIR = 2.0  # chosen: ratio of variances that noise alone does not reach, and an approach of 3 um does
_STRAIGHT = 48  # measured: readings over which a misfit of the lag is a line
_CLEAR = 1.0  # chosen: excess of the second-best sum of squares that no misfit of a lag hides
_EXACT = 1e-9  # chosen: noise over travel below which residuals are rounding


class Aligned(NamedTuple):
    """Preferred alignment, the fit of the commands as they were read, and the time constant (s) of each."""

    alignment: Alignment
    fit: LagFit
    time_constants: dict[str, float]


def of_cycles(cycles: Sequence[Cycle], commands_at: str = "begin") -> Aligned:
    """Alignment preferred by the sizes of all parts; residuals filtered by the correlation of the best."""
    parts = [_in_contact(cycle) for cycle in cycles]
    given = {each: [_read_as(part, commands_at, each) for part in parts] for each in ALIGNMENTS}
    raw = {each: fitted(courses, 0.0) for each, courses in given.items()}
    best = min(raw.values(), key=lambda fit: fit.square)
    rho = best.correlation if best.noise_sd > _EXACT * best.travel else 0.0
    white = {each: fitted(courses, rho) for each, courses in given.items()} if rho > 0 else raw
    left = {each: fit.residuals for each, fit in white.items()}
    taus = {each: fit.time_constant for each, fit in raw.items()}
    found = preferred_law(left, best.sizes, best.times, rho, FITTED)
    if found.excess < _CLEAR and _bent(best):
        found = found._replace(preferred=NOT_SURE)
    return Aligned(found, white[commands_at], taus)


def by_model(
    aligned: Aligned, cycles: Sequence[Cycle], commands_at: str, problem: CycleProblem, deflected: Deflected
) -> Aligned:
    """Alignment preferred where the deflection of the model is the law; `deflected`: as they were read."""
    fits = {commands_at: deflected}
    for each in ALIGNMENTS:
        courses = [_commanded(cycle, commands_at, each) for cycle in cycles]
        fits[each] = fits.get(each) or of_model(problem, courses) or deflected
    rho = min(fits.values(), key=lambda fit: fit.noise_sd).correlation
    left = {each: fits[each].residuals for each in ALIGNMENTS}
    taus = {each: fits[each].scale * of_deflection(problem) for each in ALIGNMENTS}
    sizes = [cycle.size[cycle.read] for cycle in cycles]
    found = preferred_law(left, sizes, deflected.times, rho, FITTED)
    return aligned._replace(alignment=found, time_constants=taus)


def _commanded(cycle: Cycle, commands_at: str, alignment: str) -> Cycle:
    return dataclasses.replace(cycle, command_rate=read_as(cycle.command_rate, commands_at, alignment))


def _bent(fit: LagFit) -> bool:
    """Whether the residuals of a linear lag bend in a part: of the correlation about local lines, or less."""
    rho = fit.correlation
    return any(
        left.size >= 2 * _STRAIGHT
        and gauge.bend(left, time, min(rho, serial.local_correlation(left, _STRAIGHT))) is not None
        for time, left in zip(fit.times, fit.residuals, strict=True)
    )


def _read_as(part: LagPart, commands_at: str, alignment: str) -> LagPart:
    return part._replace(command_rate=read_as(part.command_rate, commands_at, alignment))


def _in_contact(cycle: Cycle) -> LagPart:
    """All rows; those from where the size moves, or from contact, if the lag fits these far better."""
    kept = LagPart(cycle.time, cycle.command_rate, cycle.size)
    for first in (_moving(cycle), _touching(cycle)):
        later = LagPart(cycle.time[first:], cycle.command_rate[first:], cycle.size[first:])
        enough = np.isfinite(later.size).sum() >= MOVING
        if enough and later.time[0] > kept.time[0] and _variance(kept) > _AIR * _variance(later):
            kept = later
    return kept


def _moving(cycle: Cycle) -> int:
    """Row before the first moving size."""
    return max(int(np.argmax(cycle.moving)) - 1, 0)


def _touching(cycle: Cycle) -> int:
    """Row at contact, also where noise feigns a moving size in the air."""
    return int(np.argmax(cycle.infeed >= time_constant.fit(cycle).value[2]))


def _variance(course: LagPart) -> float:
    fit = fitted([course], 0.0)
    return fit.square / fit.readings
