"""Lines anywhere in a text that tell its decimal sign: numbers with a sign, and whole ones beside them."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Bools
from sdpgrind.base.columns.lines import Text

_BLOCK = 1 << 22  # bytes; chosen: 4 MB, most texts decide within the first
_NEWLINE, _QUOTE, _ZERO, _NINE = b'\n"09'
_SIGNS = b".,"
_START, _END = b" \t\n\r\"'+-", b" \t\n\r\"'eE"  # before and behind the digits of a number
_WIDE = range(0x80, 0x100)  # blanks between groups of three that are not ASCII


class _Marks(NamedTuple):
    """Letters other than digits of some lines: place, letter, line and cell of each, first letter behind."""

    place: npt.NDArray[np.int64]
    letter: npt.NDArray[np.uint8]
    line: npt.NDArray[np.int64]
    cell: npt.NDArray[np.int64]
    lead: npt.NDArray[np.uint8]

    @property
    def digits(self) -> npt.NDArray[np.int64]:
        """Number of digits up to the next mark."""
        return np.diff(self.place) - 1


def telling_lines(text: Text, separator: str) -> list[str]:
    """Lines below the head that tell the decimal sign; without such, the first of each kind and column.

    Kinds are numbers that may be in groups of three, as 1.250, and whole numbers.
    """
    known: dict[tuple[str, int], int] = {}
    for first, block in _blocks(text):
        marks = _marks(block, first, separator)
        deciding, grouped = _signed(marks, separator)
        if np.any(deciding):
            return [text.line(line) for line in _firsts(marks, deciding).values()]
        for kind, chosen in (("grouped", grouped), *_whole(marks, separator)):
            for cell, line in _firsts(marks, chosen).items():
                known.setdefault((kind, cell), line)
    return [text.line(line) for line in sorted(set(known.values()))]


def has_sign(text: Text, separator: str) -> bool:
    """Whether a point or a comma other than the separator stands below the head."""
    signs = (sign for sign in (b".", b",") if sign != separator.encode() or b'"' in text.data)
    return any(text.data.find(sign, text.begin(len(text.head))) >= 0 for sign in signs)


def _blocks(text: Text) -> Iterator[tuple[int, bytes]]:
    """Lines below the head in pieces, each with its first line and between two ends of lines."""
    line = len(text.head)
    while line < len(text):
        begin = text.begin(line)
        last = min(int(np.searchsorted(text.ends, begin + _BLOCK)), len(text) - 1)
        yield line, b"\n" + text.data[begin : int(text.ends[last])] + b"\n"
        line = last + 1


def _marks(block: bytes, first: int, separator: str) -> _Marks:
    letters = np.frombuffer(block, np.uint8)
    place = np.flatnonzero((letters < _ZERO) | (letters > _NINE))
    letter = letters[place]
    newline = letter == _NEWLINE
    ends = letter == ord(separator)
    if separator == " ":
        ends = np.isin(letter, np.frombuffer(b" \t", np.uint8))
        ends &= ~((np.diff(place, prepend=-2) == 1) & np.concatenate([[False], (ends | newline)[:-1]]))
    count = np.cumsum(ends)
    begun = np.maximum.accumulate(np.where(newline, np.arange(place.size), 0))
    lead = letters[np.minimum(place + 1, letters.size - 1)]
    return _Marks(place, letter, first + np.cumsum(newline) - 1, count - count[begun], lead)


def _among(letters: npt.NDArray[np.uint8], *known: bytes | range) -> Bools:
    table = np.zeros(256, bool)
    for each in known:
        table[list(each)] = True
    return table[letters]


def _signed(marks: _Marks, separator: str) -> tuple[Bools, Bools]:
    """Marks that are signs of numbers which can be read in one way only, and of such as 1.250."""
    cut = separator.encode()
    sign = np.zeros(marks.place.size, bool)
    inner = slice(1, -1)
    before, behind = marks.digits[:-1], marks.digits[1:]
    letter, last, following = marks.letter[inner], marks.letter[:-2], marks.letter[2:]
    sign[inner] = _among(letter, _SIGNS) & (before + behind > 0)
    quoted = (following == _QUOTE) & (before > 0) & (behind > 0)
    sign[inner] &= (letter != ord(separator)) | quoted
    begun = _among(last, _START, cut, _WIDE)
    ended = _among(following, _END, cut, _WIDE)
    threes = (behind == 3) & (before > 0) & (before <= 3) & (marks.lead[:-2] != _ZERO)
    another = _among(following, bytes(set(_SIGNS) - set(cut)))
    deciding, grouped = sign.copy(), sign.copy()
    deciding[inner] &= begun & ((ended & ~threes) | (another & threes))
    grouped[inner] &= begun & ended & threes
    return deciding, grouped


def _whole(marks: _Marks, separator: str) -> Iterator[tuple[str, Bools]]:
    """Marks before whole numbers below and above 1000."""
    cut, digits = separator.encode(), np.append(marks.digits, 0)
    ended = np.append(_among(marks.letter[1:], _END, cut, _WIDE), False)
    number = _among(marks.letter, _START, cut, _WIDE) & ended & (marks.lead != _ZERO)
    yield "below", number & (digits > 0) & (digits <= 3)
    yield "above", number & (digits > 3)


def _firsts(marks: _Marks, chosen: Bools) -> dict[int, int]:
    """First line of each cell that holds one of the chosen marks."""
    places = np.flatnonzero(chosen)[::-1]
    line = np.full(int(marks.cell.max(initial=0)) + 1, -1)
    line[marks.cell[places]] = marks.line[places]  # of several the last counts: the first in the text
    return {cell: int(line[cell]) for cell in np.flatnonzero(line >= 0).tolist()}
