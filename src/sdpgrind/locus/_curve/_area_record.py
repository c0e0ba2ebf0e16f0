"""An area of best points as labelled arrays, and back."""

import numpy as np
import xarray as xr

from sdpgrind.locus._curve.area import Area
from sdpgrind.locus._curve.record import columns_of, coordinates
from sdpgrind.locus._problem._problem_text import read_problem, written
from sdpgrind.locus._trace.grid import Grid


def dataset(curve: Area) -> xr.Dataset:
    """The grid, with hidden states as coordinates."""
    problem, system = curve.problem, curve.system
    dims, shape = problem.hidden_names, curve.grid.residual.shape
    places = np.linspace(0.0, 1.0, shape[0])
    states = system.unscaled(np.repeat(places[:, None], system.h, axis=1), system.n)
    along = {name: (name, states[:, k], {"units": problem.unit(name)}) for k, name in enumerate(dims)}
    variables = columns_of(problem, curve.grid.table(system), dims, shape)
    variables["held"] = (
        (*dims, "set"),
        curve.grid.held,
        {"long_name": "-1, 1: control at its least, greatest; 1: constraint active"},
    )
    return xr.Dataset(variables, coordinates(problem) | along, {"problem": written(problem), "degenerate": int(curve.degenerate)})


def restored(data: xr.Dataset) -> Area:
    """The area that `dataset` gave."""
    problem = read_problem(data.attrs["problem"])
    degenerate = bool(data.attrs["degenerate"])
    grid = Grid(data.points.values, data.held.values.astype(np.int64), data.residual.values)
    return Area(problem, grid, degenerate)
