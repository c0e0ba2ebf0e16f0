"""Record of what was read, from where and how: the table that a colleague checks against the file."""

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from typing import Any, Self

from sdpgrind.base import notebook
from sdpgrind.base.brief import counted
from sdpgrind.base.columns.sheet import TextLayout
from sdpgrind.base.text_table import aligned

_HEADS = ("column", "unit", "header", "recorded in", "from", "factor", "missing")
_SIGNS = {"\t": "TAB", " ": "blanks"}
_MOST_GAPS = 5  # chosen: more are counted, not listed
_MOST_WORDS = 12  # chosen: words of parts in a line of some 110 letters; more are counted
_MOST_HEADS = 6  # chosen: headers with their units in such a line


@dataclasses.dataclass(frozen=True)
class FileNote:
    """A file that was read: size in bytes and digest; of a table in memory neither."""

    name: str
    size: int = 0
    sha256: str = ""
    encoding: str = ""
    separator: str = ""
    decimal: str = ""
    first_line: int = 0
    above: int = 0
    below: int = 0


@dataclasses.dataclass(frozen=True)
class ColumnNote:
    """A column: its header, unit and factor from what is recorded to our unit, readings that are missing."""

    name: str
    unit: str
    header: str
    recorded: str
    origin: str
    factor: float
    missing: int = 0


@dataclasses.dataclass(frozen=True)
class Source:
    """Origin of the columns of a log or a profile; printed, it is a table.

    Attributes
    ----------
    files : tuple
        Name, size, sha256, encoding, separator, decimal sign, first line of data of each file.
    columns : tuple
        Name, unit, header, recorded unit and its origin, factor, missing readings of each column.
    parts : int
        Number of parts, unit 1.
    rows_read, rows_left_out : int
        Rows of the files, and equal or merged ones among them, unit 1.
    gaps : tuple
        Steps of more than three medians: words of the part, time (s), length (s).
    commands_at : str
        When commands of a row hold: "begin", "end" or "centre"; "": not of a profile.
    notes : tuple of str
        What else was decided.
    labels : tuple of str
        Words of the file for the parts, as written; empty: the parts are numbers in order.
    unread : tuple of str
        Headers of the columns that were not asked for.
    """

    files: tuple[FileNote, ...]
    columns: tuple[ColumnNote, ...]
    parts: int
    rows_read: int
    rows_left_out: int = 0
    gaps: tuple[tuple[str, float, float], ...] = ()
    commands_at: str = "begin"
    notes: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()

    def to_json(self) -> str:
        """Return JSON that `from_json` reads."""
        return json.dumps(dataclasses.asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Read the JSON of `to_json`."""
        told: dict[str, Any] = json.loads(text)
        told["files"] = tuple(FileNote(**each) for each in told["files"])
        told["columns"] = tuple(ColumnNote(**each) for each in told["columns"])
        told["gaps"] = tuple((str(part), time, step) for part, time, step in told["gaps"])
        texts = {name: tuple(told.get(name, ())) for name in ("notes", "labels", "unread")}
        return cls(**told | texts)

    def __str__(self) -> str:
        return "\n".join([*map(_of_file, self.files), *_table(self.columns), *self._rows()])

    def _repr_html_(self) -> str:
        files = "; ".join(" ".join(_of_file(note).split()) for note in self.files)
        caption = "; ".join([f"read from {files}", *self._rows()])
        return notebook.table(caption, _HEADS, map(_cells, self.columns))

    def _rows(self) -> list[str]:
        kept = self.rows_read - self.rows_left_out
        held = f", commands_at {self.commands_at!r}" if self.commands_at else ""
        lines = [
            f"{self.rows_read} rows read, {self.rows_left_out} left out, {kept} kept in"
            f" {counted(self.parts, 'part')}{held}"
        ]
        if self.labels:
            lines.append(f"parts: {_first(self.labels, _MOST_WORDS)}")
        if self.gaps:
            told = [f"{step:.4g} s at {time:.6g} s of part {part}" for part, time, step in self.gaps]
            lines.append(f"{counted(len(told), 'gap')}: {_first(told, _MOST_GAPS)}")
        if self.unread:
            lines.append(f"columns not asked for: {_first(self.unread, _MOST_HEADS)}")
        return [*lines, *self.notes]


def _first(words: Sequence[str], most: int) -> str:
    more = len(words) - most
    return ", ".join(words[:most]) + (f" and {more} more" if more > 0 else "")


def source_of(table: Any) -> Source | None:
    """Origin in the attribute ``source`` of a table; None: it was not read from a file."""
    told = getattr(table, "attrs", {}).get("source")
    return None if told is None else Source.from_json(str(told))


def file_note(name: str, raw: bytes, layout: TextLayout | None) -> FileNote:
    """Note of a file and how it was read."""
    digest = hashlib.sha256(raw).hexdigest()
    if layout is None:
        return FileNote(name, len(raw), digest)
    return FileNote(name, len(raw), digest, layout.encoding, layout.separator, layout.decimal, *layout[3:])


def _of_file(note: FileNote) -> str:
    if not note.sha256:
        return note.name
    lines = [f"{note.name}: {note.size} bytes, sha256 {note.sha256}"]
    if note.encoding:
        sign = _SIGNS.get(note.separator, note.separator)
        lines.append(
            f"  {note.encoding}, separator {sign}, decimal sign {note.decimal}, data from line"
            f" {note.first_line} on, {counted(note.above, 'line')} above, {note.below} below"
        )
    return "\n".join(lines)


def _table(columns: tuple[ColumnNote, ...]) -> list[str]:
    return aligned([_HEADS, *map(_cells, columns)])


def _cells(c: ColumnNote) -> tuple[str, ...]:
    return c.name, c.unit, c.header, c.recorded or "-", c.origin or "-", f"{c.factor:.9g}", str(c.missing)
