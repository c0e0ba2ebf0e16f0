"""Records in memory that two processes share: one writes, one reads, and neither waits for the other."""

import mmap
import os
import struct
import tempfile
from hashlib import blake2b
from typing import Final

_HEAD: Final = struct.Struct("<QI16s")  # number of the record, bytes of its content, digest of all three
_DIGEST: Final = 16  # bytes; chosen: a torn record passes once in 2**128


class Slots:
    """Two places for records of one writer, used in turn: while one is written, the other is whole.

    A record that is torn, as the writer is at it or was killed, is not taken.
    """

    def __init__(self, buffer: memoryview) -> None:
        half = len(buffer) // 2
        self._slots = buffer[:half], buffer[half : 2 * half]
        self._room = half - _HEAD.size
        self._number = 0  # of the last record that was written, or read

    def write(self, content: bytes) -> None:
        """Write a record; ValueError where it is too long."""
        if len(content) > self._room:
            raise ValueError(f"a record must have <= {self._room} bytes; got {len(content)}")
        self._number += 1
        slot, end = self._slots[self._number % 2], _HEAD.size + len(content)
        slot[_HEAD.size : end] = content
        slot[: _HEAD.size] = _HEAD.pack(self._number, len(content), _digest(self._number, content))

    def read(self) -> bytes | None:
        """Return the newest whole record; None: none is newer than the last one that was returned."""
        heads = sorted(((self._head(slot), slot) for slot in self._slots), key=lambda each: -each[0][0])
        for (number, length, digest), slot in heads:
            if not (self._number < number and length <= self._room):
                continue
            content = bytes(slot[_HEAD.size : _HEAD.size + length])
            if _digest(number, content) == digest:
                self._number = number
                return content
        return None

    @staticmethod
    def _head(slot: memoryview) -> tuple[int, int, bytes]:
        number, length, digest = _HEAD.unpack(slot[: _HEAD.size])
        return number, length, digest


def _digest(number: int, content: bytes) -> bytes:
    told = number.to_bytes(8, "little")
    return blake2b(content, digest_size=_DIGEST, key=told).digest()


def shared(size: int) -> int:
    """Make a file without a name, in memory where the system can; return its descriptor."""
    if hasattr(os, "memfd_create"):
        file = os.memfd_create("hwsim-gate")
    else:
        with tempfile.TemporaryFile(prefix="hwsim-") as named:
            file = os.dup(named.fileno())
    os.ftruncate(file, size)
    return file


def mapped(file: int, size: int) -> memoryview:
    """Map the file of a descriptor."""
    return memoryview(mmap.mmap(file, size))
