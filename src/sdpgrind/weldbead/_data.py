"""Readings of passes: from arrays by name, or from the log of a run."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

UNITS = {
    "grinding_power": "W",
    "removal_rate": "mm^3/s",
    "normal_force": "N",
    "tangential_force": "N",
    "feed_rate": "mm/s",
    "cut_depth": "mm",
}


@dataclasses.dataclass(frozen=True)
class Readings:
    """Arrays of one length, by name, and how many rows of a log had no reading."""

    arrays: dict[str, Floats]
    dropped: int

    def __getitem__(self, name: str) -> Floats:
        return self.arrays[name]

    @property
    def points(self) -> int:
        return next(iter(self.arrays.values())).size

    def only(self, kept: Any) -> "Readings":
        """The rows that are `kept`; the others count as dropped."""
        return Readings({name: a[kept] for name, a in self.arrays.items()}, self.dropped + int(np.sum(~kept)))

    def require(self, at_least: int) -> "Readings":
        """Refuse fewer points than that."""
        if self.points < at_least:
            raise ValueError(
                f"data must have at least {at_least} passes; got {self.points} (and {self.dropped} without a reading)"
            )
        return self

    def levels(self, name: str) -> "Readings":
        """Refuse a quantity that was the same in all passes."""
        values = self[name]
        if np.ptp(values) <= 1e-9 * np.abs(values).max():
            raise ValueError(f"{name} must have at least two levels ({UNITS[name]}); got {float(values[0])!r} in all passes")
        return self

    @property
    def message(self) -> str:
        """What the estimate rests on."""
        return f"from {self.points} passes" + (f", {self.dropped} more were of no use" if self.dropped else "")


def readings(data: Any, names: Sequence[str], commanded: Sequence[str] = ()) -> Readings:
    """Return the named quantities of `data`, arrays by name or a log with a table ``"sequence"``.

    NaN means "no reading" in a log, whose row is dropped and counted; in arrays it is refused. Of a log, those `commanded`
    are the commands that led to the row's readings, where it holds them: they have no sensor's noise.
    """
    table, is_log = _table(data)
    arrays = {name: _column(table, name) for name in names}
    if is_log:
        arrays |= {name: _led_to(table, name) for name in commanded if f"{name}_command" in table}
    size = arrays[names[0]].size
    for name, values in arrays.items():
        if values.size != size:
            raise ValueError(f"{name} must have as many entries as {names[0]}, {size}; got {values.size}")
    read = Readings(arrays, 0)
    if is_log:
        read = read.only(~np.any([np.isnan(values) for values in arrays.values()], axis=0))
    for name in names:
        checks.finite_array(name, read[name], UNITS[name])
    return read


def _table(data: Any) -> tuple[Any, bool]:
    try:
        return data["sequence"], True
    except (KeyError, IndexError):
        return data, False
    except TypeError:
        raise TypeError(f"data must be arrays by name, or a log; got {type(data).__name__}") from None


def _led_to(table: Any, name: str) -> Floats:
    """The command of the row before, in the same part: a row holds what was measured, then what was commanded."""
    command, part = _column(table, f"{name}_command"), np.asarray(table["part"])
    before = np.concatenate([[np.nan], command[:-1]])
    return np.where(np.concatenate([[False], part[1:] == part[:-1]]), before, np.nan)


def _column(table: Any, name: str) -> Floats:
    try:
        column = table[name]
    except (KeyError, IndexError):
        held = ", ".join(map(str, table)) or "nothing"
        raise ValueError(f"data must hold {name} ({UNITS[name]}); it holds {held}") from None
    return np.asarray(column, dtype=float).ravel()
