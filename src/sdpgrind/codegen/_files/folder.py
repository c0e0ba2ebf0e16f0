"""Folders that appear complete or not at all."""

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from sdpgrind.base.whole_files import beside, durable, left_over, remove_leftovers

_MANIFEST = "manifest.json"


def check_free(path: Path, overwrite: bool) -> None:
    """Refuse a path that exists with other content than an export's, whether or not that is replaced."""
    if path.exists() and not path.is_dir():
        raise ValueError(f"path must be a folder, or not exist yet; got the file {os.fspath(path)!r}")
    check_home(path)
    if path.is_dir() and any(path.iterdir()):
        _check_export(path)


def check_home(path: Path) -> None:
    """Refuse a path in which a file stands where a folder must be, or be made."""
    home = next(one for one in path.resolve().parents if one.exists())
    if not home.is_dir():
        raise NotADirectoryError(f"path must lie in a folder; {os.fspath(path)!r} lies in the file {home}")


def _check_export(path: Path) -> None:
    """Refuse a folder that is no export, or in which something stands beside it: that would be lost."""
    listed = _listed_in(path / _MANIFEST)
    if not listed:
        raise ValueError(f"path must be the folder of an export, or be empty; got {os.fspath(path)!r}")
    if strange := sorted(_strange(path, "", listed)):
        raise ValueError(
            f"path must be a folder of nothing but an export; {os.fspath(path)!r} also holds"
            f" {', '.join(strange)}, not in its {_MANIFEST}: move it elsewhere, or choose another path"
        )


def _strange(folder: Path, way: str, listed: set[str]) -> Iterator[str]:
    """Give what stands in a folder and is neither a listed file nor on the way to one."""
    for one in folder.iterdir():
        name = f"{way}{one.name}"
        if one.is_dir() and not one.is_symlink() and any(each.startswith(f"{name}/") for each in listed):
            yield from _strange(one, f"{name}/", listed)
        elif name not in listed or not one.is_file() or one.is_symlink():
            yield name


def _listed_in(file: Path) -> set[str]:
    """Return the names of the files of an export in a folder, that of the manifest too."""
    try:
        return listed(file.read_bytes())
    except OSError:
        return set()


def listed(manifest: bytes) -> set[str]:
    """Return the names of the files of an export, its manifest among them; none: it is no such manifest."""
    try:
        told: Any = json.loads(manifest)
    except ValueError:
        return set()
    ours = isinstance(told, dict) and isinstance(told.get("fingerprint"), str)
    files = told.get("files") if ours else None
    return {*files, _MANIFEST} if isinstance(files, dict) else set()


def lay_out(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files into a folder, and the folders in it that their names ask for."""
    for name, content in files.items():
        (folder / name).parent.mkdir(exist_ok=True, parents=True)
        (folder / name).write_bytes(content)


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
    target.parent.mkdir(parents=True, exist_ok=True)
    made = beside(target)
    try:
        made.mkdir()
        lay_out(made, files)
        for name in files:
            durable(made / name)
        _swap(made, target)
    finally:
        shutil.rmtree(made, ignore_errors=True)


def _swap(made: Path, target: Path) -> None:
    """Put the new folder in place of the old one; keep that until the new one stands."""
    old = made.with_suffix(".old")
    try:
        if target.exists():
            target.rename(old)
        made.rename(target)
    finally:  # also where a key is pressed between the two
        if old.exists() and not target.exists():
            old.rename(target)
    shutil.rmtree(old, ignore_errors=True)


def put_back(path: Path) -> None:
    """Undo what a process that was killed while it wrote here has left: its export is the one before."""
    target = path.resolve()
    remove_leftovers(target.parent, target.name)
    for old in left_over(target.parent, target.name, "old"):
        if target.exists():
            shutil.rmtree(old, ignore_errors=True)
        else:
            old.rename(target)


def _content(path: Path) -> dict[str, bytes]:
    files = (one for one in path.rglob("*") if one.is_file())
    return {one.relative_to(path).as_posix(): one.read_bytes() for one in files}
