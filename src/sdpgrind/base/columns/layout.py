"""Layout of a text: separator, decimal sign, first and last line of data, names and units."""

import re
from collections import Counter
from collections.abc import Collection, Sequence
from itertools import pairwise
from typing import NamedTuple

from sdpgrind.base.columns import cells
from sdpgrind.base.columns.lines import Text
from sdpgrind.base.columns.sheet import ColumnHead, TextLayout, heading, is_unit, unit_of

SEPARATORS = (";", "\t", ",", "|", " ")
_FOOT = 5  # chosen: a longer foot is a second table
_COMMENT = re.compile(r"^(?:#+ *|(?:%+|//) +)")
_ABOVE, _BELOW = re.compile(r"[+-]?[1-9]\d{0,2}(?:[.,]\d{3})+"), re.compile(r"[+-]?[1-9]\d{0,2}")


class Frame(NamedTuple):
    """Where the data of a text are, from line `first` to before line `last` (from 0), and headings."""

    layout: TextLayout
    width: int
    first: int
    last: int
    headings: tuple[ColumnHead, ...]


class _Guess(NamedTuple):
    separator: str
    decimal: str
    rows: Sequence[Sequence[str]]
    kinds: Sequence[str]
    run: Sequence[int]  # lines of the run with most numbers
    told: tuple[int, int]  # numbers in it, and words less than none
    grouped: int  # numbers of it that stand in groups of three

    @property
    def width(self) -> int:
        return len(self.kinds[self.run[0]])


def frame_of(text: Text, missing: Collection[str] = ()) -> Frame:
    """Find the table of a text; `missing` are further words for nothing."""
    told, lines = _told_separator(text.head)
    separators = [told] if told else _present(lines)
    best, twin = _best(text, lines, separators, missing)
    if twin is not None and (twin.told, twin.grouped) == (best.told, best.grouped):
        lines = [*lines, *text.with_commas]  # whole numbers so far
        best, twin = _best(text, lines, (best.separator,), missing)
    _refuse_two_meanings(text.file, best, twin)
    numeric = _numeric(best)
    first = _first(lines, best, numeric)
    last = _end(text, best, numeric, first)
    headings = _headings(lines, best, first)
    layout = TextLayout(text.encoding, best.separator, best.decimal, first + 1, first, len(text) - last)
    return Frame(layout, best.width, first, last, headings)


def _best(
    text: Text, lines: Sequence[str], separators: Sequence[str], missing: Collection[str]
) -> tuple[_Guess, _Guess | None]:
    """The guess with most numbers, and the one with its separator and the other decimal sign."""
    quoted = any('"' in line for line in lines)
    guesses = [
        guess
        for separator in separators
        for decimal in ".,"
        if (separator != decimal or quoted)
        and (guess := _guess(lines, separator, decimal, missing)) is not None
    ]
    if not guesses:
        raise ValueError(
            f"{text.file} must hold rows of at least two cells with numbers; none is among its first"
            f" {len(lines)} lines"
        )
    best = _fitting(text.file, lines, guesses)
    others = (g for g in guesses if g.separator == best.separator and g.decimal != best.decimal)
    return best, next(others, None)


def _fitting(file: str, lines: Sequence[str], guesses: Sequence[_Guess]) -> _Guess:
    """The guess with most numbers, unless the names above fit only another; two that fit are refused.

    ``1,5 100,0`` is 1, 5100 and 0 between commas, or 1.5 and 100 between blanks.
    """

    def rank(guess: _Guess) -> tuple[tuple[int, int], int]:
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


def _rivals(guess: _Guess, most: _Guess) -> bool:
    """Whether another separator reads as many lines with no more words and no more groups of three."""
    as_sure = guess.told[1] >= most.told[1] and guess.grouped <= most.grouped
    return guess.separator != most.separator and len(guess.run) >= len(most.run) and as_sure


def _has_names(lines: Sequence[str], guess: _Guess) -> bool:
    """Whether each column has a name; a count of rows without one and a lone bracket have none."""
    headings = _headings(lines, guess, _first(lines, guess, _numeric(guess)))
    return bool(headings) and all(each.name for each in headings)


def _readings(guess: _Guess) -> str:
    """Numbers of the run as a text, in which NaN equals NaN."""
    return repr([[cells.number(cell, guess.decimal) for cell in guess.rows[k]] for k in guess.run])


def _two_layouts(file: str, lines: Sequence[str], one: _Guess, other: _Guess) -> ValueError:
    """Refusal of a text that two separators read, each with names for all columns."""
    calls = [
        f"hwsim.Log.read(pandas.read_csv({file!r}, sep={each.separator.replace(' ', '[ ]+')!r},"
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


def _guess(lines: Sequence[str], separator: str, decimal: str, missing: Collection[str]) -> _Guess | None:
    """What the lines are with this separator and decimal sign; None: no row of two cells with a number."""
    if separator == " " and any(map(cells.has_stamp, lines)):
        return None  # the blank between a date and its time separates nothing
    rows = [cells.split(line, separator) if line.strip() else [] for line in lines]
    kinds = ["".join("e" if c in missing else cells.kind(c, decimal) for c in row) for row in rows]
    runs: list[list[int]] = [[]]
    for k, each in enumerate(kinds):
        if not rows[k]:
            continue
        if runs[-1] and len(kinds[runs[-1][-1]]) != len(each):
            runs.append([])
        if len(each) >= 2 and ("n" in each or "g" in each or "t" in each):
            runs[-1].append(k)
        elif runs[-1]:
            runs.append([])
    counts = [Counter("".join(kinds[k] for k in run)) for run in runs]
    numeric = [count["n"] + count["g"] + count["t"] for count in counts]
    best = max(range(len(runs)), key=lambda k: numeric[k])
    if not runs[best]:
        return None
    told = numeric[best], -counts[best]["w"]
    return _Guess(separator, decimal, rows, kinds, runs[best], told, counts[best]["g"])


def _refuse_two_meanings(file: str, best: _Guess, twin: _Guess | None) -> None:
    """Refuse numbers such as 1,234 that may be decimals or groups of three.

    A comma between ``;`` and a point are decimals, unless numbers beside them in the column are whole.
    """
    if twin is None or twin.told != best.told or not twin.grouped:
        return
    usual = best.decimal == "." or best.separator == ";"
    if usual and not any(map(_is_grouped, zip(*(twin.rows[k] for k in twin.run), strict=True))):
        return
    cell = next(cell for k in twin.run for cell in twin.rows[k] if cells.kind(cell, twin.decimal) == "g")
    sign = best.decimal
    raise ValueError(
        f"{file} must show its decimal sign; {cell!r} may be {cell.replace(sign, '.')} or"
        f" {cell.replace(sign, '')}: hwsim.Log.read(pandas.read_csv({file!r}, sep={best.separator!r},"
        " decimal=... or thousands=...), ...)"
    )


def _is_grouped(column: Sequence[str]) -> bool:
    """Whether a column holds groups of three above 1000 and whole numbers below, and no other number."""
    above = {cell for cell in column if _ABOVE.fullmatch(cell)}
    below = {cell for cell in column if _BELOW.fullmatch(cell)}
    others = any(cell.strip("+-0") for cell in set(column) - above - below)
    return len(above) > 1 and bool(below) and not others


def _numeric(guess: _Guess) -> list[bool]:
    """Columns that hold numbers or times in most rows of the run."""
    columns = [Counter(column) for column in zip(*(guess.kinds[k] for k in guess.run), strict=True)]
    return [c["n"] + c["g"] + c["t"] > c["w"] for c in columns]


def _first(lines: Sequence[str], guess: _Guess, numeric: Sequence[bool]) -> int:
    """First row of data: below a line of names where there is one, so that no row above a fault is lost."""
    data = [k for k, each in enumerate(guess.kinds) if _is_data(each, numeric)]
    named = [k for k in data if _is_named(lines, guess, k)]
    if not named:  # a word in the first row is a fault of that row
        wide = [k for k, each in enumerate(guess.kinds) if len(each) == guess.width and k < guess.run[-1]]
        named = [k for k in wide if set(guess.kinds[k]) & set("ngt") and _is_named(lines, guess, k)]
    return (named or data or guess.run)[0]


def _is_named(lines: Sequence[str], guess: _Guess, line: int) -> bool:
    """Whether the line above, of the width of the data, holds words and no number but units."""
    above = next((k for k in range(line - 1, -1, -1) if lines[k].strip()), None)
    names = None if above is None else _names(lines[above], guess)
    if names is None or _is_numbers(names, guess):
        return False
    return any(cells.kind(cell, guess.decimal) == "w" for cell in names)


def _is_numbers(row: Sequence[str], guess: _Guess) -> bool:
    """Whether a cell is a number other than 1, which may be a unit."""
    return any(cell != "1" and cells.kind(cell, guess.decimal) in "ngt" for cell in row)


def _is_data(kinds: str, numeric: Sequence[bool]) -> bool:
    """Whether a row has the width of the data and no word in a column of numbers."""
    words = len(kinds) != len(numeric) or any(k == "w" for k, yes in zip(kinds, numeric, strict=True) if yes)
    return not words and any(k in "ngt" for k in kinds)


def _end(text: Text, guess: _Guess, numeric: Sequence[bool], first: int) -> int:
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


def _is_cut_off(guess: _Guess, numeric: Sequence[bool], row: Sequence[str], kinds: str) -> bool:
    """Whether a last row without an end of line lacks cells, or ends where no other row does."""
    if len(row) != guess.width:
        return (numeric[0] and kinds[:1] in ("n", "t")) or _is_alike(row, kinds, numeric)
    open_end = numeric[-1] and (not row[-1] or row[-1][-1] in (guess.decimal, "-", "+", "e", "E"))
    return open_end and not any(guess.rows[k][-1][-1:] == row[-1][-1:] for k in guess.run[:-1])


def _above_blanks(text: Text, end: int) -> int:
    while end and not text.line(end - 1).strip(" \t\r;,|"):
        end -= 1
    return end


def _headings(lines: Sequence[str], guess: _Guess, first: int) -> tuple[ColumnHead, ...]:
    """Headings from the line of names above the data, and a row of units between."""
    above = [k for k in range(first) if lines[k].strip()]
    rows = [_names(lines[k], guess) for k in reversed(above[-2:])]
    if not rows or rows[0] is None:
        return ()
    beside = rows[1] if len(rows) > 1 else None
    if beside is not None and all(map(is_unit, rows[0])) and any(map(str.strip, rows[0])):
        return tuple(
            heading(name, unit_of(unit) if name else None, "unit row")
            for name, unit in zip(beside, rows[0], strict=True)
        )
    return tuple(map(heading, rows[0]))


def _names(line: str, guess: _Guess) -> list[str] | None:
    """Names of a line for each column of the data; None: it has another number of cells."""
    line = _COMMENT.sub("", line.strip("\r\n") if guess.separator != " " else line.strip())
    named = [cell.strip() for cell in cells.split(line, guess.separator)]
    if guess.separator == " " and len(named) > guess.width:
        named = _joined(line, guess.width)
    if len(named) == guess.width + 1 and named[-1].lower() in ("", "comment"):
        named = named[:-1]
    if len(named) == guess.width - 1 and all(guess.kinds[k][-1] == "e" for k in guess.run):
        named = [*named, ""]
    if len(named) == guess.width - 1 and _counts_rows(guess):
        named = ["", *named]
    return named if len(named) == guess.width else None


def _counts_rows(guess: _Guess) -> bool:
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
