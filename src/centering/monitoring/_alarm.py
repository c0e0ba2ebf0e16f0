"""What a track says when a quantity has stepped: which, since when, by how much, where to look; units of what is tracked."""

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
    """A step of a tracked quantity, as it was told at its part: from there on the quantity is not watched until acknowledged.

    Attributes
    ----------
    quantity : str
        Its name.
    unit : str
        Its unit.
    part : int
        Number of the part at which it was noticed, the first is 0.
    since : int
        Number of the part with which it most likely came.
    size, size_sd : float
        How far it stepped, and the standard deviation of that, in its unit.
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
        """What to look at; dimensionless words."""
        return ADVICE.get(self.quantity, "look for what changed")

    @property
    def unwatched(self) -> str:
        """Since which part the quantity is not watched, and what ends that; dimensionless words."""
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
    """Units of quantities: as given, else those of quantities that are known here, else mm."""
    known = {name: UNITS.get(name, "mm") for name in names}
    if not isinstance(units, Mapping | None):
        raise TypeError(f"units must be a mapping of names to units; got {checks.shown(units)}")
    given = {checks.one_of("units", name, known): unit for name, unit in (units or {}).items()}
    return known | {name: checks.kind(f"units[{name!r}]", unit, str) for name, unit in given.items()}


def with_space(unit: str) -> str:
    """The unit as it follows a number."""
    return "" if unit in ("", "1") else f" {unit}"


class Shock(NamedTuple):
    """One standardised innovation of a filter: which part, the innovation over `spread`, and its sd for noise of sd 1."""

    part: int
    value: float
    spread: float


class DriftStep(NamedTuple):
    """The most likely step behind a row of innovations: part, size, and the size's sd for noise of sd 1."""

    since: int
    size: float
    size_sd: float


def likely_step(shocks: Sequence[Shock], side: int) -> DriftStep:
    """Return the step to that side that explains a row of innovations best.

    A step at one part makes innovations that fade as the filter follows: by ``1 - gain = 1/spread^2`` with each reading. Sum of
    squares that a step at part j explains: (s'u)^2/(s's), with s the fading row from j on.
    """
    found, most = DriftStep(shocks[-1].part, 0.0, np.inf), -np.inf
    values, spreads = (
        np.array([shock.value for shock in shocks]),
        np.array([shock.spread for shock in shocks]),
    )
    for j, shock in enumerate(shocks):
        fading = np.concatenate([[1.0], np.cumprod(spreads[j:-1] ** -2.0)]) / spreads[j:]
        square, along = float(fading @ fading), float(fading @ values[j:])
        if side * along > 0 and along**2 / square > most:
            found, most = DriftStep(shock.part, along / square, square**-0.5), along**2 / square
    return found
