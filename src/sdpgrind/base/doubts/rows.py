"""Rows of doubts: what is believed, what the data say, and the verdict."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.quantities import specs

AGREES, DIFFERS, NOT_TOLD, ASSUMED = "agrees", "differs", "not told", "assumed"
"""The 95 % interval holds the believed value, or not; the data do not determine it; the call assumes it."""
SIGNIFICANT = 0.05  # derived: a chance below it is a believed value outside the 95 % interval
_LOOSE = 1.0  # chosen: standard deviation over the value beyond which not even the sign is known


class Doubt(NamedTuple):
    """One field of the model, or one assumption.

    Attributes
    ----------
    name, unit : str
        Name, and unit of the three numbers.
    believed : float or str
        Value of the problem; or the assumption in words.
    told, low, high : float
        Value from the data and its 95 % interval; NaN: none.
    verdict : str
        "agrees", "differs", "not told" or "assumed".
    chance : float
        Probability of a difference as large by chance, if the believed value is true; NaN: not told.
    note : str
        Assumptions of the value, or the experiment that would determine it.
    """

    name: str
    unit: str
    believed: float | str
    told: float = np.nan
    low: float = np.nan
    high: float = np.nan
    verdict: str = NOT_TOLD
    chance: float = np.nan
    note: str = ""

    @property
    def measured(self) -> bool:
        """Whether the data give an interval."""
        return self.verdict in (AGREES, DIFFERS)


def compared(
    estimate: Any,
    name: str,
    believed: float,
    *,
    note: str = "",
    scale: float = 0.0,
    least: float = -np.inf,
) -> Doubt:
    """Row of a value of an `Estimate`; `scale`: size against which its standard deviation is small or not.

    `least`: value that the quantity cannot be below, where the interval ends.
    """
    k = estimate.names.index(name)
    unit, value, sd = estimate.units[k], float(estimate.value[k]), float(estimate.sd[k])
    if not estimate.ok or not np.isfinite(sd):
        return untold(name, unit, believed, reason(estimate.message))
    low, high = (max(float(end), least) for end in estimate.interval()[k])
    if sd > _LOOSE * max(abs(value), scale):
        return Doubt(name, unit, believed, value, low, high, NOT_TOLD, note=note)
    chance = _chance(
        abs(believed - value) / sd if sd > 0 else np.inf * abs(believed - value), estimate.freedom
    )
    verdict = DIFFERS if chance < SIGNIFICANT else AGREES
    return Doubt(name, unit, believed, value, low, high, verdict, chance, note)


def _chance(off: float, freedom: float) -> float:
    """Probability that Student's t exceeds `off` in magnitude."""
    from scipy.special import ndtr, stdtr

    off = 0.0 if np.isnan(off) else off
    return float(2 * (stdtr(freedom, -off) if np.isfinite(freedom) else ndtr(-off)))


def untold(name: str, unit: str, believed: float | str, note: str = "") -> Doubt:
    """Row of a value that the data do not tell."""
    return Doubt(name, unit, believed, note=note)


def assumed(name: str, words: str, note: str = "") -> Doubt:
    """Row of an assumption of the reader."""
    return Doubt(name, "", words, verdict=ASSUMED, note=note)


def reason(message: str) -> str:
    """Reason of a failed estimate, without its status."""
    return message.removeprefix("not identified: ")


def complete(found: Sequence[Doubt], model: Any, hints: Mapping[str, str]) -> tuple[Doubt, ...]:
    """Rows found, and one for each other number of the model; `hints`: what would tell it."""
    known = {row.name for row in found}
    rest = [untold(*each, hints.get(each[0], "")) for each in numbers(model) if each[0] not in known]
    return (*found, *rest)


def numbers(model: Any) -> list[tuple[str, str, float]]:
    """Name, unit and value of each number of a model and of its parts."""
    found = []
    for name, spec in specs(type(model)).items():
        value = getattr(model, name)
        if spec.kind == "number" and value is not None:
            found.append((name, spec.unit, float(value)))
        elif spec.kind in ("part", "law") and specs(type(value)):
            found += numbers(value)
    return found
