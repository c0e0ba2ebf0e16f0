"""Points from text (.xyz, .csv) and from NumPy's .npy."""

import io
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sdpgrind.base import checks, unit_text
from sdpgrind.base.checks import Floats

_NAMED = re.compile(r"^\s*\"?\s*([^\[\(\"]*?)\s*(?:[\[\(]([^\]\)]*)[\]\)])?\s*\"?\s*$")
_POINT = re.compile(r"[.eE]")
XYZ = ("x", "y", "z")
COMMAS = ": where commas are decimal signs, separate by semicolons or blanks"


SEPARATORS = (";", "\t", ",", None)


class _Layout(NamedTuple):
    """Separator (None: blanks), cells a line, columns of x, y and z, their units or "", lines of names."""

    separator: str | None
    width: int
    columns: tuple[int, ...]
    units: tuple[str, ...]
    first: int


def read_text(raw: bytes, told: str, unit: str | None) -> Floats:
    """Read points (m, 3), mm, of a text: three numbers a line, or columns x, y and z with names and units.

    `unit`: of numbers for which the text names none; None: mm.
    """
    try:
        lines = raw.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise ValueError(f"{told} must be a text of numbers, x y z (mm), in UTF-8") from None
    rows = [k for k, line in enumerate(lines) if _bare(line)]
    if not rows:
        raise ValueError(f"{told} must hold points, a line x y z each (mm); got none")
    bare = [_bare(lines[k]) for k in rows]
    layout = _layout(bare[0], told)
    body = bare[layout.first :]
    values = [_values(line, layout, told, k + 1) for line, k in zip(body, rows[layout.first :], strict=True)]
    _refuse_two_meanings(body, layout, told)
    return np.array(values).reshape(-1, 3) * _factors(layout, unit, told)


def _bare(line: str) -> str:
    """A line without comment."""
    return line.partition("#")[0].partition("//")[0].strip()


def _layout(first: str, told: str) -> _Layout:
    """Tell separator and columns from the first line that is no comment."""
    present = [each for each in SEPARATORS if each is None or each in first]
    for separator in present:
        cells = first.split(separator)
        if len(cells) > 2 and all(_is_number(cell, separator) for cell in cells):
            return _Layout(separator, len(cells), (0, 1, 2), ("", "", ""), 0)
    cells = first.split(present[0])
    found = [_NAMED.match(cell) for cell in cells]
    names = [each[1].lower() if each else "" for each in found]
    missing = [name for name in XYZ if names.count(name) != 1]
    if missing:
        raise ValueError(f"{told} must have columns x, y and z, each once, or numbers only; got {first!r}")
    columns = tuple(names.index(name) for name in XYZ)
    units = tuple((each[2] if each else None) or "" for each in (found[k] for k in columns))
    return _Layout(present[0], len(cells), columns, units, 1)


def _factors(layout: _Layout, unit: str | None, told: str) -> list[float]:
    """Factors to mm of x, y and z."""
    if unit is not None and any(layout.units):
        raise checks.refuse("unit", f"None, as {told} names its own", unit)
    return [
        _factor(own or unit or "mm", f"{told}, column {name}")
        for name, own in zip(XYZ, layout.units, strict=True)
    ]


def _factor(unit: str, told: str) -> float:
    try:
        return unit_text.factor(unit, "mm")
    except ValueError as error:
        raise ValueError(f"{told} must {error}") from None


def _number(cell: str, separator: str | None) -> float:
    """A number; a comma is a decimal sign where it does not separate."""
    return float(cell if separator == "," else cell.replace(",", "."))


def _is_number(cell: str, separator: str | None) -> bool:
    try:
        _number(cell, separator)
    except ValueError:
        return False
    return True


def _values(line: str, layout: _Layout, told: str, number: int) -> list[float]:
    """Three numbers of a line; none of a line of names."""
    cells = line.split(layout.separator)
    if len(cells) != layout.width:
        raise ValueError(
            f"{told}, line {number} must hold {layout.width} cells as the first one does; got {len(cells)}:"
            f" {line!r}{COMMAS if layout.separator == ',' else ''}"
        )
    try:
        return [_number(cells[k], layout.separator) for k in layout.columns]
    except ValueError:
        raise ValueError(f"{told}, line {number} must hold three numbers, x y z (mm); got {line!r}") from None


def _refuse_two_meanings(lines: Sequence[str], layout: _Layout, told: str) -> None:
    """Refuse 0,5,0,25,1,0, which may be six whole numbers or three between decimal commas."""
    named = layout.first > 0
    if layout.separator == "," and not named and layout.width % 2 == 0 and not any(map(_POINT.search, lines)):
        raise ValueError(f"{told} must show its decimal sign; {lines[0]!r} has none but commas{COMMAS}")


def read_array(raw: bytes, told: str, unit: str | None) -> Floats:
    """Read points of a file of NumPy, in a unit (None: mm), mm."""
    try:
        found = np.asarray(np.load(io.BytesIO(raw), allow_pickle=False), dtype=float)
    except (ValueError, TypeError, EOFError, OSError) as error:
        raise ValueError(f"{told} must be an array of NumPy, whole; got {error}") from None
    return found * factor_to_mm(unit)


def factor_to_mm(unit: str | None) -> float:
    """Return the factor from a unit of length to mm; None: 1."""
    try:
        return unit_text.factor("mm" if unit is None else unit, "mm")
    except (ValueError, TypeError) as error:
        raise ValueError(f"unit: numbers of a scan must {error}") from None
