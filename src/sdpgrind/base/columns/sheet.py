"""What a file holds before any unit is applied: headings, columns, words on how it was read."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.unit_text import parse

Column = npt.NDArray[Any]
"""Numbers (float, NaN: none), texts (object) or time stamps (datetime64)."""
ROWS_MAX = 10_000_000  # chosen: some 2 GB of memory for 20 columns
_BRACKET = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>(?:[^()]|\([^()]*\))*)\))\s*")
_LONGEST = 40  # chosen: letters; a longer text is no unit, and would fill a message
UNNAMED = "Unnamed: "
"""Beginning of the name that pandas gives an empty cell; source: its documentation."""
_NO_UNIT = ("", "-", "--", "1")


class ColumnHead(NamedTuple):
    """Header as in the file, header without its bracket, unit as in the file (None: none), its place."""

    header: str
    name: str
    unit: str | None = None
    origin: str = ""


class TextLayout(NamedTuple):
    """How a text was read."""

    encoding: str
    separator: str
    decimal: str
    first_line: int
    above: int
    below: int


class Wave(NamedTuple):
    """Times of a waveform, s: of its first sample and from one to the next."""

    start: float
    step: float


@dataclass(frozen=True)
class Sheet:
    """Columns of one part of a file: `take` reads those that are asked for, in the order of `headings`."""

    file: str
    headings: Sequence[ColumnHead]
    take: Callable[[Sequence[int]], list[Column]]
    place: Callable[[int], str] = field(default=lambda row: f"row {row + 1}")
    label: str | None = None  # group of the file
    layout: TextLayout | None = None
    decimal: str = "."
    rows: int | None = None
    waves: Mapping[int, Wave] = field(default_factory=dict)
    own_times: Mapping[int, tuple[str, Column]] = field(default_factory=dict)
    """Unit text ("": none) and values of the time of a column that has its own."""
    named_above: Callable[[str], str] = field(default=lambda header: "")
    """What to say of a header that stands in another line than those of `headings`; "": it does not."""
    as_written: Callable[[int], Column] | None = None
    """Reads a column as the texts of the file, 0017 and not 17; None: the file holds values, not texts."""

    def words(self, place: int) -> Column:
        """Column of words, such as part numbers: texts as written, else values."""
        return self.take([place])[0] if self.as_written is None else self.as_written(place)

    @property
    def where(self) -> str:
        """File and group, for messages."""
        return self.file if not self.label else f"{self.file}, group {self.label!r}"

    def listed(self) -> str:
        """All headers, for messages."""
        return ", ".join(repr(each.header) for each in self.headings) or "none"


def heading(header: Any, unit: str | None = None, origin: str = "") -> ColumnHead:
    """ColumnHead of a column, with the unit of its bracket; a `unit` given beside it comes after that."""
    text = str(header).strip()
    found = _BRACKET.fullmatch(text)
    if found is None:
        return ColumnHead(text, text, unit, origin if unit is not None else "")
    inside = found["square"] if found["square"] is not None else found["round"]
    name = found["name"]
    if found["square"] is None and not is_unit(inside):
        return ColumnHead(text, name, unit, origin if unit is not None else "")  # words in parentheses
    if unit is not None and _differ(unit, inside):
        return ColumnHead(text, name, f"{unit_of(inside)} or {unit}", f"bracket and {origin}")
    return ColumnHead(text, name, unit_of(inside), "bracket")


def _differ(one: str, other: str) -> bool:
    """Whether two texts are different units, none of them that of a pure number."""
    if not (is_unit(one) and is_unit(other)) or "1" in (unit_of(one), unit_of(other)):
        return False
    return parse(unit_of(one)) != parse(unit_of(other))


def unit_of(text: str) -> str:
    """Text of a unit without blanks and brackets; a dash is a pure number."""
    bare = text.strip().strip("[]").strip()
    bare = bare[1:-1] if bare.startswith("(") and bare.endswith(")") else bare
    return "1" if bare in _NO_UNIT else bare[:_LONGEST]


def is_unit(text: str) -> bool:
    """Whether a cell is a unit, or says that there is none."""
    try:
        parse(unit_of(text))
    except ValueError:
        return False
    return True


def too_long(file: str, rows: int) -> None:
    """Refuse more than `ROWS_MAX` rows."""
    if rows > ROWS_MAX:
        raise ValueError(
            f"{file} must have at most {ROWS_MAX:.0e} rows; got {rows}: read a piece of it, "
            f"read(pandas.read_csv({file!r}, nrows={ROWS_MAX // 10}), ...), or every n-th row"
        )


def as_column(values: Any) -> Column:
    """Values as numbers, of spans of time in s, as texts or time stamps."""
    array = np.asarray(values)
    if array.dtype.kind in "biu":
        return array.astype(float)
    if array.dtype.kind == "f":
        return np.where(np.isfinite(array), array, np.nan).astype(float, copy=False)
    if array.dtype.kind == "M":
        return array.astype("datetime64[ns]")
    if array.dtype.kind == "m":
        return array / np.timedelta64(1, "s")
    texts = [each.decode("utf-8", "replace") if isinstance(each, bytes) else each for each in array.tolist()]
    return np.array(texts, dtype=object)
