"""Files that appear complete or not at all, and what killed processes left of them."""

import contextlib
import glob
import os
import re
import secrets
import shutil
import socket
import stat
from collections.abc import Iterator
from pathlib import Path

from sdpgrind.base import checks

_NAME = 100  # characters of the name that a temporary file keeps; chosen: with the rest below the usual 255
_OWNER = re.compile(r"\..+\.(\d+)@([\w-]+)\.\w+\.(?:part|old)")
"""Name of a temporary file or folder: of the target, process, computer, and what makes it unique."""


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path next to `path`, renamed to `path` when the block succeeds.

    A file that is replaced keeps its mode; a new one has the mode that `open` gives.
    """
    target = checks.path("path", path).resolve()  # a link stays one
    if target.exists() and not target.is_file():
        raise ValueError(f"path must be a file; got {os.fspath(path)!r}")
    if not target.parent.is_dir():
        raise FileNotFoundError(f"path must lie in an existing folder; got {str(target)!r}")
    mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else None
    temporary = _made_beside(target, private=mode is not None)
    try:
        yield temporary
        durable(temporary)
        if mode is not None:
            temporary.chmod(mode)  # last: a file that is read only is not opened any more
        temporary.replace(target)
        durable(target.parent)
    except OSError as error:
        if error.filename is None:  # as of a disk that is full
            error.filename = str(target)
        raise
    finally:
        temporary.unlink(missing_ok=True)


def _computer() -> str:
    return re.sub(r"[^\w-]", "-", socket.gethostname())


def _made_beside(target: Path, *, private: bool) -> Path:
    """Make an empty file; the system takes the process's umask, which no thread need change, from its mode.

    `private`: only its owner reads it while it is written.
    """
    path = beside(target)
    os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600 if private else 0o666))
    return path


def beside(target: Path) -> Path:
    """Return a name of its own for what is written beside a file or folder, and tells whose it is."""
    unique = secrets.token_hex(8)  # chosen: as good as never twice
    return target.with_name(f".{target.name[:_NAME]}.{os.getpid()}@{_computer()}.{unique}.part")


def durable(path: Path) -> None:
    """Have the operating system write a file, or what stands in a folder, to the disk."""
    folder = path.is_dir()
    if folder and os.name == "nt":  # Windows keeps folders by itself and opens none
        return
    handle = os.open(path, os.O_RDONLY if folder else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def remove_leftovers(folder: Path, name: str = "") -> None:
    """Remove temporary files and folders in a folder whose process, of this computer, is dead.

    `name`: only those that were written beside the file or folder of this name.
    """
    for one in left_over(folder, name, "part"):
        if one.is_dir() and not one.is_symlink():
            shutil.rmtree(one, ignore_errors=True)
        else:
            one.unlink(missing_ok=True)


def left_over(folder: Path, name: str, ending: str) -> list[Path]:
    """Return what dead processes of this computer left beside `name` (any: ""), with an ending."""
    mark = f".{glob.escape(name[:_NAME])}." if name else "."
    found = []
    for one in folder.glob(f"{mark}*.{ending}"):
        owner = _OWNER.fullmatch(one.name)
        of_it = not name or one.name.count(".") == name[:_NAME].count(".") + 4
        if owner and of_it and owner[2] == _computer() and not _lives(int(owner[1])):
            found.append(one)
    return found


def _lives(process: int) -> bool:
    if os.name == "nt":  # where a signal of 0 would end the process
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # of another user
        return True
    return True
