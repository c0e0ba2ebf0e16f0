"""Base class of plans."""

from abc import abstractmethod
from typing import TYPE_CHECKING, Self

from sdpgrind.base.records import Record

if TYPE_CHECKING:
    import xarray as xr


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
