"""Tables of a log as a text that `Log.read` reads back to the bit."""

import csv
import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base.whole_files import whole_file

if TYPE_CHECKING:
    import xarray as xr


def write(path: str | os.PathLike[str], table: "xr.Dataset", parts: Sequence[str] = ()) -> None:
    """Write a table: headers ``name [unit]``, floats in full; the file is whole or not there.

    Rows are those of ``row``, or of each part and controller; each entry of an array has a column of its own.
    `parts`: words for the numbers of the parts; empty: the numbers are written.
    """
    over = [dim for dim in ("row", "controller", "part") if dim in table.dims]
    headers: list[str] = []
    columns: list[list[Any]] = []
    for name in (
        *(n for n in ("controller", "part", "time") if n in table.coords),
        *map(str, table.data_vars),
    ):
        values, header = _flat(table[name], over, table.sizes), _header(name, table[name].attrs)
        width = values.shape[1]
        headers += [header] if width == 1 else [header.replace(name, f"{name}.{k}", 1) for k in range(width)]
        if name == "part" and parts:
            columns.append([parts[number] for number in values[:, 0].tolist()])
        else:
            columns += [_cells(values[:, k]) for k in range(width)]
    with whole_file(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(headers)
        writer.writerows(zip(*columns, strict=True))


def _flat(variable: "xr.DataArray", over: Sequence[str], sizes: Mapping[Any, int]) -> Any:
    """Values of a variable: a row for each row of the file, a column for each entry of an array."""
    missing = {dim: sizes[dim] for dim in over if dim not in variable.dims}
    inner = [dim for dim in variable.dims if dim not in over]
    values = variable.expand_dims(missing).transpose(*over, *inner).values
    return values.reshape(int(np.prod([sizes[dim] for dim in over])), -1)


def _header(name: str, attributes: Any) -> str:
    unit = attributes.get("units")
    return name if unit is None else f"{name} [{unit}]"


def _cells(values: Any) -> list[Any]:
    """Entries of a column as text: the shortest that reads back the same float, nothing for NaN."""
    array = np.asarray(values)
    if array.dtype.kind == "f":
        written: Callable[[float], str] = repr
        return ["" if value != value else written(value) for value in array.astype(float).tolist()]
    return list(array.tolist())
