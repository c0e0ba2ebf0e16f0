"""Whether a bore was read, of circles and cylinders in files."""

import json
from typing import TYPE_CHECKING, Self

from sdpgrind.base.results import FIELDS, Result
from sdpgrind.base.warned import warn

if TYPE_CHECKING:
    import xarray as xr


class SavedSide(Result):
    """Mixin of results with `internal`, which files of earlier versions lack; the sign of a tip tells it."""

    tip_radius: float

    @classmethod
    def restored(cls, dataset: "xr.Dataset") -> Self:
        """Return the result of a `dataset` read from a file, with its units; warn where it tells no side."""
        found = super().restored(dataset)
        if found.tip_radius == 0 and "internal" not in json.loads(dataset.attrs[FIELDS]):
            warn(
                "the file does not tell whether a bore was read with a point tip: peaks and valleys are taken"
                " as of a shaft; .replace(internal=True) makes them those of a bore"
            )
        return found
