"""An area of best points as labelled arrays, and back."""

import numpy as np
import xarray as xr

from sdpgrind.locus._curve.record import columns_of, coordinates
from sdpgrind.locus._problem._problem_text import read_problem, written
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.system import system_of
from sdpgrind.locus._trace.grid import Grid


def dataset_of(problem: Problem, grid: Grid, degenerate: bool) -> xr.Dataset:
    """The grid, with hidden states as coordinates."""
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
    return xr.Dataset(variables, coordinates(problem) | along, {"problem": written(problem), "degenerate": int(degenerate)})


def fields_in(data: xr.Dataset) -> tuple[Problem, Grid, bool]:
    """What the area was made of that `dataset_of` described."""
    problem = read_problem(data.attrs["problem"])
    degenerate = bool(data.attrs["degenerate"])
    grid = Grid(data.points.values, data.held.values.astype(np.int64), data.residual.values)
    return problem, grid, degenerate
