"""Digest in the file of a plan or a log, over all its bytes: written last, checked before any parser reads.

Two attributes tell it: ``format = 2`` and ``integrity = "blake2b-256:"`` with 64 hexadecimal digits. The
digest is BLAKE2b-256 of the file with these digits as "0". It shows damage, not forgery: who can write the
file can write its digest.
"""

from enum import Enum
from hashlib import blake2b

FORMAT = 2  # chosen: files of version 0.1.0 have none, which is 1
"""Number of the format that has a digest."""
MARK = b"blake2b-256:"
"""What stands before the digits; once in a file."""
_DIGITS = 64  # derived: hexadecimal digits of 256 bits
_BLANK = b"0" * _DIGITS
BLANK_ATTRIBUTE = (MARK + _BLANK).decode()
"""Value of the attribute ``integrity`` before the digest is known."""
# the attribute ``format = 2`` in a file; source: NetCDF 3: length, name in steps of 4 bytes, type 4 (integer
# of 32 bits), one value, big-endian
_FORMAT_BYTES = b"\0\0\0\x06format\0\0" + b"\0\0\0\x04" + b"\0\0\0\x01" + FORMAT.to_bytes(4, "big")


class Verdict(Enum):
    """What the bytes of a file tell."""

    WHOLE = "as it was written"
    WRONG = "its digest is not that of its bytes"
    ILLEGIBLE = "its digest cannot be read"
    UNSEALED = "without a digest"


def verdict(raw: bytes) -> Verdict:
    """Judge the bytes of a file, whatever they are."""
    start = raw.find(MARK)
    if start < 0:
        return Verdict.ILLEGIBLE if _FORMAT_BYTES in raw else Verdict.UNSEALED
    start += len(MARK)
    told = raw[start : start + _DIGITS]
    return Verdict.WHOLE if told == _digest(raw, start) else Verdict.WRONG


def sealed(raw: bytes) -> tuple[memoryview, bytes, memoryview]:
    """Pieces of a file, written one after the other, with its digest in place of the zeros.

    Raises
    ------
    ValueError
        When the mark stands in the file more than once: a text of the user holds it.
    """
    start = raw.find(MARK) + len(MARK)
    if raw.find(MARK, start) >= 0:
        count = raw.count(MARK) - 1
        raise ValueError(f"no text to be saved must hold {MARK.decode()!r}; it stands in {count} places")
    view = memoryview(raw)
    return view[:start], _digest(raw, start), view[start + _DIGITS :]


def _digest(raw: bytes, start: int) -> bytes:
    """Digits of the digest of all bytes, those from `start` on taken as zeros."""
    state = blake2b(digest_size=_DIGITS // 2)
    with memoryview(raw) as view:
        for piece in (view[:start], _BLANK, view[start + _DIGITS :]):
            state.update(piece)
    return state.hexdigest().encode()
