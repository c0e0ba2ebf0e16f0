"""Readings from arrays by name, or from the log of a run."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


@dataclasses.dataclass(frozen=True)
class Readings:
    """Arrays of one length, by name, as `readings` gives them.

    Attributes
    ----------
    arrays : dict
        Arrays by name, each in its unit.
    units : mapping
        Units by name.
    each : str
        Noun for the entries, in the plural.
    dropped : int
        Number of rows of a log without a reading.
    """

    arrays: dict[str, Floats]
    units: Mapping[str, str]
    each: str = "rows"
    dropped: int = 0

    def __getitem__(self, name: str) -> Floats:
        return self.arrays[name]

    @property
    def points(self) -> int:
        """Number of entries of each array, unit 1."""
        return next(iter(self.arrays.values())).size

    def only(self, kept: Any) -> "Readings":
        """Return the rows where the mask `kept` (unit 1) is true; the others count as dropped."""
        arrays = {name: values[kept] for name, values in self.arrays.items()}
        return dataclasses.replace(self, arrays=arrays, dropped=self.dropped + int(np.sum(~kept)))

    def require(self, at_least: int) -> "Readings":
        """Refuse fewer points than `at_least` (a whole number, unit 1)."""
        if self.points < at_least:
            got = f"{self.points} (and {self.dropped} without a reading)"
            raise ValueError(f"data must have at least {at_least} {self.each}; got {got}")
        return self

    def levels(self, name: str) -> "Readings":
        """Refuse the quantity `name` (in its unit) if it is constant."""
        values = self[name]
        if np.ptp(values) <= 1e-9 * np.abs(values).max():
            only = f"{float(values[0])!r} in all {self.each}"
            raise ValueError(f"{name} must have at least two levels ({self.units[name]}); got {only}")
        return self

    @property
    def message(self) -> str:
        """Origin of the estimate, in words."""
        return f"from {self.points} {self.each}" + (
            f", {self.dropped} more were of no use" if self.dropped else ""
        )


def readings(
    data: Any, units: Mapping[str, str], *, tier: str, each: str = "rows", commanded: Sequence[str] = ()
) -> Readings:
    """Return named quantities of `data`: arrays by name, or one table of a log.

    In a log, a row with NaN (no reading) is dropped and counted; in arrays NaN is refused.

    Parameters
    ----------
    data : mapping of arrays, or log
        Arrays of one length, or a log with a table `tier`.
    units : mapping
        Names of the quantities, and their units (for messages).
    tier : str
        Table of a log.
    each : str
        Noun for the entries, in the plural, for messages.
    commanded : sequence of str
        Quantities of a log taken from the command that led to the readings of a row, if there is one: free of
        sensor noise.

    Raises
    ------
    ValueError, TypeError
        For a missing quantity, unequal lengths, or a value that is not finite, with its unit.

    Examples
    --------
    >>> read = readings({"normal_force": [40.0, 60.0]}, {"normal_force": "N"}, tier="sequence", each="passes")
    >>> float(read["normal_force"].mean()), read.message
    (50.0, 'from 2 passes')
    """
    table, is_log = table_of(data, tier)
    arrays = {name: column_of(table, name, unit) for name, unit in units.items()}
    if is_log:
        arrays |= {
            name: _led_to(table, name, units[name]) for name in commanded if f"{name}_command" in table
        }
    first, size = next((name, values.size) for name, values in arrays.items())
    for name, values in arrays.items():
        if values.size != size:
            raise ValueError(f"{name} must have as many entries as {first}, {size}; got {values.size}")
    read = Readings(arrays, units, each)
    if is_log:
        read = read.only(~np.any([np.isnan(values) for values in arrays.values()], axis=0))
    for name, unit in units.items():
        checks.finite_array(name, read[name], unit)
    return read


def table_of(data: Any, tier: str) -> tuple[Any, bool]:
    """Return the table `tier` of a log, or the arrays; and whether it is a log (private to this package)."""
    try:
        return data[tier], True
    except (KeyError, IndexError):
        return data, False
    except TypeError:
        raise TypeError(f"data must be arrays by name, or a log; got {type(data).__name__}") from None


def _led_to(table: Any, name: str, unit: str) -> Floats:
    """Command of the row before, in the same part: the command in a row follows its measurement."""
    command, part = column_of(table, f"{name}_command", unit), np.asarray(table["part"])
    before = np.concatenate([[np.nan], command[:-1]])
    return np.where(np.concatenate([[False], part[1:] == part[:-1]]), before, np.nan)


def column_of(table: Any, name: str, unit: str) -> Floats:
    """Return a column as an array of numbers (private to this package)."""
    try:
        column = table[name]
    except (KeyError, IndexError):
        held = ", ".join(map(str, table)) or "nothing"
        raise ValueError(f"data must hold {name} ({unit}); it holds {held}") from None
    return np.asarray(column, dtype=float).ravel()
