"""Names above a table: its first row, headings of its columns, and a row of units between."""

import re
from collections.abc import Sequence
from itertools import pairwise

from sdpgrind.base.columns import cells
from sdpgrind.base.columns.guess import TextGuess
from sdpgrind.base.columns.sheet import ColumnHead, heading, is_unit, unit_of

_OTHERS = " ,;"
"""Ends of names: separators of the line of names that are not those of the data."""
_COMMENT = re.compile(r"^(?:#+ *|(?:%+|//) +)")


def first_row(lines: Sequence[str], guess: TextGuess, numeric: Sequence[bool]) -> int:
    """First row of data: below a line of names where there is one, so that no row above a fault is lost."""
    data = [k for k, each in enumerate(guess.kinds) if _is_data(each, numeric)]
    named = [k for k in data if _is_named(lines, guess, k)]
    if not named:  # a word in the first row is a fault of that row
        wide = [k for k, each in enumerate(guess.kinds) if len(each) == guess.width and k < guess.run[-1]]
        named = [k for k in wide if set(guess.kinds[k]) & set("ngt") and _is_named(lines, guess, k)]
    return (named or data or guess.run)[0]


def _is_named(lines: Sequence[str], guess: TextGuess, line: int) -> bool:
    """Whether the line above, of the width of the data, holds words and no number but units."""
    above = next((k for k in range(line - 1, -1, -1) if lines[k].strip()), None)
    names = None if above is None else _names(lines[above], guess)
    if names is None or _is_numbers(names, guess):
        return False
    return any(cells.kind(cell, guess.decimal) == "w" for cell in names)


def _is_numbers(row: Sequence[str], guess: TextGuess) -> bool:
    """Whether a cell is a number other than 1, which may be a unit."""
    return any(cell != "1" and cells.kind(cell, guess.decimal) in "ngt" for cell in row)


def _is_data(kinds: str, numeric: Sequence[bool]) -> bool:
    """Whether a row has the width of the data and no word in a column of numbers."""
    words = len(kinds) != len(numeric) or any(k == "w" for k, yes in zip(kinds, numeric, strict=True) if yes)
    return not words and any(k in "ngt" for k in kinds)


def headings_of(lines: Sequence[str], guess: TextGuess, first: int) -> tuple[ColumnHead, ...]:
    """Headings from the line of names above the data, and a row of units between."""
    above = [k for k in range(first) if lines[k].strip()]
    rows = [_names(lines[k], guess) for k in reversed(above[-2:])]
    if not rows or rows[0] is None:
        return ()
    beside = rows[1] if len(rows) > 1 else None
    if beside is not None and _are_units(rows[0], beside, guess):
        return tuple(
            heading(name, unit_of(unit) if name else None, "unit row")
            for name, unit in zip(beside, rows[0], strict=True)
        )
    return tuple(map(heading, rows[0]))


def _are_units(row: Sequence[str], above: Sequence[str], guess: TextGuess) -> bool:
    """Whether a row below names holds units; half of them may be unknown, as bar or a misspelled one."""
    told = [(cell, name) for cell, name in zip(row, above, strict=True) if cell.strip()]
    known = sum(is_unit(cell) for cell, _ in told)
    if not told or known == len(told):
        return bool(told)
    return 2 <= known >= len(told) / 2 and all(name for _, name in told) and not _is_numbers(above, guess)


def _names(line: str, guess: TextGuess) -> list[str] | None:
    """Names of a line for each column of the data; None: it has another number of cells."""
    line = _COMMENT.sub("", line.strip("\r\n") if guess.separator != " " else line.strip())
    named = [cell.strip() for cell in cells.split(line, guess.separator)]
    if guess.separator == " " and len(named) > guess.width:
        named = _joined(line, guess.width)
    named = [cell.rstrip(_OTHERS) for cell in named]
    if len(named) == guess.width + 1 and named[-1].lower() in ("", "comment"):
        named = named[:-1]
    if len(named) == guess.width - 1 and all(guess.kinds[k][-1] == "e" for k in guess.run):
        named = [*named, ""]
    if len(named) == guess.width - 1 and _counts_rows(guess):
        named = ["", *named]
    return named if len(named) == guess.width else None


def _counts_rows(guess: TextGuess) -> bool:
    """Whether the first column is the number of the row, or words: it may lack a name.

    Commas of decimals between separating commas give one cell too many, too.
    """
    first = [guess.rows[k][0] for k in guess.run]
    if all(cell.isdigit() for cell in first):
        return all(int(b) == int(a) + 1 for a, b in pairwise(first))
    return all(guess.kinds[k][0] == "w" for k in guess.run)


def _joined(line: str, width: int) -> list[str]:
    """Names with blanks in them: cells apart by two blanks, else each bracket belongs to the word before."""
    wide = [cell.strip() for cell in line.replace("\t", "  ").split("  ") if cell.strip()]
    if len(wide) == width:
        return wide
    named: list[str] = []
    for word in line.split():
        if named and word.startswith(("[", "(")):
            named[-1] += f" {word}"
        else:
            named.append(word)
    return named
