"""Cells of a text: numbers with either decimal sign and groups of three, words for nothing, stamps."""

import contextlib
import csv
import re
from collections.abc import Collection, Iterable
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats

NOTHING = frozenset(
    [
        "",
        "nan",
        "na",
        "n/a",
        "#n/a",
        "null",
        "none",
        "-",
        "--",
        "---",
        "inf",
        "+inf",
        "-inf",
        "infinity",
        "-infinity",
        "1.#qnan",
        "-1.#qnan",
        "1.#ind",
        "-1.#ind",
        "1.#inf",
        "-1.#inf",
        "1,#qnan",
        "#div/0!",
        "#wert!",
        "#value!",
    ]
)
"""Words for nothing, in small letters."""
TRUTHS = {"true": 1.0, "false": 0.0}
_SPACES = str.maketrans("\u2212", "-", "\u00a0\u202f\u2009")
_MARK = re.compile(r"[ '\u2019]")
_THREES = re.compile(rf"(?<=\d){_MARK.pattern}(?=\d{{3}}(?!\d))")
"""Blanks and apostrophes between groups of three digits."""
_NO_GROUPS = re.compile(r"[+-]?0\d*[ '\u2019]")  # the first group of a number above 999 is not zero
_TIME = re.compile(
    r"(?:\d{4}[-/]\d{1,2}[-/]\d{1,2}|\d{1,2}[./]\d{1,2}[./]\d{4})(?:[T ]\s*\d{1,2}:\d{2}.*)?"
    r"|\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?"
)
_STAMP = re.compile(r"\d[-/.]\d{1,4} \d{1,2}:\d{2}")
_PLAIN = {
    sign: re.compile(rf"[+-]?(?:\d+{re.escape(sign)}?\d*|{re.escape(sign)}\d+)(?:[eE][+-]?\d+)?")
    for sign in ".,"
}
_GROUPED = {
    ".": re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?"),
    ",": re.compile(r"[+-]?[1-9]\d{0,2}(?:\.\d{3})+(?:,\d*)?"),
}


def split(line: str, separator: str) -> list[str]:
    """Cells of a line; blanks of any number are one separator, quotes are taken away."""
    if separator == " ":
        return [cell.strip('"') for cell in re.split(r"[ \t]+", line.strip(" \t\r\n"))]
    row = line.rstrip("\r\n").split(separator)
    if '"' in line:
        with contextlib.suppress(csv.Error):  # a field of more than 128 kB is no cell
            row = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip() for cell in row]


def has_stamp(line: str) -> bool:
    """Whether a date and a time of day stand in a line with a blank between."""
    return _STAMP.search(line) is not None


def kind(cell: str, decimal: str) -> str:
    """n: number, g: number in groups of three, t: time, e: empty or a word for nothing, w: another word."""
    plain = _PLAIN[decimal].fullmatch
    if plain(cell) or plain(bare := _bare(cell)):  # most cells are numbers as they stand
        return "n"
    if bare.lower() in NOTHING:
        return "e"
    if _GROUPED[decimal].fullmatch(bare):
        return "g"
    return "t" if _TIME.fullmatch(cell) else "w"


def _bare(cell: str) -> str:
    """A cell without the marks between groups of three, which are no decimal sign."""
    plain = cell if cell.isascii() else cell.translate(_SPACES)
    if not _MARK.search(plain) or _NO_GROUPS.match(plain):
        return plain
    return _THREES.sub("", plain)


def number(cell: str, decimal: str, missing: Collection[str] = ()) -> float | None:
    """Return the number of a cell, NaN for nothing, None for another word."""
    bare = own = cell.strip()
    plain = _PLAIN[decimal].fullmatch
    if plain(own) or plain(bare := _bare(own)):
        return float(bare.replace(",", "."))
    if own in missing or bare.lower() in NOTHING:
        return float("nan")
    if _GROUPED[decimal].fullmatch(bare):
        return float(bare.replace("." if decimal == "," else ",", "").replace(",", "."))
    return TRUTHS.get(bare.lower())


def numbers(
    cells: Iterable[object], decimal: str, missing: Collection[str] = ()
) -> tuple[Floats, int | None]:
    """Numbers of cells, and the place of the first that is a word (None: there is none)."""
    known: dict[object, float] = {}
    values: list[float] = []
    for place, cell in enumerate(cells):
        value = known.get(cell)
        if value is None:
            found = _value(cell, decimal, missing)
            if found is None:
                return np.array(values), place
            value = known[cell] = found
        values.append(value)
    return np.array(values, dtype=float), None


def _value(cell: Any, decimal: str, missing: Collection[str]) -> float | None:
    if isinstance(cell, str):
        return number(cell, decimal, missing)
    if cell is None or type(cell).__name__ in ("NAType", "NaTType"):
        return float("nan")
    try:
        value = float(cell)
    except (TypeError, ValueError):
        return None
    return value if np.isfinite(value) else float("nan")
