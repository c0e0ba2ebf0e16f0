"""Tables in memory as sheets: mappings of arrays, pandas, xarray, and what has ``__dataframe__``."""

import dataclasses
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.columns.sheet import (
    UNNAMED,
    Column,
    ColumnHead,
    Sheet,
    as_column,
    heading,
    is_unit,
    too_long,
    unit_of,
)

_KINDS = "a path, a list of paths, a pandas.DataFrame, an xarray.Dataset or a mapping of arrays"


def sheet(data: Any) -> Sheet:
    """Return a table in memory as a sheet."""
    if hasattr(data, "data_vars"):
        return _made("the dataset", _of_dataset(data))
    if hasattr(data, "iloc") and hasattr(data, "columns"):
        return _of_table(data)
    if isinstance(data, Mapping):
        return _made("the mapping", [(heading(name), values) for name, values in data.items()])
    if hasattr(data, "__dataframe__"):
        return _of_table(_as_frame(data))
    raise TypeError(f"data must be {_KINDS}; got {checks.shown(data)}")


def _made(name: str, columns: list[tuple[ColumnHead, Any]]) -> Sheet:
    if not columns:
        raise ValueError(f"{name} must hold columns; it is empty")
    columns = [(_of_span(head, values), values) for head, values in columns]

    def take(wanted: Any) -> list[Column]:
        return [_column(name, *columns[k]) for k in wanted]

    found = Sheet(
        name, [each for each, _ in columns], take, rows=max(np.size(values) for _, values in columns)
    )
    too_long(name, found.rows or 0)
    return found


def _of_span(head: ColumnHead, values: Any) -> ColumnHead:
    """Heading with the unit that `as_column` gives spans of time, whatever numpy counts them in."""
    spans = getattr(getattr(values, "dtype", None), "kind", "") == "m"
    return head._replace(unit="s", origin="type") if spans else head


def _column(name: str, head: ColumnHead, values: Any) -> Column:
    array = as_column(_plain(values))
    if array.ndim != 1:
        raise ValueError(
            f"{name}: column {head.header!r} must have one dimension; got the shape {array.shape}"
        )
    return array


def _plain(values: Any) -> Any:
    """Values without the dtypes that only pandas has; a missing one is None or NaN."""
    if hasattr(values, "dt") and getattr(values.dtype, "tz", None) is not None:
        values = values.dt.tz_convert("UTC").dt.tz_localize(None)
    if hasattr(values, "to_numpy"):
        kind = getattr(values.dtype, "kind", "O")
        numeric = kind in "biuf" and not isinstance(values.dtype, np.dtype)
        return values.to_numpy(float, na_value=np.nan) if numeric else values.to_numpy()
    return getattr(values, "values", values)


def _of_table(frame: Any) -> Sheet:
    """Sheet of a DataFrame; a row of units below the names is none of its rows."""
    units = _unit_row(frame)
    if units is None:
        return _made("the table", _of_frame(frame))
    made = _made("the table", _of_frame(frame.iloc[1:], units))
    return dataclasses.replace(made, place=lambda row: f"row {row + 2}")


def _of_frame(frame: Any, units: Sequence[str | None] | None = None) -> list[tuple[ColumnHead, Any]]:
    """Columns of a DataFrame, and its index where that has a name."""
    index = [] if frame.index.name is None else [(heading(frame.index.name), frame.index.to_series())]
    columns = [(name, frame.iloc[:, k]) for k, name in enumerate(frame.columns)]
    if units is None and (levels := _two_levels(frame)) is not None:
        columns, units = [(name[0], each) for name, each in columns], levels
    if units is not None:
        told = zip(columns, units, strict=True)
        return index + [(heading(name, unit, "unit row"), each) for (name, each), unit in told]
    return index + [(heading(name, _unit(each.attrs), "attribute"), each) for name, each in columns]


def _unit_row(frame: Any) -> list[str | None] | None:
    """Units in the first row, as a sheet read without its second line of names has them; None: it is data."""
    if len(frame) < 2 or any(getattr(kind, "kind", "O") in "biufcmM" for kind in frame.dtypes):
        return None
    return _units([None if cell is None or cell != cell else cell for cell in frame.iloc[0].tolist()])


def _two_levels(frame: Any) -> list[str | None] | None:
    """Units in the second level of the names, as pandas' ``header=[2, 3]`` gives them; None: it has none."""
    if getattr(frame.columns, "nlevels", 1) != 2:
        return None
    named = (str(name[1]) for name in frame.columns)
    return _units([None if name.startswith(UNNAMED) else name for name in named])


def _units(cells: Sequence[Any]) -> list[str | None] | None:
    """Units of cells if all that are not empty are such, and one is that of no pure number."""
    found = [cell for cell in cells if cell is not None]
    if not all(isinstance(cell, str) and is_unit(cell) for cell in found):
        return None
    told = [None if cell is None else unit_of(cell) for cell in cells]
    return told if set(told) - {None, "1"} else None


def _of_dataset(data: Any) -> list[tuple[ColumnHead, Any]]:
    """Variables and coordinates of one dimension."""
    flat = {str(name): each for name, each in data.variables.items() if each.ndim == 1}
    return [(heading(name, _unit(each.attrs), "attribute"), each.values) for name, each in flat.items()]


def _unit(attributes: Mapping[str, Any]) -> str | None:
    found = next((attributes[name] for name in ("units", "unit") if name in attributes), None)
    return unit_of(found) if isinstance(found, str) else None


def _as_frame(data: Any) -> Any:
    from pandas.api import interchange

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the protocol is called old; it is what such a table offers
        return interchange.from_dataframe(data)
