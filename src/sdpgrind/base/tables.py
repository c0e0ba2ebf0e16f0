"""The one door for measured data: arrays by name, a table of a log, or a log by its tables.

A log is an object with `tiers`, the names of its tables, or a mapping of tables; a table is a mapping of
columns, such as an `xarray.Dataset`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.columns.table import DIFFERENCES


def table_of(data: Any, tier: str) -> tuple[Any, bool]:
    """Return the table of `data`, and whether it is that of a log, where NaN means no reading.

    A log with one table is that table; of several the one named `tier` is taken.
    """
    if hasattr(data, "data_vars"):  # an xarray.Dataset, without its import
        return data, True
    names = tables_in(data, tier)
    if not names:
        return data, False
    if len(names) > 1 and tier not in names:
        raise ValueError(
            f"data must hold the table {tier!r}; it holds {', '.join(map(repr, names))}:"
            f" pass the table that is meant, as log[{names[0]!r}]"
        )
    return data[names[0] if len(names) == 1 else tier], True


def tables_in(data: Any, tier: str) -> tuple[str, ...]:
    """Return the names of the tables of a log, of which `tier` may be one; empty: arrays by name."""
    if hasattr(data, "tiers"):
        return tuple(data.tiers)
    if isinstance(data, Mapping):
        return tuple(name for name, each in data.items() if isinstance(each, Mapping))
    try:
        return (tier,) if isinstance(data[tier], Mapping) else ()
    except (KeyError, IndexError):
        return ()
    except TypeError:
        raise TypeError(f"data must be arrays by name, or a log; got {type(data).__name__}") from None


def command_in(table: Any, name: str) -> str:
    """Return the name of the column of a command: ``<name>_command``, else `name`."""
    return f"{name}_command" if f"{name}_command" in table else name


def column_of(table: Any, name: str, unit: str) -> Floats:
    """Return a column as an array of numbers; one with another unit in its attributes is refused."""
    cells = cells_of(table, name, unit)
    try:
        return np.asarray(cells, dtype=float).ravel()
    except (TypeError, ValueError):
        wanted = checks.with_unit("numbers", unit)
        raise TypeError(f"{name} must be {wanted}; got {checks.shown(cells)}") from None


def cells_of(table: Any, name: str, unit: str) -> Any:
    """Return a column as it is, a text (empty `unit`) or a number in each row."""
    try:
        column = table[name]
    except (KeyError, IndexError):
        held = ", ".join(map(str, table)) or "nothing"
        more = f"; {DIFFERENCES[name]}" if name in DIFFERENCES else ""
        raise ValueError(f"data must hold {checks.with_unit(name, unit)}; it holds {held}{more}") from None
    given = getattr(column, "attrs", {}).get("units", unit)
    # A pure number made of other columns keeps their units in xarray.
    if unit not in ("", "1") and _bare(given) != _bare(unit):
        raise ValueError(f"{name} must be in {unit}, as hwsim.Log.read converts it; its units are {given!r}")
    return column


def _bare(unit: str) -> str:
    """Unit without blanks and signs of products."""
    return unit.replace(" ", "").replace("*", "")


def names_of_parts(table: Any) -> list[str]:
    """Return the words of a file for its parts, by their number; empty: the table is not of a file."""
    return list(getattr(table, "attrs", {}).get("labels", ()))


def rows_of_parts(
    table: Any, size: int, part: int | str | Sequence[int | str] | None
) -> list[tuple[str, slice]]:
    """Return label and rows of each requested part of a table with `size` rows; empty label: no parts.

    A part is requested by its number, or by its words in the file.
    """
    if "part" not in table:
        if part is not None:
            raise checks.refuse("part", "left out of data without a column part", part)
        return [("", slice(0, size))]
    number = np.asarray(table["part"]).astype(int).ravel()
    by = [np.asarray(table["controller"]).ravel()] if "controller" in table else []
    changes = np.flatnonzero(np.any([tag[1:] != tag[:-1] for tag in (*by, number)], axis=0)) + 1
    starts, ends = [0, *changes.tolist()], [*changes.tolist(), size]
    names = dict(enumerate(names_of_parts(table)))
    wanted = set(number.tolist()) if part is None else _numbers(part, number, names)
    blocks = [(k, end) for k, end in zip(starts, ends, strict=True) if number[k] in wanted]
    labels = [[f"part {names.get(number[k], number[k])}", *(str(tag[k]) for tag in by)] for k, _ in blocks]
    return [(" of ".join(label), slice(*rows)) for label, rows in zip(labels, blocks, strict=True)]


def _numbers(part: int | str | Sequence[int | str], held: Any, names: Mapping[int, str]) -> set[int]:
    """Numbers of the requested parts; one that is not held is refused."""
    by_name = {name: number for number, name in names.items()}
    found = set()
    for entry in np.atleast_1d(np.asarray(part, dtype=object)).tolist():
        known = np.unique(held).tolist()
        checks.one_of("part", entry, [*by_name] if isinstance(entry, str) else known)
        found.add(by_name[entry] if isinstance(entry, str) else int(entry))
    return found
