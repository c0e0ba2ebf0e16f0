"""Readings over time, part by part, from arrays by name or from a log; a missing reading stays NaN."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.tables import column_of, command_in, rows_of_parts, table_of


@dataclasses.dataclass(frozen=True)
class Series:
    """Readings of one part over time, as `series` gives them.

    Attributes
    ----------
    label : str
        Part, for messages; empty if there is only one.
    time : array, shape (n,)
        Times of the readings, s, rising.
    arrays : dict
        Arrays of shape (n,) by name, each in its unit. NaN: no reading. A command holds from its time on.
    """

    label: str
    time: Floats
    arrays: dict[str, Floats]

    def __getitem__(self, name: str) -> Floats:
        return self.arrays[name]

    def __contains__(self, name: str) -> bool:
        return name in self.arrays


def series(
    data: Any,
    units: Mapping[str, str],
    *,
    tier: str,
    commands: Sequence[str] = (),
    optional: Sequence[str] = (),
    part: int | str | Sequence[int | str] | None = None,
) -> tuple[Series, ...]:
    """Return named quantities of `data` over time, one `Series` for each part.

    Parameters
    ----------
    data : mapping of arrays, table, or log
        Arrays of one length with ``time`` (s), and ``part`` for several; a table of a log (`xarray.Dataset`);
        or a log: its only table, of several the one named `tier`.
    units : mapping
        Names of the quantities, and their units (for messages).
    tier : str
        Table of a log.
    commands : sequence of str
        Quantities that are commands: the column ``<name>_command``, else ``<name>``. A missing command: the
        last one holds.
    optional : sequence of str
        Quantities that may be missing.
    part : int, str or sequence of them, optional
        Numbers (unit 1) of the parts, or their words in the file. Default: all.

    Raises
    ------
    ValueError, TypeError
        For a missing quantity, unequal lengths, a time that does not rise within a part, or an absent part.

    Examples
    --------
    >>> one, = series({"time": [0.0, 0.1], "size": [0.0, float("nan")]}, {"size": "mm"}, tier="controller")
    >>> one["size"].tolist()
    [0.0, nan]
    """
    table, _ = table_of(data, tier)
    renamed = {name: command_in(table, name) if name in commands else name for name in units}
    kept = [name for name in units if name not in optional or renamed[name] in table]
    arrays = {name: column_of(table, renamed[name], units[name]) for name in kept}
    time = column_of(table, "time", "s")
    for name, values in arrays.items():
        if values.size != time.size:
            raise ValueError(f"{name} must have as many entries as time, {time.size}; got {values.size}")
    checks.finite_array("time", time, "s")
    found = [
        Series(
            label,
            time[rows],
            {name: _held(v[rows]) if name in commands else _gaps(v[rows]) for name, v in arrays.items()},
        )
        for label, rows in rows_of_parts(table, time.size, part)
    ]
    for one in found:
        _rising(one)
    return tuple(found)


def _held(values: Floats) -> Floats:
    """Commands, each held until the next; 0 before the first."""
    given = np.isfinite(values)
    last = np.maximum.accumulate(np.where(given, np.arange(values.size), -1))
    return np.where(last >= 0, np.where(given, values, 0.0)[last], 0.0)


def _gaps(values: Floats) -> Floats:
    return np.where(np.isfinite(values), values, np.nan)


def _rising(one: Series) -> None:
    steps = np.diff(one.time)
    if np.any(steps <= 0):
        k = int(np.argmax(steps <= 0))
        where = f" in {one.label}" if one.label else ""
        raise ValueError(
            f"time must be rising{where} (s); got {float(one.time[k]):g} and then {float(one.time[k + 1]):g}"
        )
