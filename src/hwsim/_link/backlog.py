"""Queue of records that may be longer than the memory."""

import struct
import tempfile
import weakref
from collections import deque
from typing import IO

_LENGTH = struct.Struct("!Q")  # length of a record in the file
NEAR = 4096  # records in memory; chosen: 40 s of a controller of 100 Hz


class Backlog:
    """Queue of records: the first in memory, the others in a temporary file that ends with the process."""

    def __init__(self) -> None:
        self._near: deque[bytes] = deque()
        self._far: IO[bytes] | None = None
        self._read = self._behind = 0  # position of the next record in the file, bytes; records there

    def __len__(self) -> int:
        return len(self._near) + self._behind

    def __getitem__(self, place: int) -> bytes:
        return self._near[place]

    def append(self, record: bytes) -> None:
        """Append a record."""
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
        """Remove and return the first record."""
        record = self._near.popleft()
        if self._far is not None and self._behind:
            self._near.append(self._fetched(self._far))
        return record

    def _fetched(self, far: IO[bytes]) -> bytes:
        """Read the next record from the file; truncate the file once it is empty."""
        far.seek(self._read)
        (length,) = _LENGTH.unpack(far.read(_LENGTH.size))
        record = far.read(length)
        self._read += _LENGTH.size + length
        self._behind -= 1
        if not self._behind:
            self._read = 0
            far.truncate(0)
        return record
