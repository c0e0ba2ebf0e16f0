"""One writer a folder: a file that the operating system locks, so that death releases it."""

import contextlib
import errno
import os
import socket
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

NAME: Final = "run.lock"


_TAKEN: Final = (errno.EAGAIN, errno.EACCES, errno.EWOULDBLOCK, errno.EDEADLK)


class LockedError(OSError):
    """Another process writes to the folder."""


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder; `LockedError` names who holds it. The file is gone afterwards."""
    path = folder / NAME
    handle = _held(path)
    try:
        os.truncate(handle, 0)
        os.write(handle, f"process {os.getpid()} on {socket.gethostname()}".encode())
        yield
    finally:
        with contextlib.suppress(OSError):  # Windows removes no open file; it is found unlocked next time
            path.unlink()
        os.close(handle)


def _held(path: Path) -> int:
    """Open and lock the file that is at `path`: one that its last owner removed meanwhile does not count."""
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(handle)
            if os.path.samestat(os.fstat(handle), path.stat()):
                return handle
        except FileNotFoundError:
            pass
        except OSError as error:
            if error.errno not in _TAKEN:  # a disk without locks, say
                os.close(handle)
                raise
            owner = os.read(handle, 200).decode(errors="replace")
            os.close(handle)
            raise LockedError(f"{path.parent} is being written by {owner or 'another process'}") from None
        os.close(handle)


if sys.platform == "win32":
    import msvcrt

    def _lock(handle: int) -> None:
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(handle: int) -> None:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
