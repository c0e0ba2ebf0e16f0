"""Points from text (.xyz, .csv) and from NumPy's .npy."""

import io
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sdpgrind.base import unit_text
from sdpgrind.base.checks import Floats

_NAMED = re.compile(r"^\s*\"?\s*([^\[\(\"]*?)\s*(?:[\[\(]([^\]\)]*)[\]\)])?\s*\"?\s*$")
XYZ = ("x", "y", "z")


class _Layout(NamedTuple):
    """Separator (None: blanks), columns of x, y and z, factors to mm, line of the first row from 0."""

    separator: str | None
    columns: tuple[int, ...]
    factors: tuple[float, ...]
    first: int


def read_text(raw: bytes, told: str) -> Floats:
    """Read points (m, 3), mm, of a text: three numbers a line, or columns x, y and z with names and units."""
    try:
        lines = raw.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise ValueError(f"{told} must be a text of numbers, x y z (mm), in UTF-8") from None
    rows = [k for k, line in enumerate(lines) if _bare(line)]
    if not rows:
        raise ValueError(f"{told} must hold points, a line x y z each (mm); got none")
    layout = _layout(_bare(lines[rows[0]]), rows, told)
    values = [_values(lines[k], layout, told, k + 1) for k in rows if k >= layout.first]
    return np.array(values).reshape(-1, 3) * layout.factors


def _bare(line: str) -> str:
    """A line without comment."""
    return line.partition("#")[0].partition("//")[0].strip()


def _layout(first: str, rows: Sequence[int], told: str) -> _Layout:
    """Tell separator and columns from the first line that is no comment."""
    separator = next((each for each in (";", "\t", ",") if each in first), None)
    cells = first.split(separator)
    if all(map(_is_number, cells)):
        return _Layout(separator, (0, 1, 2), (1.0, 1.0, 1.0), rows[0])
    found = [_NAMED.match(cell) for cell in cells]
    names = [each[1].lower() if each else "" for each in found]
    missing = [name for name in XYZ if names.count(name) != 1]
    if missing:
        raise ValueError(f"{told} must have columns x, y and z, each once, or numbers only; got {first!r}")
    columns = tuple(names.index(name) for name in XYZ)
    units = [(each[2] if each else None) or "mm" for each in (found[k] for k in columns)]
    factors = [_factor(unit, f"{told}, column {name}") for name, unit in zip(XYZ, units, strict=True)]
    return _Layout(separator, columns, tuple(factors), rows[0] + 1)


def _factor(unit: str, told: str) -> float:
    try:
        return unit_text.factor(unit, "mm")
    except ValueError as error:
        raise ValueError(f"{told}: its unit must be {error}") from None


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _values(line: str, layout: _Layout, told: str, number: int) -> list[float]:
    """Three numbers of a line; a decimal comma is one where commas do not separate."""
    text = _bare(line) if layout.separator == "," else _bare(line).replace(",", ".")
    cells = text.split(layout.separator)
    try:
        return [float(cells[k]) for k in layout.columns]
    except (ValueError, IndexError):
        raise ValueError(f"{told}, line {number} must hold three numbers, x y z (mm); got {line!r}") from None


def read_array(raw: bytes, told: str) -> Floats:
    """Read points of a file of NumPy."""
    try:
        return np.asarray(np.load(io.BytesIO(raw), allow_pickle=False), dtype=float)
    except (ValueError, TypeError, EOFError, OSError) as error:
        raise ValueError(f"{told} must be an array of NumPy, whole; got {error}") from None
