"""Parts as labelled tables (xarray), as one dataset for a file, and back."""

import json
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hwsim._log.labels import Labels
from hwsim._part.motions import stacked
from hwsim._part.part import Column, LivePart

if TYPE_CHECKING:
    import xarray as xr

NUMBERS = "numbers"
"""Attribute of the outcome of some parts of a run: their numbers in it."""
_OUTCOME = "outcome"
_ATTRS = "attrs_of_tables"


@dataclass(frozen=True)
class Frames:
    """All tables of a log."""

    tables: Mapping[str, "xr.Dataset"]
    outcome: "xr.Dataset"


def from_parts(parts: Sequence[LivePart], labels: Labels) -> Frames:
    """Label the parts of one run."""
    tiers = dict.fromkeys(tier for part in parts for tier in part.tables)
    return Frames({tier: _table(tier, parts, labels) for tier in tiers}, _outcome(parts, labels))


def _table(tier: str, parts: Sequence[LivePart], labels: Labels) -> "xr.Dataset":
    import xarray as xr

    tables = [part.tables.get(tier, {"time": np.empty(0)}) for part in parts]
    rows = [table["time"].size for table in tables]
    variables = {}
    for name in dict.fromkeys(name for table in tables for name in table if name != "time"):
        values = _joined([t.get(name, np.full(n, np.nan)) for t, n in zip(tables, rows, strict=True)])
        variables[name] = (("row", f"{name}_index")[: values.ndim], values, labels.column(name))
    coords = {
        "part": ("row", np.repeat(np.arange(len(parts)), rows), {"long_name": "part"}),
        "time": (
            "row",
            np.concatenate([t["time"] for t in tables]),
            {"units": "s", "long_name": "time in the part"},
        ),
    }
    return xr.Dataset(variables, coords, {"tier": tier})


def _outcome(parts: Sequence[LivePart], labels: Labels) -> "xr.Dataset":
    import xarray as xr

    variables = {}
    for name in dict.fromkeys(name for part in parts for name in part.outcome):
        dimension, attrs = labels.outcome(name)
        values = _joined([part.outcome.get(name, np.array(np.nan))[np.newaxis] for part in parts])
        variables[name] = (("part", dimension)[: values.ndim], values, attrs)
    coords = {"part": ("part", np.arange(len(parts)), {"long_name": "part"})}
    names = {"plant": labels.plant, "controller": labels.controller}
    return xr.Dataset(variables, coords, {**names, **labels.description})


def repeated(series: Sequence[Sequence[LivePart]], labels: Labels) -> "xr.Dataset":
    """Label the outcomes of several series of equally many parts."""
    import xarray as xr

    flat = _outcome([part for parts in series for part in parts], labels)
    shape = len(series), len(series[0])
    variables = {
        name: (("series", *each.dims), each.values.reshape(*shape, *each.shape[1:]), each.attrs)
        for name, each in flat.items()
    }
    coords = {"series": np.arange(shape[0]), "part": np.arange(shape[1])}
    return xr.Dataset(variables, coords, flat.attrs)


def _joined(blocks: Sequence[Column]) -> Column:
    """Concatenate blocks of rows; where rows are arrays, pad the shorter ones with NaN."""
    if all(block.ndim == 1 for block in blocks):
        return np.concatenate(blocks)
    return stacked([block[:, np.newaxis] if block.ndim == 1 else block for block in blocks])


def of_parts(frames: Frames, numbers: Sequence[int]) -> Frames:
    """Keep some parts, in the given order, and number them from 0."""
    outcome = frames.outcome.isel(part=list(numbers)).assign_coords(part=np.arange(len(numbers)))
    outcome = outcome.assign_attrs({NUMBERS: list(numbers)})
    return Frames({tier: _own_rows(table, numbers) for tier, table in frames.tables.items()}, outcome)


def _own_rows(table: "xr.Dataset", numbers: Sequence[int]) -> "xr.Dataset":
    rows = [np.flatnonzero(table.part.values == number) for number in numbers]
    part = np.repeat(np.arange(len(rows)), [each.size for each in rows])
    return table.isel(row=np.concatenate(rows)).assign_coords(part=("row", part, table.part.attrs))


def side_by_side(runs: Mapping[str, Frames]) -> Frames:
    """Join runs of several controllers: a coordinate ``controller`` in tables, a dimension in outcomes."""
    import xarray as xr

    tiers = dict.fromkeys(tier for run in runs.values() for tier in run.tables)
    tables = {tier: _rows({n: r.tables[tier] for n, r in runs.items() if tier in r.tables}) for tier in tiers}
    names = xr.DataArray(list(runs), dims="controller", name="controller")
    outcomes = _widened([run.outcome for run in runs.values()], "part")
    outcome = xr.concat(
        outcomes, names, join="outer", data_vars="all", coords="minimal", combine_attrs="drop_conflicts"
    )
    outcome.attrs["controller"] = ", ".join(runs)
    return Frames(tables, outcome)


def _rows(tables: Mapping[str, "xr.Dataset"]) -> "xr.Dataset":
    import xarray as xr

    named = [t.assign_coords(controller=("row", np.full(t.sizes["row"], name))) for name, t in tables.items()]
    return xr.concat(_widened(named, "row"), "row", join="outer", data_vars="all", combine_attrs="override")


def _widened(datasets: Sequence["xr.Dataset"], rows: str) -> list["xr.Dataset"]:
    """Pad every dimension except `rows` to its longest with NaN."""
    widths: dict[Hashable, int] = {}
    for dataset in datasets:
        widths |= {dim: max(size, widths.get(dim, 0)) for dim, size in dataset.sizes.items() if dim != rows}
    missing = [{dim: (0, widths[dim] - d.sizes[dim]) for dim in d.sizes if dim in widths} for d in datasets]
    return [d.pad(pad, keep_attrs=True) for d, pad in zip(datasets, missing, strict=True)]


def to_dataset(frames: Frames) -> "xr.Dataset":
    """Merge all tables into one dataset; names of variables and dimensions begin with the table's name."""
    import xarray as xr

    tables = {_OUTCOME: frames.outcome} | {f"table.{tier}": table for tier, table in frames.tables.items()}
    prefixed = [_prefixed(name, table) for name, table in tables.items()]
    attrs = {_ATTRS: json.dumps({name: table.attrs for name, table in tables.items()})}
    dataset = xr.merge(prefixed, combine_attrs="override").assign_attrs(attrs)
    for variable in dataset.variables.values():
        variable.encoding["_FillValue"] = None  # else a file adds an attribute to NaN
    return dataset


def _prefixed(prefix: str, table: "xr.Dataset") -> "xr.Dataset":
    names: set[Hashable] = {*table.variables, *table.dims}
    return table.drop_attrs(deep=False).rename({name: f"{prefix}.{name}" for name in names})


def from_dataset(dataset: "xr.Dataset") -> Frames:
    """Split the dataset of `to_dataset` into its tables."""
    attrs = json.loads(dataset.attrs[_ATTRS])
    dataset = dataset.drop_attrs(deep=False)
    tables = {prefix: _unprefixed(prefix, dataset.assign_attrs(kept)) for prefix, kept in attrs.items()}
    outcome = tables.pop(_OUTCOME)
    return Frames({prefix.removeprefix("table."): table for prefix, table in tables.items()}, outcome)


def _unprefixed(prefix: str, dataset: "xr.Dataset") -> "xr.Dataset":
    start = f"{prefix}."
    own = dataset[[name for name in dataset.variables if str(name).startswith(start)]]
    names = {name: str(name).removeprefix(start) for name in {*own.variables, *own.dims}}
    bare = own.rename(names)
    coords = {"part", "controller"} if prefix == _OUTCOME else {"part", "controller", "time"}
    return bare.set_coords([name for name in bare.variables if name in coords])
