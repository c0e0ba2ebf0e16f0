"""Alignment of the commands of a plunge cycle: a linear lag is fitted to each, the residuals compared."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sdpgrind.base.columns.commands import ALIGNMENTS, read_as
from sdpgrind.base.doubts.alignment import Alignment, preferred
from sdpgrind.plunge._doubts.lag import LagFit, LagPart, fitted
from sdpgrind.plunge._identify import time_constant
from sdpgrind.plunge._identify.cycles import MOVING, Cycle

_AIR = 2.0  # chosen: ratio of variances that noise alone does not reach, and an approach of 3 um does
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
    squares = {each: fit.square for each, fit in white.items()}
    taus = {each: fit.time_constant for each, fit in raw.items()}
    return Aligned(preferred(squares, white[commands_at].readings), white[commands_at], taus)


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
