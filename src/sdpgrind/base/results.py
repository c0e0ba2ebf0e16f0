"""Results on disk: declared fields as labelled arrays with units, and what is no array as JSON."""

from typing import TYPE_CHECKING, Any, Self

import numpy as np

from sdpgrind.base import stored
from sdpgrind.base.quantities import specs, units_of
from sdpgrind.base.records import Saved

if TYPE_CHECKING:
    import xarray as xr

FIELDS = "fields"  # attribute of a file


class Result(Saved):
    """Mixin of described results with ``save``; the name in files is that of `described`."""

    @classmethod
    def _file_kind(cls) -> str:
        return stored.name_of(cls)

    def _written(self) -> "xr.Dataset":
        import xarray as xr

        known = units_of(type(self))
        values = {name: getattr(self, name) for name in specs(type(self))}
        # NetCDF 3 takes a dimension of no length for one without an end
        arrays = {name: each for name, each in values.items() if isinstance(each, np.ndarray) and each.size}
        rest = {name: each for name, each in values.items() if name not in arrays}
        columns = {
            name: (_dims(name, each), each, _label(name, known.get(name, "")))
            for name, each in arrays.items()
        }
        return xr.Dataset(columns, attrs={FIELDS: stored.encode(rest)})

    @classmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        """Return the result of a `dataset` read from a file, with its units."""
        rest: dict[str, Any] = stored.decode(dataset.attrs[FIELDS])
        return cls(**rest, **{str(name): each.values for name, each in dataset.data_vars.items()})


def _label(name: str, unit: str) -> dict[str, str]:
    return {"units": unit, "long_name": name.replace("_", " ")}


def _dims(name: str, values: Any) -> tuple[str, ...]:
    """Names of the dimensions of an array."""
    return tuple(f"{name}_{axis}" for axis in range(np.ndim(values)))
