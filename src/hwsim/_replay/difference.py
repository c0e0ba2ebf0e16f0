"""First difference between a command and the recorded one: numbers, texts, entries, rows of motions."""

from math import nan
from typing import Any

import numpy as np

from hwsim._part.motions import Column, is_table

Difference = tuple[str, Any, Any]  # place in the value, recorded, commanded


def difference(recorded: Any, commanded: Any) -> Difference | None:
    """First difference between two values of a command: its place and both values; None: equal."""
    if is_table(recorded) and is_table(commanded) and len(recorded) == len(commanded):
        return _in_rows(recorded, commanded)
    old, new = _logged(recorded), _logged(commanded)
    if isinstance(old, np.ndarray) or isinstance(new, np.ndarray):
        return _in_entries(np.atleast_1d(old), np.atleast_1d(new))
    return None if old == new or (old != old and new != new) else ("", old, new)


def unpadded(row: Column) -> Column:
    """An array without the NaN at its end, which the log adds next to longer arrays."""
    known = np.flatnonzero(~np.isnan(row))
    return row[: known[-1] + 1] if known.size else row[:0]


def _in_rows(old: Column, new: Column) -> Difference | None:
    """Compare motions of equally many rows; a missing column is NaN."""
    width = max(old.shape[1], new.shape[1])
    old, new = (
        np.pad(each, ((0, 0), (0, width - each.shape[1])), constant_values=nan) for each in (old, new)
    )
    unequal = np.argwhere(_unequal(old, new))
    if not len(unequal):
        return None
    row, column = unequal[0].tolist()
    return f"[{row}, {column}]", float(old[row, column]), float(new[row, column])


def _in_entries(old: Column, new: Column) -> Difference | None:
    if old.size != new.size:
        return ".size", float(old.size), float(new.size)
    unequal = np.flatnonzero(_unequal(old, new))
    return (f"[{unequal[0]}]", float(old[unequal[0]]), float(new[unequal[0]])) if unequal.size else None


def _unequal(old: Column, new: Column) -> Column:
    return np.asarray(~((old == new) | (np.isnan(old) & np.isnan(new))))


def _logged(value: Any) -> Any:
    """A command as its row of the log has it: a motion as its number of rows."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        return str(value)
    if is_table(value):
        return float(len(array))
    return float(array) if array.ndim == 0 else unpadded(array.ravel())
