"""Base class of plans: labelled arrays, files, text, pages, notebooks."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

from sdpgrind.base import notebook
from sdpgrind.base.records import Record
from sdpgrind.base.reported import Reported

if TYPE_CHECKING:
    import xarray as xr


class Plan(Reported, Record):
    """Result of a solver, with labels and units; immutable: a copy is the plan itself."""

    _options: "Mapping[str, Any] | None" = None
    """Options given to the verb that solved it, see `reporting`; None: unknown, as of a plan from a file."""

    _repeat: "Mapping[str, Any] | None" = None
    """Options that solve it again where those given might not, as with a limit of time."""

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

    def _repr_html_(self) -> str:
        figures = list(self._figures())
        return notebook.tables(repr(self), figures) if figures else notebook.columns(repr(self), self.dataset)
