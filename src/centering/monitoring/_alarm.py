"""Alarms of tracked quantities: time and size of a step, advice; units of the quantities."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sdpgrind.base import checks

UNITS = {"stroke_offset": "mm", "mu_kinetic": "1"}
ADVICE = {
    "stroke_offset": "clean the locating faces and look for a shifted pusher, probe or zero",
    "mu_kinetic": "ask whether material or lubricant changed, and clean the table",
}


@dataclass(frozen=True, repr=False)
class DriftAlarm:
    """Step of a tracked quantity, which is not watched from its part on until acknowledged.

    Attributes
    ----------
    quantity : str
        Name.
    unit : str
        Unit.
    part : int
        Number of the part of the alarm; the first is 0.
    since : int
        Most likely first part of the step.
    size, size_sd : float
        Size of the step and its standard deviation, in its unit.
    """

    quantity: str
    unit: str
    part: int
    since: int
    size: float
    size_sd: float

    @property
    def upward(self) -> bool:
        """Whether the quantity (in its unit) has grown."""
        return self.size > 0

    @property
    def advice(self) -> str:
        """Advice; dimensionless words."""
        return ADVICE.get(self.quantity, "look for what changed")

    @property
    def unwatched(self) -> str:
        """Begin and end of the time without watching; dimensionless words."""
        return f"not watched since part {self.part}; acknowledge() goes on"

    def __str__(self) -> str:
        way = "up" if self.upward else "down"
        size = f"{abs(self.size):.3g} ± {self.size_sd:.2g}{with_space(self.unit)}"
        name = self.quantity.replace("_", " ")
        noticed = f"noticed at part {self.part}" if self.part > self.since else "by one reading so far"
        told = f"{name} stepped {way} by {size} since part {self.since}, {noticed}: {self.advice}"
        return f"{told} ({self.unwatched})"

    def __repr__(self) -> str:
        return f"DriftAlarm({self})"


def units_of(names: Iterable[str], units: Mapping[str, str] | None) -> dict[str, str]:
    """Units of quantities: given, else that of `UNITS`, else mm."""
    known = {name: UNITS.get(name, "mm") for name in names}
    if not isinstance(units, Mapping | None):
        raise TypeError(f"units must be a mapping of names to units; got {checks.shown(units)}")
    given = {checks.one_of("units", name, known): unit for name, unit in (units or {}).items()}
    return known | {name: checks.kind(f"units[{name!r}]", unit, str) for name, unit in given.items()}


def with_space(unit: str) -> str:
    """Unit as it follows a number."""
    return "" if unit in ("", "1") else f" {unit}"


class Innovation(NamedTuple):
    """Standardised innovation of a filter: part, innovation over `spread`, its sd for noise of sd 1."""

    part: int
    value: float
    spread: float


class DriftStep(NamedTuple):
    """Most likely step in a row of innovations: part, size, sd of the size for noise of sd 1."""

    since: int
    size: float
    size_sd: float


def likely_step(innovations: Sequence[Innovation], side: int) -> DriftStep:
    """Step to one side that explains a row of innovations best (least squares).

    A step makes innovations that fade by ``1 - gain = 1/spread^2`` per reading; one at part j explains
    (s'u)^2/(s's) of the sum of squares, with s the fading row from j on.
    """
    found, most = DriftStep(innovations[-1].part, 0.0, np.inf), -np.inf
    values = np.array([innovation.value for innovation in innovations])
    spreads = np.array([innovation.spread for innovation in innovations])
    for j, innovation in enumerate(innovations):
        fading = np.concatenate([[1.0], np.cumprod(spreads[j:-1] ** -2.0)]) / spreads[j:]
        square, along = float(fading @ fading), float(fading @ values[j:])
        if side * along > 0 and along**2 / square > most:
            found, most = DriftStep(innovation.part, along / square, square**-0.5), along**2 / square
    return found
