"""Base classes of plans and of everything that is saved."""

import os
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Self

if TYPE_CHECKING:
    import xarray as xr


class Record(ABC):
    """Base of objects that are saved in a file.

    `sdpgrind.load` finds the class by its kind, an entry point of ``sdpgrind.records``.
    """

    kind: ClassVar[str]
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
        from sdpgrind.base import records  # imports xarray, for most of a second

        records.write(self._written(), path, self.kind)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read a file of `save` at `path`.

        Parameters
        ----------
        path : str or path
            The file.
        """
        from sdpgrind.base import records

        return cls.restored(records.read(path))


class Plan(Record):
    """Result of a solver, with labels and units; immutable: a copy is the plan itself."""

    @property
    @abstractmethod
    def dataset(self) -> "xr.Dataset":
        """The plan as labelled arrays with units."""

    @abstractmethod
    def _told(self) -> str:
        """Text between the brackets of `repr`."""

    def _written(self) -> "xr.Dataset":
        return self.dataset

    def __deepcopy__(self, memo: object) -> Self:
        return self

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._told()})"
