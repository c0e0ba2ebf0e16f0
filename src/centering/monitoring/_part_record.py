"""File of the readings of all parts, from which a chart or a track is built again."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr


def dataset_of(
    values: Mapping[str, Sequence[float]], units: Mapping[str, str], settings: Mapping[str, Any]
) -> xr.Dataset:
    """Values of quantities over the parts, NaN: no reading, with the settings of the chart or track."""
    table = np.array(list(values.values()), dtype=float).reshape(len(values), -1)
    told = {"units": ", ".join(units[name] for name in values), "long_name": "what was read of each part"}
    # NetCDF holds no empty array
    columns = {"value": (("quantity", "part"), table, told)} if table.size else {}
    return xr.Dataset(columns, {"quantity": list(values)}, {"settings": json.dumps(settings)})


def settings_in(data: xr.Dataset) -> dict[str, Any]:
    """Settings of the chart or track."""
    return dict(json.loads(data.attrs["settings"]))


def parts_in(data: xr.Dataset) -> Iterator[dict[str, float]]:
    """Values of each part by name, in order."""
    names = [str(name) for name in data["quantity"].values]
    for row in data["value"].values.T if "value" in data else ():
        yield dict(zip(names, row.tolist(), strict=True))
