"""Readings from arrays by name, or from the log of a run."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.tables import column_of, command_in, rows_of_parts, table_of


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
    data: Any,
    units: Mapping[str, str],
    *,
    tier: str,
    each: str = "rows",
    commanded: Sequence[str] = (),
    part: int | str | Sequence[int | str] | None = None,
) -> Readings:
    """Return named quantities of `data`: arrays by name, a table of a log, or a log.

    In a log, a row with NaN (no reading) is dropped and counted; in arrays NaN is refused.

    Parameters
    ----------
    data : mapping of arrays, table, or log
        Arrays of one length, a table of a log (`xarray.Dataset`), or a log: its only table, of several the
        one named `tier`.
    units : mapping
        Names of the quantities, and their units (for messages).
    tier : str
        Table of a log.
    each : str
        Noun for the entries, in the plural, for messages.
    commanded : sequence of str
        Quantities of a log taken from the command that led to the readings of a row, if there is one: free of
        sensor noise. So is any other quantity that was commanded, but not measured.
    part : int, str or sequence of them, optional
        Numbers (unit 1) of the parts, or their words in the file. Default: all.

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
    led = [name for name in units if is_log and (name in commanded or name not in table)]
    arrays = {
        name: (_led_to if name in led and command_in(table, name) != name else column_of)(table, name, unit)
        for name, unit in units.items()
    }
    first, size = next((name, values.size) for name, values in arrays.items())
    for name, values in arrays.items():
        if values.size != size:
            raise ValueError(f"{name} must have as many entries as {first}, {size}; got {values.size}")
    if part is not None:
        kept = np.concatenate([np.arange(size)[rows] for _, rows in rows_of_parts(table, size, part)])
        arrays = {name: values[kept] for name, values in arrays.items()}
    read = Readings(arrays, units, each)
    if is_log:
        read = read.only(~np.any([np.isnan(values) for values in arrays.values()], axis=0))
    for name, unit in units.items():
        checks.finite_array(name, read[name], unit)
    return read


def _led_to(table: Any, name: str, unit: str) -> Floats:
    """Command of the row before, in the same part: the command in a row follows its measurement."""
    command = column_of(table, f"{name}_command", unit)
    led = np.full(command.size, np.nan)
    for _, rows in rows_of_parts(table, command.size, None):
        led[rows][1:] = command[rows][:-1]
    return led
