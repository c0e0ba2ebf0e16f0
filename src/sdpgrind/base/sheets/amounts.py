"""Amounts of a quantity, shown with one unit and as many digits as they need."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

_FINER = {"mm": "µm", "mm/s": "µm/s", "s": "ms"}
SMALL = 0.05  # greatest value in mm, mm/s or s that is shown in a thousandth; source: a gauge's last digits
# significant digits of the greatest of several values, and of a value alone; chosen: a deviation of 0.1 % is
# seen, and an input stands as it was typed
_DIGITS, _ALONE = 4, 6
_SHARP = 1e-6  # relative interval below which its digits say nothing; derived: of _ALONE
_MORE = 2  # decimal places beyond those of the widest interval of a row; chosen: the others are beside it
_WIDE = 500.0  # greatest over least value from which on each has its own digits; chosen: one digit remains
_PLAIN = (1e-4, 1e6)  # greatest values without a power of ten; chosen: at most ten characters
_PLACES = 9  # chosen: greatest number of decimal places; more are rounding of the arithmetic
_FINE = 3  # decimal places that are cut beside a greater value; chosen: a greatest below 1000
_NOTHING = "–"


@dataclass(frozen=True)
class Interval:
    """A value with half of its 95 % interval, in the same unit; 0: exact, NaN: not known.

    `least`: smallest value that the quantity can have, where an interval ends. `sure`: words after a value
    without an interval.
    """

    value: float
    half: float
    least: float = -math.inf
    sure: str = "exact"

    def shown(self, factor: float, most: int = _PLACES, alone: int = _PLACES) -> str:
        """Return the text of value and interval, times a factor, with `most` decimal places.

        `alone`: decimal places of a value without an interval, beside which there are greater ones.
        """
        value, half = factor * self.value, factor * self.half
        if not math.isfinite(value):
            return _endless(value)
        if half == 0 and abs(value) < 0.1**_PLACES:  # rounding
            return f"0 {self.sure}"
        if 0 < half < max(_SHARP * abs(value), 10.0**-most):
            places = min(_ending(value), most)
            return f"{value:.{places}f} ± <{10.0**-places:.{places}f}"
        if half > 0 and math.isfinite(half):
            places, least = min(places_of(half), most), factor * self.least
            if value - half < least <= value:
                return f"{value:.{places}f} ({least:g} to {value + half:.{places}f})"
            return f"{value:.{places}f} ± {half:.{places}f}"
        value = round(value, alone) or value  # beside 25.605 the digits of 0.0965141 say nothing
        return f"{value:.{_ALONE}g} {self.sure if half == 0 else '(no interval)'}"


Cell = float | int | str | Interval
"""A float or an interval is in the unit of its quantity; whole numbers and texts are shown as they are."""


@dataclass(frozen=True)
class Amounts:
    """Values of one quantity: a column of a table, or a row.

    Attributes
    ----------
    name : str
        Name of the quantity; all amounts of this name in a page have one unit.
    values : tuple of Cell
        Values in `unit`.
    unit : str
        Unit of the library; "1" or "": none.
    heading : str
        Words instead of the name.
    """

    name: str
    values: tuple[Cell, ...]
    unit: str = ""
    heading: str = ""

    @classmethod
    def of(cls, name: str, values: Iterable[Any], unit: str = "", heading: str = "") -> "Amounts":
        """Return the amounts of numbers of any kind (numpy's included), texts and intervals."""
        return cls(name, tuple(map(cell, values)), unit, heading)

    @property
    def greatest(self) -> float:
        """Greatest finite magnitude; 0: there is none."""
        return max((abs(x) for x in self._floats if math.isfinite(x)), default=0.0)

    @property
    def _floats(self) -> list[float]:
        numbers = [each.value if isinstance(each, Interval) else each for each in self.values]
        return [each for each in numbers if isinstance(each, float)]

    def head(self, scale: tuple[float, str]) -> str:
        """Return name and unit."""
        words, unit = self.heading or self.name.replace("_", " "), scale[1]
        return words if unit in ("", "1") else f"{words} [{unit}]"

    def cells(self, scale: tuple[float, str]) -> list[str]:
        """Return the values as texts, times the factor of a `scale`."""
        factor = scale[0]
        whole = factor == 1 and all(x == int(x) for x in self._floats if math.isfinite(x))
        least = min((abs(x) for x in self._floats if x), default=0.0)
        if self.greatest > _WIDE * least > 0:
            greatest = math.nan
        elif len(self.values) == 1 and self.greatest:
            greatest, whole = math.inf, False
        else:
            greatest = self.greatest * factor
        most, alone = self._most(factor), _ending(factor * self.greatest)
        return [
            each.shown(factor, most, alone)
            if isinstance(each, Interval)
            else _text(each, factor, greatest, whole, alone)
            for each in self.values
        ]

    def _most(self, factor: float) -> int:
        """Return the greatest number of decimal places of an interval: by the widest, else by the values."""
        halves = [each.half for each in self.values if isinstance(each, Interval)]
        widest = max((half for half in halves if math.isfinite(half)), default=0.0)
        if widest > _SHARP * self.greatest:
            return min(places_of(factor * widest) + _MORE, _PLACES)
        return _ending(factor * self.greatest)

    def plain(self) -> dict[str, Any]:
        """Return the amounts for JSON."""
        values = [_coded(each) for each in self.values]
        return {"name": self.name, "unit": self.unit, "heading": self.heading, "values": values}

    @classmethod
    def from_plain(cls, plain: dict[str, Any]) -> "Amounts":
        """Return the amounts of `plain`."""
        values = tuple(map(_decoded, plain["values"]))
        return cls(plain["name"], values, plain["unit"], plain["heading"])


def _ending(value: float) -> int:
    """Decimal places of a value alone."""
    return min(max(_ALONE - 1 - math.floor(math.log10(abs(value))), 0), _PLACES) if value else _PLACES


def places_of(spread: float) -> int:
    """Return the decimal places that two digits of a spread > 0 carry."""
    return min(max(1 - math.floor(math.log10(spread)), 0), _PLACES)


def fixed(value: float, places: int) -> str:
    """Return a value with some decimal places; what rounds to zero has no sign."""
    text = f"{value:.{places}f}"
    return text.removeprefix("-") if float(text) == 0 else text


def written(value: float, greatest: float, digits: int = _DIGITS) -> str:
    """Return a value with the decimal places that `digits` of the greatest of several need.

    `greatest` inf: six digits of the value, NaN: four of its own.
    """
    size = abs(greatest)
    if not math.isfinite(size):
        return f"{value:.{_ALONE if size > 0 else _DIGITS}g}"
    if size and not _PLAIN[0] <= size < _PLAIN[1]:
        return f"{value:.{digits}g}"
    return fixed(value, max(digits - 1 - math.floor(math.log10(size)), 0) if size else 0)


def scale_of(unit: str, greatest: float) -> tuple[float, str]:
    """Return factor and unit in which amounts are shown: a thousandth where the greatest is small."""
    finer = _FINER.get(unit)
    return (1e3, finer) if finer and 0 < greatest < SMALL else (1.0, unit)


def cell(value: Any) -> Cell:
    """Return a number of any kind, a truth, a text or an interval as a cell."""
    if isinstance(value, Interval | str):
        return value
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, int | np.integer):
        return int(value)
    return math.nan if value is None else float(value)


def _text(value: float | int | str, factor: float, greatest: float, whole: bool, alone: int) -> str:
    if not isinstance(value, float):
        return str(value)
    if not math.isfinite(value):
        return _endless(value)
    if math.isnan(greatest) and alone >= _FINE and 0 < abs(factor * value) < 10.0 ** (_DIGITS - 1 - alone):
        return _beside(factor * value, alone)
    return f"{value:.0f}" if whole and greatest < _PLAIN[1] else written(factor * value, greatest)


def _beside(value: float, places: int) -> str:
    """A value beside one so much greater that its own digits say nothing; it is not shown as 0."""
    least = f"{10.0**-places:.{places}f}"
    if abs(value) < 0.5 * float(least):
        return f"<{least}" if value > 0 else f">-{least}"
    return fixed(value, places)


def _endless(value: float) -> str:
    return _NOTHING if math.isnan(value) else "∞" if value > 0 else "-∞"


def _coded(value: Cell) -> Any:
    """A cell for JSON, which has neither NaN nor infinity."""
    if isinstance(value, Interval):
        bounded: dict[str, Any] = {"least": value.least} if math.isfinite(value.least) else {}
        bounded |= {} if value.sure == "exact" else {"sure": value.sure}
        return {"value": _coded(value.value), "half": _coded(value.half)} | bounded
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else {"infinite": 1 if value > 0 else -1}
    return value


def _decoded(value: Any) -> Cell:
    if isinstance(value, dict) and "infinite" in value:
        return math.inf * int(value["infinite"])
    if isinstance(value, dict):
        more = {name: value[name] for name in ("least", "sure") if name in value}
        return Interval(_number(value["value"]), _number(value["half"]), **more)
    return math.nan if value is None else _kept(value)


def _number(value: Any) -> float:
    found = _decoded(value)
    return found if isinstance(found, float) else math.nan


def _kept(value: Any) -> Cell:
    return value if isinstance(value, str | int | float) else str(value)
