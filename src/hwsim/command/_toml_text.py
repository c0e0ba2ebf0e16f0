"""Text of a TOML file, bounded before any parser sees it: size, encoding, nesting, long keys and numbers."""

import codecs
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

_BYTES = 2**20  # chosen: a hundred times the largest job of the examples
_DEPTH = 32  # brackets in brackets, parts of a key; chosen: ten times what a job needs, far below a stack
_DIGITS = 64  # in a row; chosen: four times what a float holds
_KEYS = 10_000  # chosen: a hundred times the largest job of the examples
_BESIDE = re.compile(
    r""""{3}(?:[^"\\]|\\.|"(?!""))*+(?:"{3})?|'{3}(?:[^']|'(?!''))*+(?:'{3})?"""
    r"""|"(?:[^"\\\n]|\\.)*+"?|'[^'\n]*+'?|#[^\n]*+""",
    re.DOTALL,
)
"""Strings and comments; one that is not closed ends with its line or the file: nothing is read twice."""
_LONG_KEY = re.compile(rf"""(?<![\w"'-])[\w"'-]++(?:\s*+\.\s*+[\w"'-]++){{{_DEPTH}}}""")
_LONG_NUMBER = re.compile(rf"\d[\d_]{{{_DIGITS}}}")
_WIDE = {
    codecs.BOM_UTF32_LE: "UTF-32",
    codecs.BOM_UTF32_BE: "UTF-32",
    codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}


def read(path: Path) -> str:
    """Return the text of a file within the bounds; ValueError names what is beyond them, with its line."""
    with path.open("rb") as file:
        raw = file.read(_BYTES + 1)
    if len(raw) > _BYTES:
        raise ValueError(f"{path}: a job must have at most {_BYTES} bytes")
    text = _decoded(path, raw)
    if fault := _beyond(text):
        raise ValueError(f"{path}: {fault}")
    return text.replace("\r\n", "\n")


def _decoded(path: Path, raw: bytes) -> str:
    for mark, name in _WIDE.items():
        if raw.startswith(mark):
            raise ValueError(f"{path}: a job must be written in UTF-8; this file is {name}")
    if (zero := raw.find(0)) >= 0:
        raise ValueError(f"{path}: line {raw.count(10, 0, zero) + 1} has a byte 0: this is no text in UTF-8")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(10, 0, error.start) + 1
        raise ValueError(f"{path}: line {line} is not UTF-8: byte 0x{raw[error.start]:02x}") from None


def _beyond(text: str) -> str:
    """What is beyond the bounds, "": nothing."""
    if found := _LONG_NUMBER.search(text):
        return f"line {_line(text, found.start())} has a number of more than {_DIGITS} digits"
    bare = _BESIDE.sub(lambda found: '""' + "\n" * found[0].count("\n"), text)
    if found := _LONG_KEY.search(bare):
        return f"line {_line(bare, found.start())} has a key of more than {_DEPTH} parts"
    depth = 0
    for found in re.finditer(r"[][{}]", bare):
        depth += 1 if found[0] in "[{" else -1
        if depth > _DEPTH:
            return f"line {_line(bare, found.start())} has brackets nested deeper than {_DEPTH}"
    return ""


def _line(text: str, place: int) -> int:
    return text.count("\n", 0, place) + 1


def refuse_many_keys(path: Path, entries: Mapping[str, Any]) -> None:
    """Refuse a file of more keys than any job has."""
    if (count := _count(entries)) > _KEYS:
        raise ValueError(f"{path}: a job must have at most {_KEYS} keys; got {count}")


def _count(value: Any) -> int:
    if isinstance(value, Mapping):
        return len(value) + sum(map(_count, value.values()))
    return sum(map(_count, value)) if isinstance(value, list) else 0
