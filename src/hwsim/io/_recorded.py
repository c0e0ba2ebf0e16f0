"""Columns of a user's file as the table and the outcome of a log."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base.columns.read import Recorded
from sdpgrind.base.columns.table import COMMAND, TEXT

if TYPE_CHECKING:
    import xarray as xr

TABLE = "data"
"""Name of the one table of a log that was read."""


def data_table(recording: Recorded) -> "xr.Dataset":
    """Table of a log: dimension ``row``, coordinates ``part`` and ``time``, columns with units."""
    import xarray as xr

    variables = {
        name: ("row", _plain(values), _attributes(name, recording.units[name]))
        for name, values in recording.columns.items()
    }
    coords = {
        "part": ("row", recording.part, {"long_name": "part"}),
        "time": ("row", recording.time, {"units": "s", "long_name": "time in the part"}),
    }
    told = {"tier": TABLE, "labels": list(recording.labels), "source": recording.source.to_json()}
    return xr.Dataset(variables, coords, told)


def _plain(values: Any) -> Any:
    """Texts as an array of texts, which files know."""
    return values.astype(str) if values.dtype.kind == "O" else values


def _attributes(name: str, unit: str) -> dict[str, str]:
    spoken = name.removesuffix(COMMAND).replace("_", " ")
    commanded = name.endswith(COMMAND) and not spoken.startswith("command")
    return {
        "units": "1" if unit in ("", TEXT) else unit,
        "long_name": f"{spoken} commanded" if commanded else spoken,
    }


def outcome_of(recording: Recorded) -> "xr.Dataset":
    """Outcome of each part: its duration (s) and its number of rows."""
    import xarray as xr

    parts = np.arange(len(recording.labels))
    first = np.searchsorted(recording.part, parts)
    after = np.searchsorted(recording.part, parts, side="right")
    variables = {
        "duration": (
            "part", recording.time[after - 1] - recording.time[first], {"units": "s", "long_name": "duration"}
        ),
        "rows": ("part", (after - first).astype(float), {"units": "1", "long_name": "rows"}),
    }  # fmt: skip
    files = ", ".join(note.name for note in recording.source.files)
    return xr.Dataset(
        variables,
        {"part": ("part", parts, {"long_name": "part"})},
        {"plant": files, "controller": "", "labels": list(recording.labels)},
    )
