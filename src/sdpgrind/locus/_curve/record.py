"""`Locus` and `Area` as labelled arrays, and back."""

import json
from typing import Any

import numpy as np
import xarray as xr

from sdpgrind.base.sheets.amounts import Amounts
from sdpgrind.base.sheets.blocks import AmountTable
from sdpgrind.locus._problem.problem import Problem, read_problem, written
from sdpgrind.locus._problem.system import system_of
from sdpgrind.locus._trace.grid import TraceGrid
from sdpgrind.locus._trace.pieces import Columns, Piece

_SHOWN = 12  # points in a table; chosen: a third of a page
_WIDE = {"controls": "control", "slope": "control", "bound_multipliers": "control"}
_TALL = {"multipliers": "constraint", "response": "constraint", "limit": "constraint"}
_NARROW = ("cost", "margin", "residual")
_TOLD = {
    "controls": "best control",
    "slope": "of the best control, by the hidden state",
    "bound_multipliers": "cost for a unit by which the bound of a control would give way",
    "multipliers": "cost for a unit of the constraint",
    "response": "what would be measured",
    "limit": "what it must stay under",
    "cost": "least cost",
    "margin": "least curvature in the directions left free",
    "residual": "of the conditions of a best point, scaled",
}


def dataset_of(problem: Problem, pieces: tuple[Piece, ...], degenerate: bool) -> xr.Dataset:
    """Return all points of a locus, piece after piece, in the user's units and scaled."""
    tables, name = [piece.table for piece in pieces], problem.hidden_names[0]
    table = Columns.joined(tables)
    variables = columns_of(problem, table, ("point",))
    variables["piece"] = (("point",), np.repeat(np.arange(len(tables)), [len(one.hidden) for one in tables]))
    variables[name] = (("point",), table.hidden, {"units": problem.unit(name), "long_name": "hidden state"})
    held = np.array([piece.held for piece in pieces])
    variables["held"] = (
        ("pieces", "set"),
        held,
        {"long_name": "-1, 1: control at its least, greatest; 1: constraint active"},
    )
    attrs = {
        "problem": written(problem),
        "pieces": json.dumps(_described(pieces)),
        "degenerate": int(degenerate),
    }
    return xr.Dataset(variables, coordinates(problem), attrs)


def best_points(problem: Problem, tables: list[Columns], error: float) -> AmountTable:
    """Return a dozen best points: hidden state, controls, responses with their limits, cost."""
    table = Columns.joined(tables)
    rows = np.unique(np.linspace(0, len(table.hidden) - 1, _SHOWN).round().astype(int))
    columns = [Amounts.of(problem.hidden_names[0], table.hidden[rows], problem.unit(problem.hidden_names[0]))]
    for k, name in enumerate(problem.names):
        columns.append(Amounts.of(name, table.controls[rows, k], problem.unit(name)))
    for k, name in enumerate(problem.responses):
        for word, values in (("", table.response), (" limit", table.limit)):
            columns.append(
                Amounts.of(name, values[rows, k], problem.unit(name), name.replace("_", " ") + word)
            )
    columns.append(Amounts.of("cost", table.cost[rows], problem.unit("cost")))
    return AmountTable(f"Best points along the curve (scaled residual {error:.1g})", columns)


def columns_of(
    problem: Problem, table: Columns, dims: tuple[str, ...], shape: tuple[int, ...] = (-1,)
) -> dict[str, Any]:
    """Return the variables of a table over given dimensions."""
    found: dict[str, Any] = {}
    for name, second in (_WIDE | _TALL | {"points": "unknown", "along": "unknown"}).items():
        values = getattr(table, name)
        found[name] = (
            (*dims, second),
            values.reshape(*shape, values.shape[1]),
            {"long_name": _TOLD.get(name, "scaled")},
        )
    for name in _NARROW:
        unit = "1" if name == "residual" else problem.unit("cost")
        found[name] = (dims, getattr(table, name).reshape(shape), {"units": unit, "long_name": _TOLD[name]})
    return found


def coordinates(problem: Problem) -> dict[str, Any]:
    """Return names and units of controls and constraints."""
    names, responses = list(problem.names), list(problem.responses)
    units = {"control_unit": ("control", [problem.unit(name) for name in names])}
    return {
        "control": names,
        "constraint": responses,
        **units,
        "constraint_unit": ("constraint", [problem.unit(r) for r in responses]),
    }


def _described(pieces: tuple[Piece, ...]) -> list[list[Any]]:
    return [[p.kind, list(p.active), p.bounds, p.is_global, p.start, p.end] for p in pieces]


def fields_in(data: xr.Dataset) -> tuple[Problem, Columns, tuple[Piece, ...], bool]:
    """Return the fields of a `Locus` from the arrays of `dataset_of`."""
    problem = read_problem(data.attrs["problem"])
    hidden = problem.hidden_names[0]
    rows = {name: data[hidden if name == "hidden" else name].values for name in Columns.__dataclass_fields__}
    table = Columns(**rows)
    pieces = []
    for k, (kind, active, bounds, best, start, end) in enumerate(json.loads(data.attrs["pieces"])):
        own = np.flatnonzero(data.piece.values == k)
        part = table.part(slice(int(own[0]), int(own[-1]) + 1))
        held = data.held.values[k].astype(np.int64)
        pieces.append(Piece(kind, tuple(active), bounds, best, start, end, part, held))
    return problem, table, tuple(pieces), bool(data.attrs["degenerate"])


def area_dataset(problem: Problem, grid: TraceGrid, degenerate: bool) -> xr.Dataset:
    """Return the grid of an area, with hidden states as coordinates."""
    system, dims, shape = system_of(problem, degenerate), problem.hidden_names, grid.residual.shape
    places = np.linspace(0.0, 1.0, shape[0])
    states = system.unscaled(np.repeat(places[:, None], system.h, axis=1), system.n)
    along = {name: (name, states[:, k], {"units": problem.unit(name)}) for k, name in enumerate(dims)}
    variables = columns_of(problem, grid.table(system), dims, shape)
    variables["held"] = (
        (*dims, "set"),
        grid.held,
        {"long_name": "-1, 1: control at its least, greatest; 1: constraint active"},
    )
    return xr.Dataset(
        variables, coordinates(problem) | along, {"problem": written(problem), "degenerate": int(degenerate)}
    )


def area_fields(data: xr.Dataset) -> tuple[Problem, TraceGrid, bool]:
    """Return the fields of an `Area` from the arrays of `area_dataset`."""
    problem = read_problem(data.attrs["problem"])
    degenerate = bool(data.attrs["degenerate"])
    grid = TraceGrid(data.points.values, data.held.values.astype(np.int64), data.residual.values)
    return problem, grid, degenerate
