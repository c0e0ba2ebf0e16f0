"""Tables of logs, as a reader of files makes them: columns with units, rows in parts."""

from pathlib import Path

import numpy as np
import xarray as xr

SAMPLES = Path(__file__).parents[1] / "data" / "samples"
KP = 9.80665  # N


class Log:
    """Something with tables by tier."""

    def __init__(self, **tables):
        self._tables = tables
        self.tiers = tuple(tables)

    def __getitem__(self, tier):
        return self._tables[tier]


def table(part=0, **columns):
    """Columns as (values, unit); rows in parts, with a time of 1 s a row where none is given."""
    count = len(next(iter(columns.values()))[0])
    columns = {"time": (np.arange(float(count)), "s"), **columns}
    data = {name: ("row", np.array(values), {"units": unit}) for name, (values, unit) in columns.items()}
    coords = {"part": ("row", np.broadcast_to(part, count)), "time": data.pop("time")}
    return xr.Dataset(data, coords, {"tier": "data"})
