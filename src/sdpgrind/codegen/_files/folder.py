"""Folders that appear complete or not at all."""

import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from sdpgrind.base.whole_files import durable


def check_free(path: Path, overwrite: bool) -> None:
    """Refuse a path that exists with other content, unless it may be overwritten."""
    if path.exists() and not path.is_dir():
        raise ValueError(f"path must be a folder, or not exist yet; got the file {os.fspath(path)!r}")
    if not path.resolve().parent.is_dir():
        raise FileNotFoundError(f"path must lie in an existing folder; got {os.fspath(path)!r}")
    foreign = path.exists() and any(path.iterdir()) and not (path / "manifest.json").exists()
    if foreign:
        raise ValueError(f"path must be the folder of an export, or be empty; got {os.fspath(path)!r}")


def write_folder(path: Path, files: Mapping[str, bytes], overwrite: bool) -> None:
    """Write all files of a folder beside it and move it there; the same content stays as it is."""
    check_free(path, overwrite)
    if path.is_dir() and any(path.iterdir()):
        if _content(path) == dict(files):
            return
        if not overwrite:
            told = f"overwrite must be True where path holds another export; got {os.fspath(path)!r}"
            raise FileExistsError(told)
    target = path.resolve()
    made = Path(tempfile.mkdtemp(prefix=f".{target.name[:100]}.", suffix=".part", dir=target.parent))
    try:
        made.chmod(0o755)
        for name, content in files.items():
            (made / name).write_bytes(content)
            durable(made / name)
        _swap(made, target)
    finally:
        shutil.rmtree(made, ignore_errors=True)


def _swap(made: Path, target: Path) -> None:
    """Put the new folder in place of the old one; keep that until the new one stands."""
    if not target.exists():
        made.rename(target)
        return
    old = made.with_suffix(".old")
    target.rename(old)
    try:
        made.rename(target)
    except OSError:
        old.rename(target)
        raise
    shutil.rmtree(old)


def _content(path: Path) -> dict[str, bytes]:
    return {one.name: one.read_bytes() for one in path.iterdir() if one.is_file()}
