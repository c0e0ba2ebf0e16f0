"""Texts as sheets: pandas parses what `layout` has found."""

import io
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base.columns import cells
from sdpgrind.base.columns.layout import Frame, frame_of, other_width
from sdpgrind.base.columns.lines import Text
from sdpgrind.base.columns.sheet import Column, Sheet, as_column, heading

if TYPE_CHECKING:
    import pandas as pd

_EXACT = (3, 1)  # source: version of pandas from which its parser rounds correctly by default
_BLOCK = 1 << 24  # bytes; chosen: 16 MB, smaller ones take longer
ENDINGS = (".csv", ".tsv", ".txt", ".dat", ".log", ".prn", ".lvm", ".asc")


def count_of_lines(path: Path) -> int:
    """Number of lines of a file, without holding it in memory."""
    with path.open("rb") as file:
        return sum(block.count(b"\n") for block in iter(lambda: file.read(_BLOCK), b""))


def sheets(file: str, raw: bytes, missing: Collection[str] = ()) -> list[Sheet]:
    """Return the table of a text as a sheet."""
    text = Text(file, raw)
    frame = frame_of(text, missing)
    if not frame.headings:
        raise ValueError(
            f"{file} must have a line of {frame.width} names above its data, which begin in line"
            f" {frame.first + 1}:"
            f" read(pandas.read_csv({file!r}, header=None, names=[...]), ...)"
        )
    _refuse_other_widths(text, frame)

    def take(wanted: Sequence[int]) -> list[Column]:
        table = _parsed(text, frame, wanted, missing)
        return [as_column(_values(table[str(k)])) for k in wanted]

    def as_written(place: int) -> Column:
        if place == 0:
            _refuse_words_below(text, frame)
        return _texts(_parsed(text, frame, [place], missing, dtype=str)[str(place)])

    return [
        Sheet(
            file,
            frame.headings,
            take,
            named_above=lambda header: _named_above(text, frame, header),
            as_written=as_written,
            place=lambda row: f"line {_line_of(text, frame, row) + 1}",
            layout=frame.layout,
            decimal=frame.layout.decimal,
        )
    ]


def _named_above(text: Text, frame: Frame, header: str) -> str:
    """The call that takes names from a line above another one of words, as a row of data types."""
    layout, above = frame.layout, range(frame.first)
    rows = [cells.split(text.line(line), layout.separator) for line in above]
    named = (k for k in reversed(above) if len(rows[k]) >= frame.width)
    line = next(
        (k for k in named if header in [each for cell in rows[k] for each in heading(cell)[:2]]), None
    )
    if line is None or not header:
        return ""
    return (
        f"; line {line + 1} has it: read(pandas.read_csv({text.file!r}, sep={layout.separator!r},"
        f" decimal={layout.decimal!r}, skiprows=[k for k in range({frame.first}) if k != {line}]), ...)"
    )


def _refuse_words_below(text: Text, frame: Frame) -> None:
    """Refuse lines right below the data that may be a foot, or rows of a part with a word for a number."""
    layout = frame.layout
    row = cells.split(text.line(frame.last), layout.separator) if frame.last < len(text) else [""]
    told = any(cells.kind(cell, layout.decimal) in "ngt" for cell in row[1:])
    if row[0] and told and len(row) == frame.width:
        words = f"{{{frame.headings[0].header!r}: str}}"
        options = f"sep={layout.separator!r}, decimal={layout.decimal!r}, dtype={words}"
        raise ValueError(
            f"{text.file} must end with its rows where its first column names the parts; line"
            f" {frame.last + 1} begins with {row[0]!r}, as a line of sums may: take such lines away, or, if"
            f" they are rows, read(pandas.read_csv({text.file!r}, {options}), ...)"
        )


def _line_of(text: Text, frame: Frame, row: int) -> int:
    """Line (from 0) of a row of data; blank lines are no rows."""
    lines = (line for line in range(frame.first, frame.last) if text.line(line).strip())
    return next(line for k, line in enumerate(lines) if k == row)


def _refuse_other_widths(text: Text, frame: Frame) -> None:
    """Refuse a row with more or fewer cells than the others."""
    begin, end = text.begin(frame.first), int(text.ends[frame.last - 1])
    separator = frame.layout.separator
    if text.data.find(b'"', begin, end) >= 0:
        widths = (len(cells.split(line, separator)) for line in _lines(text, frame))
        bad = next((k for k, width in enumerate(widths) if width != frame.width), None)
        if bad is not None:
            raise other_width(text, frame.width, separator, _line_of(text, frame, bad))
        return
    letters = np.frombuffer(text.data, np.uint8, end - begin, begin)
    found = np.flatnonzero(_after_blanks(letters) if separator == " " else letters == ord(separator)) + begin
    counts = np.diff(np.searchsorted(found, text.ends[frame.first : frame.last]), prepend=0)
    for line in np.flatnonzero(counts != frame.width - (separator != " ")) + frame.first:
        if text.line(int(line)).strip():
            raise other_width(text, frame.width, separator, int(line))


def _after_blanks(letters: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
    """First letters of cells that blanks keep apart."""
    blank = np.isin(letters, np.frombuffer(b" \t\r\n", np.uint8))
    return np.asarray(~blank & np.concatenate([[True], blank[:-1]]))


def _lines(text: Text, frame: Frame) -> list[str]:
    whole = text.data[text.begin(frame.first) : int(text.ends[frame.last - 1])].decode("utf-8")
    return [line for line in whole.split("\n") if line.strip()]


def _parsed(
    text: Text, frame: Frame, wanted: Sequence[int], missing: Collection[str], dtype: type | None = None
) -> "pd.DataFrame":
    """The wanted columns by their places: numbers where all cells are such, else texts; `dtype`: of all."""
    import pandas as pd

    body = text.data[text.begin(frame.first) : int(text.ends[frame.last - 1])]
    layout = frame.layout
    options: dict[str, Any] = {
        "sep": r"\s+" if layout.separator == " " else layout.separator,
        "decimal": layout.decimal,
        "na_values": [*_spellings(), *missing],
        "keep_default_na": False,
        "skipinitialspace": layout.separator != " ",
        "low_memory": False,
        "encoding": "utf-8",
        "dtype": dtype,
    }
    if tuple(map(int, pd.__version__.split(".")[:2])) < _EXACT:
        options["float_precision"] = "round_trip"
    names = [str(k) for k in range(frame.width)]
    only = [names[k] for k in dict.fromkeys(wanted)]
    try:
        table: pd.DataFrame = pd.read_csv(
            io.BytesIO(body), header=None, names=names, usecols=only, index_col=False, **options
        )
    except (ValueError, pd.errors.ParserError) as error:
        words = re.sub(r"\s+", " ", str(error))
        raise ValueError(
            f"{text.file} cannot be read as a table from line {frame.first + 1} on: {words}"
        ) from None
    if b'"' in body and len(table) != (rows := _rows(body, layout.separator)):
        raise ValueError(
            f"{text.file} must close each quote in its line; its {rows} lines of data are {len(table)} rows"
        )
    return table


def _rows(body: bytes, separator: str) -> int:
    """Number of lines that the parser takes for rows."""
    none = " \t\r" if separator == " " else " \r"
    return sum(bool(line.strip(none)) for line in body.decode("utf-8").split("\n"))


def _values(series: Any) -> Any:
    """Values of a pandas column: numbers, truths as 1 and 0, stamps, or texts with None for nothing."""
    return series.to_numpy() if series.dtype.kind in "biufM" else _texts(series)


def _texts(series: "pd.Series") -> Column:
    """Texts of a pandas column, None for nothing."""
    return np.array([None if each != each else each for each in series.tolist()], dtype=object)


def _spellings() -> list[str]:
    """Words for nothing as files write them."""
    return [form for word in sorted(cells.NOTHING) for form in {word, word.upper(), word.capitalize()}] + [
        "NaN"
    ]
