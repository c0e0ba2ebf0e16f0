"""What all plans share: a kind, a file and the way back, one line that describes them, no needless copies."""

import os
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Self

if TYPE_CHECKING:
    import xarray as xr


class Record(ABC):
    """What can be kept in a file.

    `sdpgrind.load` finds its class by the kind, an entry point of ``sdpgrind.records``.
    """

    kind: ClassVar[str]
    """Name of the kind, as its files hold it."""

    @abstractmethod
    def _written(self) -> "xr.Dataset":
        """Labelled arrays that a file holds."""

    @classmethod
    @abstractmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        """Return what a `dataset` read from a file describes, its units included."""

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to a NetCDF file at `path`, whole or not at all; `sdpgrind.load` reads it back.

        Parameters
        ----------
        path : str or path
            File in a folder that exists.
        """
        from sdpgrind.base import records  # stands on xarray, which takes most of a second to import

        records.write(self._written(), path, self.kind)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read what `save` wrote to `path`.

        Parameters
        ----------
        path : str or path
            The file.
        """
        from sdpgrind.base import records

        return cls.restored(records.read(path))


class Plan(Record):
    """What a solver found, with labels and units; immutable, so that a copy is the plan itself."""

    @property
    @abstractmethod
    def dataset(self) -> "xr.Dataset":
        """All of it as labelled arrays with units."""

    @abstractmethod
    def _told(self) -> str:
        """What `repr` tells of it between its brackets."""

    def _written(self) -> "xr.Dataset":
        return self.dataset

    def __deepcopy__(self, memo: object) -> Self:
        return self  # nothing in it changes

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._told()})"
