"""Plans and logs on disk: NetCDF files, written whole, dtypes kept.

The attribute ``kind`` of a file names its content. Packages register kinds as entry points of the group
``sdpgrind.records``; `load` finds the class and calls its ``from_file(path)``.
"""

import contextlib
import os
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from sdpgrind.base import checks

if TYPE_CHECKING:
    import xarray as xr

_DTYPE = "stored_dtype"
_NETCDF3 = {"int8", "int16", "int32", "float32", "float64"}


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
        """Write a NetCDF file at `path`, complete or not at all; `sdpgrind.load` reads it.

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
        return cls.restored(read(path))


class Record(Saved):
    """Base of plans, logs and others that tell their kind."""

    kind: ClassVar[str]
    """Name of the kind in files."""

    @classmethod
    def _file_kind(cls) -> str:
        return cls.kind


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path next to `path`, renamed to `path` when the block succeeds."""
    target = checks.path("path", path)
    if not target.parent.is_dir():
        raise FileNotFoundError(f"path must lie in an existing folder; got {str(target)!r}")
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def write(dataset: "xr.Dataset", path: str | os.PathLike[str], kind: str) -> None:
    """Write `dataset` to a NetCDF file at `path`, marked as `kind`."""
    from xarray.backends import ScipyDataStore

    from sdpgrind import __version__

    portable = _each(dataset, _portable).assign_attrs(kind=kind, version=__version__)
    plain = {name: {"_FillValue": None} for name in portable.variables}  # NaN is a value like any other
    # `to_netcdf` would import dask's scheduler, where there is one, for a lock of a file that nobody shares
    with whole_file(path) as temporary, ScipyDataStore(str(temporary), mode="w", lock=False) as store:
        portable.dump_to_store(store, encoding=plain)


def read(path: str | os.PathLike[str]) -> "xr.Dataset":
    """Read a file of `write` with its dtypes."""
    import xarray as xr

    with xr.open_dataset(path, engine="scipy", decode_times=False, mask_and_scale=False) as opened:
        dataset = opened.load()
    return _each(dataset, _restored)


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
    ValueError
        When the file was not saved by this library.

    Examples
    --------
    >>> import sdpgrind
    >>> policy = sdpgrind.load("policy.nc")  # doctest: +SKIP
    """
    if not checks.path("path", path).is_file():
        raise FileNotFoundError(f"path must be an existing file; got {str(path)!r}")
    kind = _kind(path)
    for entry in entry_points(group="sdpgrind.records", name=kind):
        return entry.load().from_file(path)
    raise ValueError(
        f"path must be a file saved by this library; {str(path)!r} holds {kind or 'something else'}"
    )


def _kind(path: str | os.PathLike[str]) -> str:
    with Path(path).open("rb") as file:
        head = file.read(16)
    if head.startswith(b"SQLite format 3"):
        return "hwsim.journal"
    if not head.startswith(b"CDF"):
        return ""
    import xarray as xr

    with xr.open_dataset(path, engine="scipy", decode_times=False) as dataset:
        return str(dataset.attrs.get("kind", ""))
