"""Bounds of a TOML file, checked before and after its parser: what a job needs is far below them.

The parser of the standard library recurses in brackets and in the parts of keys, and numbers have any length.
"""

import re
from pathlib import Path
from typing import Any

_BYTES = 1 << 20  # chosen: the largest example has 2 kB
_DEEP = 32  # brackets in each other, parts of a key; chosen: a job has 4 of each
_DIGITS = 64  # chosen: a float has 17
_KEYS = 10_000  # chosen: the largest example has 60
_PIECES = 200_000  # words, signs and ends of lines; chosen: 60 000 numbers in a list; the parser takes 0.5 s
_WIDE = (
    (b"\xff\xfe\0\0", "UTF-32"),
    (b"\xff\xfe", "UTF-16"),
    (b"\xfe\xff", "UTF-16"),
    (b"\0\0\xfe\xff", "UTF-32"),
)
# texts in quotes (perhaps without an end), comments, brackets, the rest
_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"{3,5}|\Z)'
    r"|'''.*?(?:'{3,5}|\Z)"
    r'|"(?:\\.|[^"\\\n])*"?'
    r"|'[^'\n]*'?"
    r"|\#[^\n]*"
    r"|[\[\]{}=,\n.]"
    r"|\\"
    r"|[^\"'\#\[\]{}=,\n.\\]+",
    re.DOTALL,
)
_LONG = re.compile(rf"(?:\d_?){{{_DIGITS + 1}}}|0[xob][\da-fA-F_]{{{_DIGITS + 1}}}")


def text_of(path: Path) -> str:
    """Return the text of a TOML file that the parser may see.

    Raises
    ------
    ValueError
        When the file is longer than 1 MiB, no UTF-8, nested deeper than 32, has a key of more than 32 parts,
        more than 64 digits in a row, or more than 200 000 pieces.
    """
    with path.open("rb") as file:
        raw = file.read(_BYTES + 1)
    if len(raw) > _BYTES:
        raise ValueError(f"the file must have at most {_BYTES} bytes (1 MiB)")
    text = _decoded(raw)
    _refuse_deep(text)
    return text


def _decoded(raw: bytes) -> str:
    for mark, name in _WIDE:
        if raw.startswith(mark):
            raise ValueError(f"the file must be in UTF-8; it is in {name}")
    if (place := raw.find(b"\0")) >= 0:
        raise ValueError(f"the file must be a text in UTF-8; byte {place} is NUL")
    try:
        return raw.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        told = f"byte {error.start} is {raw[error.start]:#04x}"
        raise ValueError(f"the file must be in UTF-8; {told}, which is none there") from None


def _refuse_deep(text: str) -> None:
    """Count pieces, and brackets, parts of keys and digits outside of texts in quotes and comments."""
    depth, parts, line = 0, 1, 1
    for count, found in enumerate(_TOKEN.finditer(text)):
        token = found[0]
        if count >= _PIECES:
            raise ValueError(
                f"line {line}: up to here the file has {_PIECES} words and signs; no job needs more"
            )
        depth = max(0, depth + (token in "[{") - (token in "]}"))
        parts = parts + 1 if token == "." else 1 if token in "[]{}=,\n" else parts
        if depth > _DEEP:
            raise ValueError(f"line {line}: brackets must be nested at most {_DEEP} deep")
        if parts > _DEEP:
            raise ValueError(f"line {line}: a key must have at most {_DEEP} parts")
        if token[0] not in "\"'#" and _LONG.search(token):
            raise ValueError(f"line {line}: a number must have at most {_DIGITS} digits in a row")
        line += token.count("\n")


def refuse_many(entries: dict[str, Any]) -> None:
    """Refuse more than 10 000 keys."""
    count, waiting = 0, [entries]
    while waiting:
        table = waiting.pop()
        count += len(table)
        for value in table.values():
            waiting += _tables(value)
    if count > _KEYS:
        raise ValueError(f"the file must have at most {_KEYS} keys; it has {count}")


def _tables(value: Any) -> list[dict[str, Any]]:
    """Tables in a value: itself, or those of an array in arrays."""
    if isinstance(value, dict):
        return [value]
    return [table for each in value for table in _tables(each)] if isinstance(value, list) else []
