"""Layout of a text: separator, decimal sign, first and last line of data, names and units."""

import re
from collections.abc import Collection, Sequence
from typing import NamedTuple

from sdpgrind.base.columns import cells
from sdpgrind.base.columns.guess import TextGuess, guess_of, numeric_columns
from sdpgrind.base.columns.headings import first_row, headings_of
from sdpgrind.base.columns.lines import Text
from sdpgrind.base.columns.sheet import ColumnHead, TextLayout
from sdpgrind.base.columns.signs import has_sign, telling_lines

SEPARATORS = (";", "\t", ",", "|", " ")
_NO_SEPARATOR = "\x1f"  # chosen: the unit separator of ASCII, which stands in no table
_ROWS = 8  # chosen: numbers alone in a line that are a column
_FOOT = 5  # chosen: a longer foot is a second table
_ABOVE, _BELOW = re.compile(r"[+-]?[1-9]\d{0,2}(?:[.,]\d{3})+"), re.compile(r"[+-]?[1-9]\d{0,2}")


class Frame(NamedTuple):
    """Where the data of a text are, from line `first` to before line `last` (from 0), and headings."""

    layout: TextLayout
    width: int
    first: int
    last: int
    headings: tuple[ColumnHead, ...]


def frame_of(text: Text, missing: Collection[str] = ()) -> Frame:
    """Find the table of a text; `missing` are further words for nothing."""
    told, lines = _told_separator(text.head)
    separators = [told] if told else _present(lines)
    best, twin = _best(text, lines, separators, missing)
    if twin is not None and twin.told == best.told:
        best = _told_by_all(text, lines, best, twin, missing)
    numeric = numeric_columns(best)
    first = first_row(lines, best, numeric)
    last = _end(text, best, numeric, first)
    headings = headings_of(lines, best, first)
    layout = TextLayout(text.encoding, best.separator, best.decimal, first + 1, first, len(text) - last)
    return Frame(layout, best.width, first, last, headings)


def _best(
    text: Text, lines: Sequence[str], separators: Sequence[str], missing: Collection[str]
) -> tuple[TextGuess, TextGuess | None]:
    """The guess with most numbers, and the one with its separator and the other decimal sign."""
    quoted = any('"' in line for line in lines)
    guesses = [
        guess
        for separator in separators
        for decimal in ".,"
        if (separator != decimal or quoted)
        and (guess := guess_of(lines, separator, decimal, missing)) is not None
    ]
    if not guesses and (alone := _one_column(lines, missing)) is not None:
        return alone, None
    if not guesses:
        raise ValueError(
            f"{text.file} must hold rows of at least two cells with numbers; none is among its first"
            f" {len(lines)} lines"
        )
    best = _fitting(text.file, lines, guesses)
    others = (g for g in guesses if g.separator == best.separator and g.decimal != best.decimal)
    return best, next(others, None)


def _one_column(lines: Sequence[str], missing: Collection[str]) -> TextGuess | None:
    """The guess of a single column, of rows enough that they are no text; a comma would separate two."""
    found = guess_of(lines, _NO_SEPARATOR, ".", missing, cells_least=1)
    return found if found is not None and len(found.run) >= _ROWS else None


def _fitting(file: str, lines: Sequence[str], guesses: Sequence[TextGuess]) -> TextGuess:
    """The guess with most numbers, unless the names above fit only another; two that fit are refused.

    ``1,5 100,0`` is 1, 5100 and 0 between commas, or 1.5 and 100 between blanks.
    """

    def rank(guess: TextGuess) -> tuple[tuple[int, int], int]:
        return guess.told, -guess.grouped

    most = max(guesses, key=rank)  # of equals the first
    rivals = [guess for guess in guesses if _rivals(guess, most) and _has_names(lines, guess)]
    if not rivals:
        return most
    other = max(rivals, key=rank)
    if not _has_names(lines, most):
        return other
    if not other.told[1] and _readings(most) != _readings(other):
        raise _two_layouts(file, lines, most, other)
    return most


def _rivals(guess: TextGuess, most: TextGuess) -> bool:
    """Whether another separator reads as many lines with no more words and no more groups of three."""
    as_sure = guess.told[1] >= most.told[1] and guess.grouped <= most.grouped
    return guess.separator != most.separator and len(guess.run) >= len(most.run) and as_sure


def _has_names(lines: Sequence[str], guess: TextGuess) -> bool:
    """Whether each column has a name; a count of rows without one and a lone bracket have none.

    Names without a letter are data: ``0,0 0,0`` is no number between commas.
    """
    headings = headings_of(lines, guess, first_row(lines, guess, numeric_columns(guess)))
    letters = any(map(str.isalpha, "".join(each.name for each in headings)))
    return letters and all(each.name for each in headings)


def _readings(guess: TextGuess) -> str:
    """Numbers of the run as a text, in which NaN equals NaN; without a last column that is empty in all rows.

    A tab that ends each row, as before the comments of LabVIEW, is a blank that separates nothing.
    """
    rows = [guess.rows[k] for k in guess.run]
    if not any(row[-1] for row in rows):
        rows = [row[:-1] for row in rows]
    return repr([[cells.number(cell, guess.decimal) for cell in row] for row in rows])


def _two_layouts(file: str, lines: Sequence[str], one: TextGuess, other: TextGuess) -> ValueError:
    """Refusal of a text that two separators read, each with names for all columns."""
    calls = [
        f"read(pandas.read_csv({file!r}, sep={each.separator.replace(' ', '[ ]+')!r},"
        f" decimal={each.decimal!r}), ...)"
        for each in (one, other)
    ]
    return ValueError(
        f"{file} must show its separator; {lines[one.run[0]].strip()[:80]!r} may be {one.width} cells or"
        f" {other.width}: {' or '.join(calls)}"
    )


def _present(lines: Sequence[str]) -> list[str]:
    """Separators that stand in the lines; a tab may be a blank."""
    return [
        each for each in SEPARATORS if any(each in line or (each == " " and "\t" in line) for line in lines)
    ]


def _told_separator(lines: Sequence[str]) -> tuple[str, list[str]]:
    """Separator of a line ``sep=;``, "": none; and the lines with that one emptied."""
    start = lines[0].strip().strip('"')
    if start.lower().startswith("sep=") and len(start) in (4, 5):
        return start[4:] or "\t", ["", *lines[1:]]
    return "", list(lines)


def _told_by_all(
    text: Text, lines: Sequence[str], best: TextGuess, twin: TextGuess, missing: Collection[str]
) -> TextGuess:
    """The one of two guesses, of equal decimals in the head, that the whole text tells."""
    if not twin.grouped and not has_sign(text, best.separator):
        return best  # whole numbers
    told = [*lines, *telling_lines(text, best.separator)]
    whole, other = _best(text, told, (best.separator,), missing)
    _refuse_two_meanings(text.file, whole, other)
    return best if best.decimal == whole.decimal else twin


def _refuse_two_meanings(file: str, best: TextGuess, twin: TextGuess | None) -> None:
    """Refuse numbers such as 1,234 that may be decimals or groups of three.

    A comma between ``;`` and a point are decimals, unless numbers beside them in the column are whole, or
    the other sign is there as well.
    """
    if twin is None or twin.told != best.told or not twin.grouped:
        return
    usual = not best.grouped and (best.decimal == "." or best.separator == ";")
    if usual and not any(map(_is_grouped, zip(*(twin.rows[k] for k in twin.run), strict=True))):
        return
    cell = next(cell for k in twin.run for cell in twin.rows[k] if cells.kind(cell, twin.decimal) == "g")
    sign = best.decimal
    separator = best.separator.replace(" ", "[ ]+")
    calls = [
        f"read(pandas.read_csv({file!r}, sep={separator!r}, decimal={each.decimal!r},"
        f" thousands={other.decimal!r}), ...)"
        for each, other in ((best, twin), (twin, best))
    ]
    raise ValueError(
        f"{file} must show its decimal sign; {cell!r} may be {cell.replace(sign, '.')} or"
        f" {cell.replace(sign, '')}: {' or '.join(calls)}"
    )


def _is_grouped(column: Sequence[str]) -> bool:
    """Whether a column holds groups of three above 1000 and whole numbers below, and no other number."""
    above = {cell for cell in column if _ABOVE.fullmatch(cell)}
    below = {cell for cell in column if _BELOW.fullmatch(cell)}
    others = any(cell.strip("+-0") for cell in set(column) - above - below)
    return bool(above) and bool(below) and not others


def _end(text: Text, guess: TextGuess, numeric: Sequence[bool], first: int) -> int:
    """First line below the data: of blank lines, or of a foot that has another width or begins with a word.

    A word elsewhere in a row is a fault of the row, and so is a row of another width that is like the data.
    """
    end = _above_blanks(text, len(text))
    lowest = max(first + 1, end - _FOOT)
    cut = -1 if text.data.endswith(b"\n") else len(text) - 1  # a line without an end
    for line in range(end - 1, lowest - 1, -1):
        row = cells.split(text.line(line), guess.separator)
        kinds = "".join(cells.kind(cell, guess.decimal) for cell in row)
        if line == cut and _is_cut_off(guess, numeric, row, kinds):
            raise ValueError(
                f"{text.file} must be whole; line {line + 1}, its last, has {sum(map(bool, row))} cells"
                f" instead of {guess.width} and no end: {text.line(line)!r}"
            )
        if len(row) == guess.width:
            told = numeric[0] and kinds[0] == "w" and not row[0][0].isdigit()
            if set(kinds) & set("ngt") and not told:
                return line + 1
        elif _is_alike(row, kinds, numeric):
            raise other_width(text, guess.width, guess.separator, line)
    return _above_blanks(text, lowest)


def other_width(text: Text, width: int, separator: str, line: int) -> ValueError:
    """Refusal of a row with more or fewer cells than the others."""
    count = len(cells.split(text.line(line), separator))
    return ValueError(
        f"{text.file} must have {width} cells in each row; line {line + 1} has {count}:"
        f" {text.line(line)[:80]!r}"
    )


def _is_alike(row: Sequence[str], kinds: str, numeric: Sequence[bool]) -> bool:
    """Whether cells are numbers and words as in the data, as far as they go: two, below words three."""
    both = [
        (kind in "ngt" or cell[0].isdigit(), yes)
        for cell, kind, yes in zip(row, kinds, numeric, strict=False)
        if cell
    ]
    return len(both) >= (2 if numeric[0] else 3) and all(told == yes for told, yes in both)


def _is_cut_off(guess: TextGuess, numeric: Sequence[bool], row: Sequence[str], kinds: str) -> bool:
    """Whether a last row without an end of line lacks cells, or ends where no other row does."""
    if len(row) != guess.width:
        return (numeric[0] and kinds[:1] in ("n", "t")) or _is_alike(row, kinds, numeric)
    if numeric[0] and kinds[0] == "w":  # as "Mean" of a foot
        return False
    open_end = numeric[-1] and (not row[-1] or row[-1][-1] in (guess.decimal, "-", "+", "e", "E"))
    return open_end and not any(guess.rows[k][-1][-1:] == row[-1][-1:] for k in guess.run[:-1])


def _above_blanks(text: Text, end: int) -> int:
    while end and not text.line(end - 1).strip(" \t\r;,|"):
        end -= 1
    return end
