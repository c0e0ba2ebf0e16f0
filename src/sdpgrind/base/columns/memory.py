"""Tables in memory as sheets: mappings of arrays, pandas, xarray, and what has ``__dataframe__``."""

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.columns.sheet import Column, ColumnHead, Sheet, as_column, heading, too_long, unit_of

_KINDS = "a path, a list of paths, a pandas.DataFrame, an xarray.Dataset or a mapping of arrays"


def sheet(data: Any) -> Sheet:
    """Return a table in memory as a sheet."""
    if hasattr(data, "data_vars"):
        return _made("the dataset", _of_dataset(data))
    if hasattr(data, "iloc") and hasattr(data, "columns"):
        return _made("the table", _of_frame(data))
    if isinstance(data, Mapping):
        return _made("the mapping", [(heading(name), values) for name, values in data.items()])
    if hasattr(data, "__dataframe__"):
        return _made("the table", _of_frame(_as_frame(data)))
    raise TypeError(f"data must be {_KINDS}; got {checks.shown(data)}")


def _made(name: str, columns: list[tuple[ColumnHead, Any]]) -> Sheet:
    if not columns:
        raise ValueError(f"{name} must hold columns; it is empty")

    def take(wanted: Any) -> list[Column]:
        return [_column(name, *columns[k]) for k in wanted]

    found = Sheet(
        name, [each for each, _ in columns], take, rows=max(np.size(values) for _, values in columns)
    )
    too_long(name, found.rows or 0)
    return found


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


def _of_frame(frame: Any) -> list[tuple[ColumnHead, Any]]:
    """Columns of a DataFrame, and its index where that has a name."""
    index = [] if frame.index.name is None else [(heading(frame.index.name), frame.index.to_series())]
    columns = [(name, frame.iloc[:, k]) for k, name in enumerate(frame.columns)]
    return index + [(heading(name, _unit(each.attrs), "attribute"), each) for name, each in columns]


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
