"""Archives of FMUs: the same files give the same bytes, written whole."""

import contextlib
import io
import os
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from sdpgrind.base.whole_files import whole_file
from sdpgrind.codegen._files.folder import check_home, listed

_DATE = (1980, 1, 1, 0, 0, 0)  # source: the first date that the format has
_UNIX, _MODE = 3, 0o100644  # source: PKWARE's note on the format, 4.4.2; a file that its owner may write
_DESCRIPTION, _MANIFEST = "modelDescription.xml", "resources/manifest.json"


def packed(files: Mapping[str, bytes]) -> bytes:
    """Return an archive of files, by path: sorted, without dates and owners."""
    kept = io.BytesIO()
    with zipfile.ZipFile(kept, "w") as archive:
        for path, content in sorted(files.items()):
            entry = zipfile.ZipInfo(path, _DATE)
            entry.create_system, entry.external_attr = _UNIX, _MODE << 16
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED, 9)
    return kept.getvalue()


def check_free(path: Path, overwrite: bool) -> None:
    """Refuse a path that is no FMU, or that exists with other content."""
    shown = repr(os.fspath(path))
    if path.suffix != ".fmu":
        raise ValueError(f"path must end in .fmu for target='fmi2'; got {shown}")
    check_home(path)
    if path.exists():
        _check_unit(path, shown)


def write_archive(path: Path, files: Mapping[str, bytes], overwrite: bool) -> None:
    """Write an FMU; the same content stays as it is."""
    check_free(path, overwrite)
    content = packed(files)
    if path.exists():
        if path.read_bytes() == content:
            return
        if not overwrite:
            told = f"overwrite must be True where path holds another export; got {os.fspath(path)!r}"
            raise FileExistsError(told)
    path.resolve().parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


def _check_unit(path: Path, shown: str) -> None:
    """Refuse what is no FMU, one of another maker, and one to which files were added: they would be lost."""
    if not path.is_file() or not zipfile.is_zipfile(path):
        raise ValueError(f"path must be an FMU, or not exist yet; got {shown}")
    with zipfile.ZipFile(path) as archive:
        names = {one for one in archive.namelist() if not one.endswith("/")}
        ours = listed(archive.read(_MANIFEST)) if _MANIFEST in names else set()
    if _DESCRIPTION not in names:
        raise ValueError(f"path must be an FMU, or not exist yet; got {shown}")
    if not ours:
        rule = f"it has no {_MANIFEST} of an export, and would be lost: choose another path"
        raise ValueError(
            f"path must be an FMU that sdpgrind.export wrote, or not exist yet; got {shown}: {rule}"
        )
    if strange := sorted(names - ours - {_MANIFEST}):
        raise ValueError(
            f"path must be an FMU with nothing but an export; {shown} also holds {', '.join(strange)}, not in"
            f" its {_MANIFEST}: choose another path"
        )


@contextlib.contextmanager
def export_folder(path: Path) -> Iterator[Path]:
    """Give the folder of an export in C: `path` itself, or what an FMU holds, in a temporary folder."""
    if path.is_dir():
        yield path
        return
    with tempfile.TemporaryDirectory() as kept:
        with zipfile.ZipFile(path) as archive:
            for name in archive.namelist():
                if name.startswith(("sources/", "resources/")) and ".." not in Path(name).parts:
                    file = Path(kept, name.partition("/")[2])
                    file.parent.mkdir(exist_ok=True, parents=True)
                    file.write_bytes(archive.read(name))
        yield Path(kept)
