"""Lines of a text in UTF-8, whatever its encoding and its ends of lines."""

import codecs
from functools import cached_property

import numpy as np

_HEAD = 200  # chosen: longer preambles are rare, and more lines cost time in wide files
_NEWLINE = ord("\n")
_ASCII = 0.7  # chosen: share of letters below 256 in a text of UTF-16; names in other scripts have fewer


class Text:
    """Lines of a file in UTF-8, found by their places."""

    def __init__(self, file: str, raw: bytes) -> None:
        self.file = file
        self.data, self.encoding = _in_utf8(file, raw)
        places = np.flatnonzero(np.frombuffer(self.data, np.uint8) == _NEWLINE)
        self.ends = (
            places if not self.data or self.data[-1] == _NEWLINE else np.append(places, len(self.data))
        )

    def __len__(self) -> int:
        return int(self.ends.size)

    def begin(self, line: int) -> int:
        """Place of the first byte of a line, counted from 0."""
        return int(self.ends[line - 1]) + 1 if line else 0

    def line(self, line: int) -> str:
        """Return a line, counted from 0."""
        return self.data[self.begin(line) : int(self.ends[line])].decode("utf-8")

    @cached_property
    def head(self) -> list[str]:
        """The first lines."""
        return [self.line(k) for k in range(min(_HEAD, len(self)))]


def _in_utf8(file: str, raw: bytes) -> tuple[bytes, str]:
    """Bytes in UTF-8 with one kind of ends of lines, and the encoding that they had."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        data, encoding = _decoded(file, raw, "utf-16").encode("utf-8"), "utf-16"
    elif b"\0" in raw:
        encoding = _wide(file, raw)
        data = _decoded(file, raw, encoding).encode("utf-8")
    elif raw.startswith(codecs.BOM_UTF8):
        data, encoding = _decoded(file, raw, "utf-8-sig").encode("utf-8"), "utf-8 with mark"
    else:
        data, encoding = raw, "utf-8"
        if not raw.isascii():
            try:
                raw.decode("utf-8")
            except UnicodeDecodeError:
                data, encoding = _decoded(file, raw, "cp1252").encode("utf-8"), "cp1252"
    if not data.strip():
        raise ValueError(f"{file} must hold a table; it is empty")
    if b"\r" in data:  # the parser takes a lone one for the end of a line, too
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data, encoding


def _wide(file: str, raw: bytes) -> str:
    """UTF-16 without a mark: each other byte is 0, as most letters of a table are ASCII."""
    zeros = np.frombuffer(raw, np.uint8) == 0
    first, second = float(zeros[::2].mean()), float(zeros[1::2].mean())
    if max(first, second) < _ASCII or min(first, second) > 0:
        raise ValueError(f"{file} must be a text; got binary bytes (a spreadsheet: pandas.read_excel)")
    return "utf-16-be" if first > second else "utf-16-le"


def _decoded(file: str, raw: bytes, encoding: str) -> str:
    try:
        return raw.decode(encoding)
    except UnicodeDecodeError as error:
        raise ValueError(f"{file} must be text in {encoding}; byte {error.start} is none of it") from None
