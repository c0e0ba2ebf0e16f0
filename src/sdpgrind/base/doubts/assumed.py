"""Assumptions of the call that read a file: rows of the verdict "assumed"."""

from math import isclose
from typing import Any, NamedTuple

from sdpgrind.base import unit_text
from sdpgrind.base.columns.sheet import heading
from sdpgrind.base.columns.source import ColumnNote, Source, source_of
from sdpgrind.base.doubts.rows import Doubt, assumed

_HELD = {
    "begin": "each command holds from its row on",
    "centre": "each command is the mean about its row",
    "end": "each command led to its row",
}
_CALL = "call"
"""Origin of a unit that stands in the call, not in the file."""


class Reader(NamedTuple):
    """Alignment of the commands as they were read, and a row for each assumption."""

    commands_at: str = "begin"
    rows: tuple[Doubt, ...] = ()


def reader_of(data: Any, table: Any = None) -> Reader:
    """Return what the reader of a log or of its table assumed; of other data nothing is known."""
    source = getattr(data, "source", None)
    if not isinstance(source, Source):
        source = source_of(table)
    if source is None:
        return Reader()
    found = [row for column in source.columns for row in _of_column(column)]
    if any(column.name.endswith("_command") for column in source.columns):
        found.append(assumed("commands_at", repr(source.commands_at), _HELD[source.commands_at]))
    if source.gaps:
        longest = max(step for *_, step in source.gaps)
        found.append(
            assumed("gaps", f"{len(source.gaps)}, the longest {longest:.3g} s", "commands held over them")
        )
    found += [assumed("decided", note) for note in source.notes]
    return Reader(source.commands_at, tuple(found))


def _of_column(column: ColumnNote) -> list[Doubt]:
    """Unit and factor of a column, where they stand in the call alone."""
    found = []
    if column.origin == _CALL and not _in_header(column):
        found.append(
            assumed(f"unit of {column.name}", column.recorded, f"of {column.header!r}, given in the call")
        )
    try:
        converted = unit_text.factor(column.recorded, column.unit) if column.recorded else 1.0
    except ValueError:  # stamps of time
        return found
    if not isclose(column.factor, converted, rel_tol=1e-12):
        words = f"{column.factor / converted:.9g}"
        found.append(assumed(f"factor of {column.name}", words, f"of {column.header!r}, given in the call"))
    return found


def _in_header(column: ColumnNote) -> bool:
    """Whether the header of the file says the same unit as the call."""
    told = heading(column.header).unit
    try:
        return told is not None and isclose(unit_text.factor(told, column.recorded), 1.0)
    except ValueError:
        return False
