"""Whether a removal rate agrees with power, and with depth and feed: by the energy and width they imply.

Without a rate, power and the width of a bead, its depth and feed imply an energy.
"""

from collections.abc import Mapping
from math import isfinite, nan
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.mistakes import Mistake, explained, in_unit
from sdpgrind.base.columns.plausible import is_meant
from sdpgrind.base.columns.request import Bound, unit_of_name
from sdpgrind.base.columns.sheet import Column
from sdpgrind.base.columns.table import quantity_of
from sdpgrind.base.unit_text import factor, near

ENERGY = (2.0, 150.0)  # J/mm^3; chosen: of grinding, from soft metal to fine cuts
"""Usual specific energies."""
_WIDTH = (2.0, 200.0)  # mm; chosen: of beads
_USUAL = {"specific energy": ENERGY, "bead width": _WIDTH}
_RATE = "removal_rate"
# name -> powers with which it enters energy and width; derived: power / rate, rate / (depth * feed)
_POWERS = {_RATE: (-1, 1), "cut_depth": (0, -1), "feed_rate": (0, -1), "grinding_power": (1, 0)}
# the same without a rate; derived: power / (width * depth * feed)
_WITHOUT = {"grinding_power": (1, 0), "bead_width": (-1, 0), "cut_depth": (-1, 0), "feed_rate": (-1, 0)}


class _Implied(NamedTuple):
    """Specific energy (J/mm^3) and bead width (mm); NaN: not known."""

    energy: float
    width: float

    @property
    def _known(self) -> list[tuple[float, str, tuple[float, float]]]:
        pairs = (self.energy, "specific_energy", ENERGY), (self.width, "bead_width", _WIDTH)
        return [each for each in pairs if isfinite(each[0])]

    @property
    def unusual(self) -> int:
        """How many of the two are unusual."""
        return sum(not low <= value <= high for value, _, (low, high) in self._known)

    @property
    def is_odd(self) -> bool:
        """Whether one is what no machine means, or both are unusual."""
        ranges = [(value, quantity_of(name)) for value, name, _ in self._known]
        impossible = any(not meant.least <= value <= meant.greatest for value, meant in ranges)
        return impossible or (self.unusual == len(ranges) > 1)

    def times(self, powers: tuple[int, int], factor: float) -> "_Implied":
        """Return what is implied where a quantity that enters with `powers` is `factor` as great."""
        of_energy, of_width = powers
        return _Implied(self.energy * factor**of_energy, self.width * factor**of_width)

    def __str__(self) -> str:
        told = [f"specific energy {self.energy:.3g} J/mm^3"] * isfinite(self.energy)
        return " and ".join(told + [f"bead width {self.width:.3g} mm"] * isfinite(self.width))


def removal_fault(columns: Mapping[str, Column], bounds: Mapping[str, Bound]) -> str | None:
    """Return why a removal rate contradicts power, or depth and feed; None: it does not, or they are missing.

    Without a rate, why power contradicts width, depth and feed.

    Each must be what a machine can mean; where both are there, one of them must be usual, too.
    """
    implied = _implied(columns)
    if implied is None or not implied.is_odd:
        return None
    powers = _powers(columns)
    rule = f"{_RATE} must agree with power" if powers is _POWERS else "grinding_power must agree with width"
    told = f"{rule}, depth and feed; they imply {implied}"
    found = [each for name in powers if name in columns for each in _units(implied, columns, bounds[name])]
    if found:
        told = explained(told, sorted(found, key=lambda one: one.rank))
    return f"{told} (plausible=False takes it as it is)"


def removal_doubt(columns: Mapping[str, Column], bounds: Mapping[str, Bound]) -> str | None:
    """Return what is unusual beside a removal rate, though a machine may mean it; None: nothing."""
    implied = _implied(columns)
    if implied is None or not implied.unusual:
        return None
    usual = " and ".join(f"{name} {low:g} ... {high:g}" for name, (low, high) in _USUAL.items())
    used = ", ".join(f"{name} in {bounds[name].unit}" for name in _powers(columns) if name in columns)
    return f"{used} imply {implied}; usual are {usual} (J/mm^3, mm): is one of the units another?"


def _powers(columns: Mapping[str, Column]) -> Mapping[str, tuple[int, int]]:
    """Powers with which columns enter energy and width."""
    return _POWERS if _RATE in columns else _WITHOUT


def _implied(columns: Mapping[str, Column]) -> _Implied | None:
    if _RATE in columns:
        return _Implied(_energy(columns), _width(columns))
    return _Implied(_without_rate(columns), nan) if _WITHOUT.keys() <= columns.keys() else None


def _units(implied: _Implied, columns: Mapping[str, Column], each: Bound) -> list[Mistake]:
    """Other units of a column with which all agrees, and which a machine can mean."""
    name = each.request.name
    ours, found = unit_of_name(name), []
    for unit in (ours, *near(ours)):
        times = factor(unit, ours) / factor(each.unit, ours)
        other = implied.times(_powers(columns)[name], times)
        if other != implied and not other.is_odd and is_meant(times * columns[name], quantity_of(name)):
            found.append(in_unit(each, unit, other.unusual))
    return found


def _energy(columns: Mapping[str, Column]) -> float:
    """Power over removal rate, J/mm^3; NaN: not known."""
    if "grinding_power" not in columns:
        return nan
    return median_ratio(columns["grinding_power"], columns[_RATE])


def _without_rate(columns: Mapping[str, Column]) -> float:
    """Power over width, depth and feed, J/mm^3; NaN: not known."""
    rate = columns["bead_width"] * columns["cut_depth"] * columns["feed_rate"]
    return median_ratio(columns["grinding_power"], rate)


def _width(columns: Mapping[str, Column]) -> float:
    """Removal rate over depth and feed, mm; NaN: not known."""
    if not {"cut_depth", "feed_rate"} <= columns.keys():
        return nan
    return median_ratio(columns[_RATE], columns["cut_depth"] * columns["feed_rate"])


def median_ratio(numbers: Floats, divisors: Floats) -> float:
    """Return the median magnitude of ratios, in their unit, without missing ones and 0; NaN: none."""
    both = np.isfinite(numbers) & np.isfinite(divisors) & (numbers != 0) & (divisors != 0)
    return float(np.median(np.abs(numbers[both] / divisors[both]))) if np.any(both) else nan
