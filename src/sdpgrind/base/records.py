"""Plans and logs on disk: NetCDF files, written whole with a digest, dtypes kept.

The attribute ``kind`` of a file names its content. Packages register kinds as entry points of the group
``sdpgrind.records``; `load` finds the class. No parser sees bytes whose digest is wrong.
"""

import os
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from sdpgrind.base import checks, integrity
from sdpgrind.base.damaged import DamagedFileError, OldFileWarning
from sdpgrind.base.integrity import Verdict
from sdpgrind.base.warned import warn
from sdpgrind.base.whole_files import whole_file

if TYPE_CHECKING:
    import xarray as xr

_DTYPE = "stored_dtype"
_NETCDF3 = {"int8", "int16", "int32", "float32", "float64"}
_FORMAT, _INTEGRITY = "format", "integrity"  # attributes of a file
_SQLITE = b"SQLite format 3\0"
_MAGICS = (b"CDF\x01", b"CDF\x02", _SQLITE)  # first bytes of what is saved
_LEAST_PAGE = 512  # bytes; source: file format of SQLite, 1.3.2
JOURNAL_TABLES = (
    "key TEXT PRIMARY KEY, value TEXT NOT NULL",
    "number INTEGER PRIMARY KEY, outcome TEXT NOT NULL",
)
"""Beginnings of the two tables of a journal of a run, as its file holds them: they tell a damaged one."""
_LOST = "nothing in it is certain: take a copy, or make it again (a log from the journal of its run)"


class Saved(ABC):
    """Base of objects that are saved in a file.

    `sdpgrind.load` finds the class by the kind of the file, an entry point of ``sdpgrind.records``.
    """

    @classmethod
    @abstractmethod
    def _file_kind(cls) -> str:
        """Name of the kind in files."""

    @abstractmethod
    def _written(self) -> "xr.Dataset":
        """Labelled arrays for the file."""

    @classmethod
    @abstractmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        """Return the object of a `dataset` read from a file, with its units."""

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a NetCDF file at `path`, complete or not at all, with a digest; `sdpgrind.load` reads it.

        Parameters
        ----------
        path : str or path
            File in an existing folder.
        """
        write(self._written(), path, self._file_kind())

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read a file of `save` at `path`.

        Parameters
        ----------
        path : str or path
            The file.
        """
        made: Self = _made(cls, _contents(path))
        return made


class Record(Saved):
    """Base of plans, logs and others that tell their kind."""

    kind: ClassVar[str]
    """Name of the kind in files."""

    @classmethod
    def _file_kind(cls) -> str:
        return cls.kind


def write(dataset: "xr.Dataset", path: str | os.PathLike[str], kind: str) -> None:
    """Write `dataset` to a NetCDF file at `path`, marked as `kind`, with the digest of the file."""
    from xarray.backends import ScipyDataStore

    from sdpgrind import __version__

    if taken := [name for name in (_FORMAT, _INTEGRITY) if name in dataset.attrs]:
        raise ValueError(
            f"an attribute of what is saved must not be called {taken[0]!r}, which tells the format and the "
            f"digest of the file; got {dataset.attrs[taken[0]]!r}"
        )
    portable = _each(dataset, _portable).assign_attrs(kind=kind, version=__version__)
    # the two stand at both ends of the attributes: what damages both damages much between them
    portable.attrs = {_FORMAT: integrity.FORMAT, **portable.attrs, _INTEGRITY: integrity.BLANK_ATTRIBUTE}
    plain = {name: {"_FillValue": None} for name in portable.variables}  # NaN is a value like any other
    with whole_file(path) as temporary:
        # `to_netcdf` would import dask's scheduler, where there is one, for a lock that nobody needs
        raw = _Kept()
        with ScipyDataStore(raw, mode="w", lock=False) as store:
            portable.dump_to_store(store, encoding=plain)
        with temporary.open("wb") as file:
            file.writelines(integrity.sealed(raw.content))


class _Kept(BytesIO):
    """A file in memory that keeps its content when it is closed, as some versions of xarray do."""

    _kept = b""

    @property
    def content(self) -> bytes:
        """All that was written."""
        return self._kept if self.closed else self.getvalue()

    def close(self) -> None:
        """Keep the content."""
        self._kept = self.content
        super().close()


@dataclass(frozen=True)
class _Contents:
    """What stands in a file."""

    path: Path
    kind: str
    sealed: bool
    dataset: "xr.Dataset"


def read(path: str | os.PathLike[str]) -> "xr.Dataset":
    """Read a file of `write` with its dtypes."""
    return _contents(path).dataset


def examine(path: str | os.PathLike[str]) -> tuple[str, bool]:
    """Return the kind of a plan or a log, and whether a digest says that it is as it was written."""
    contents = _contents(path, quiet=True)
    if not contents.sealed:
        with warnings.catch_warnings(action="ignore", category=OldFileWarning):
            load(path)
    return contents.kind, contents.sealed


def _contents(path: str | os.PathLike[str], *, quiet: bool = False) -> _Contents:
    """Check the bytes of a file, then parse them."""
    raw = Path(path).read_bytes()
    sealed = _sealed(path, raw)
    dataset = _parsed(path, raw) if raw.startswith(b"CDF") else None
    kind = "" if dataset is None else str(dataset.attrs.get("kind", ""))
    if dataset is None or not kind:
        raise _not_ours(path, kind)
    if sealed:
        _refuse_later(path, dataset.attrs.pop(_FORMAT, None))
        del dataset.attrs[_INTEGRITY]
    elif not quiet:
        warn_of_old(path)
    return _Contents(Path(path), kind, sealed, dataset)


def _sealed(path: str | os.PathLike[str], raw: bytes) -> bool:
    """Whether bytes have a digest; refuse damaged ones."""
    found = integrity.verdict(raw)
    if found in (Verdict.WRONG, Verdict.ILLEGIBLE):
        raise DamagedFileError(path, found.value, _LOST)
    if any(magic.startswith(raw) for magic in _MAGICS):  # an empty file, too
        raise DamagedFileError(path, f"it ends after {len(raw)} bytes", _LOST)
    return found is Verdict.WHOLE


def _refuse_later(path: str | os.PathLike[str], told: Any) -> None:
    if told != integrity.FORMAT:
        known = f"of format {integrity.FORMAT} or of version 0.1.0"
        raise ValueError(f"path must be a file {known}; {str(path)!r} is of format {told}")


def _not_ours(path: str | os.PathLike[str], kind: str) -> ValueError:
    held = kind or "none: a table or a text has no digest"
    return ValueError(f"path must be a plan, log or record saved by this library; {str(path)!r} holds {held}")


def warn_of_old(path: str | os.PathLike[str]) -> None:
    """Warn of a file of version 0.1.0."""
    warn(
        f"{str(path)!r} is of version 0.1.0 and has no digest: damage cannot be seen; save it again",
        OldFileWarning,
    )


def _parsed(path: str | os.PathLike[str], raw: bytes) -> "xr.Dataset":
    import xarray as xr

    try:
        with xr.open_dataset(
            BytesIO(raw), engine="scipy", decode_times=False, mask_and_scale=False
        ) as opened:
            return _each(opened.load(), _restored)
    except Exception as error:  # whatever a parser finds in a damaged file of version 0.1.0
        raise DamagedFileError(path, f"it cannot be read ({_sentence(error)})", _LOST) from None


def _made(found: type[Saved], contents: _Contents) -> Any:
    """Return the object of a file; of a file without a digest every error means damage."""
    if not hasattr(found, "restored"):  # of another package, which reads its file itself
        return found.from_file(contents.path)
    if contents.sealed:
        return found.restored(contents.dataset)
    try:
        return found.restored(contents.dataset)
    except Exception as error:
        wrong = f"its {contents.kind} cannot be made ({_sentence(error)})"
        raise DamagedFileError(contents.path, wrong, _LOST) from None


def _sentence(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


def _each(dataset: "xr.Dataset", change: Callable[["xr.DataArray"], "xr.DataArray"]) -> "xr.Dataset":
    """Apply `change` to all variables and coordinates."""
    import xarray as xr

    variables = {name: change(dataset[name]).variable for name in dataset.data_vars}
    coordinates = {name: change(dataset[name]).variable for name in dataset.coords}
    return xr.Dataset(variables, coordinates, dataset.attrs)


def _portable(array: "xr.DataArray") -> "xr.DataArray":
    """Store bool and 64-bit integers, which NetCDF 3 lacks, in another dtype, and note theirs."""
    kind = array.dtype.kind
    if kind in "USO" or array.dtype.name in _NETCDF3:
        return array
    holder: Any = np.int8 if kind == "b" else np.int32
    if kind not in "biu" or not _holds(holder, array.values):
        holder = np.float64
        if not _holds(holder, array.values):
            raise ValueError(f"{array.name} must fit float64 to be saved; its dtype is {array.dtype}")
    stored = array.astype(holder)
    stored.attrs = array.attrs | {_DTYPE: array.dtype.name}
    return stored


def _holds(holder: Any, values: Any) -> bool:
    return bool(np.all(values.astype(holder).astype(values.dtype) == values))


def _restored(array: "xr.DataArray") -> "xr.DataArray":
    attrs = dict(array.attrs)
    dtype = attrs.pop(_DTYPE, None)
    restored = array.astype(dtype) if dtype else array.astype(array.dtype.newbyteorder("="))
    if array.dtype.kind == "O":
        restored = array.astype(str)
    restored.attrs, restored.encoding = attrs, {}
    return restored


def load(path: str | os.PathLike[str]) -> Any:
    """Open a saved plan or log of any package.

    Parameters
    ----------
    path : str or path
        A file written by ``save`` (NetCDF), or a journal of a run (SQLite).

    Returns
    -------
    object
        The plan, log or journal.

    Raises
    ------
    FileNotFoundError
        When there is no such file.
    DamagedFileError
        When the file is not as it was written.
    ValueError
        When the file was not saved by this library, or by a later version.

    Warns
    -----
    OldFileWarning
        When the file is of version 0.1.0, which wrote no digests.

    Examples
    --------
    >>> import sdpgrind
    >>> policy = sdpgrind.load("policy.nc")  # doctest: +SKIP
    """
    if not checks.path("path", path).is_file():
        raise FileNotFoundError(f"path must be an existing file; got {str(path)!r}")
    if is_journal(path):
        return _registered("hwsim.journal", path).from_file(path)
    contents = _contents(path)
    return _made(_registered(contents.kind, path), contents)


def _registered(kind: str, path: str | os.PathLike[str]) -> Any:
    """Class of a kind of files."""
    try:
        return _class_of(kind)
    except StopIteration:
        raise _not_ours(path, kind) from None


@cache  # a look reads a file of each package that is installed
def _class_of(kind: str) -> Any:
    return next(iter(entry_points(group="sdpgrind.records", name=kind))).load()


def is_journal(path: str | os.PathLike[str]) -> bool:
    """Whether a file is the journal of a run, or was one before its first bytes were lost."""
    with Path(path).open("rb") as file:
        head = file.read(len(_SQLITE))
        if head.startswith(b"CDF"):  # a plan or a log, which is read once, elsewhere
            return False
        return head == _SQLITE or was_journal(head + file.read())


def was_journal(raw: bytes) -> bool:
    """Whether bytes are what is left of a journal: its tables, or the beginning of its first page."""
    if any(table.encode() in raw for table in JOURNAL_TABLES):
        return True
    page = int.from_bytes(raw[16:18], "big")  # source: file format of SQLite, 1.3.2
    return raw.startswith(_SQLITE) and len(raw) < max(page, _LEAST_PAGE)
