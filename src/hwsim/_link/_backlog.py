"""Records that wait, in order: the first of them in memory, what is behind them in a temporary file."""

import struct
import tempfile
import weakref
from collections import deque
from typing import IO

_LENGTH = struct.Struct("!Q")
NEAR = 4096  # records in memory: 40 s of a controller of 100 Hz


class Backlog:
    """A queue of bytes that needs no more memory the longer it grows; the file is gone when the process ends."""

    def __init__(self) -> None:
        self._near: deque[bytes] = deque()
        self._far: IO[bytes] | None = None
        self._read = self._behind = 0  # where in the file the next begins, how many are there

    def __len__(self) -> int:
        return len(self._near) + self._behind

    def __getitem__(self, place: int) -> bytes:
        return self._near[place]

    def append(self, record: bytes) -> None:
        """Put a record behind all others."""
        if len(self._near) < NEAR and not self._behind:
            self._near.append(record)
            return
        if self._far is None:
            self._far = tempfile.TemporaryFile(prefix="hwsim-")  # noqa: SIM115
            weakref.finalize(self, self._far.close)
        self._far.seek(0, 2)
        self._far.write(_LENGTH.pack(len(record)) + record)
        self._behind += 1

    def popleft(self) -> bytes:
        """Take the first record away."""
        record = self._near.popleft()
        if self._far is not None and self._behind:
            self._near.append(self._fetched(self._far))
        return record

    def _fetched(self, far: IO[bytes]) -> bytes:
        """The next record of the file; an emptied file begins anew."""
        far.seek(self._read)
        (length,) = _LENGTH.unpack(far.read(_LENGTH.size))
        record = far.read(length)
        self._read += _LENGTH.size + length
        self._behind -= 1
        if not self._behind:
            self._read = 0
            far.truncate(0)
        return record
