"""Optima at a grid over several hidden states, traced along the first."""

import itertools
from dataclasses import dataclass

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._problem.system import System
from sdpgrind.locus._trace.pieces import Columns, point_of
from sdpgrind.locus._trace.trace import Ints, Tracer, run_at

# chosen: per hidden state, by their number; 5 beyond. More cost time, fewer miss branches
NODES = {2: 17, 3: 7}


@dataclass(frozen=True)
class TraceGrid:
    """Scaled unknowns (..., n + m + 2), sets (..., n + m), residuals (...) at the nodes; NaN: no optimum."""

    points: Floats
    held: Ints
    residual: Floats

    @property
    def places(self) -> Floats:
        """Scaled hidden states (..., h) of all nodes."""
        along = np.linspace(0.0, 1.0, self.residual.shape[0])
        return np.stack(np.meshgrid(*[along] * self.residual.ndim, indexing="ij"), axis=-1)

    def table(self, system: System) -> Columns:
        """Return the columns of all nodes; NaN without an optimum."""
        size = self.points.shape[-1]
        flat = zip(
            self.points.reshape(-1, size),
            self.held.reshape(-1, size - 2),
            self.places.reshape(-1, system.h),
            strict=True,
        )
        rows = []
        for point, held, place in flat:
            known = bool(np.isfinite(point[0]))
            row = point_of(
                Tracer(system, place),
                held,
                point if known else np.full(size, 0.5),
                np.eye(1, size, size - 1)[0],
            )
            rows.append(row if known else row.blank())
        return Columns.joined(rows)


def trace_grid(system: System) -> tuple[TraceGrid, bool]:
    """Return the cheapest optima at a grid, and whether several points are optimal somewhere."""
    nodes = NODES.get(system.h, 5)
    shape, flat = (nodes,) * system.h, False
    points = np.full((*shape, system.n + system.m + 2), np.nan)
    held, residual = np.zeros((*shape, system.n + system.m), dtype=np.int64), np.full(shape, np.nan)
    places = np.linspace(0.0, 1.0, nodes)
    for others in itertools.product(range(nodes), repeat=system.h - 1):
        tracer = Tracer(system, np.array([0.0, *places[list(others)]]))
        for k, known, own in _line(tracer, places):
            points[(k, *others)], held[(k, *others)], residual[(k, *others)] = (
                known.points[0],
                own,
                known.residual[0],
            )
        flat = flat or bool(tracer.flat)
    return TraceGrid(points, held, residual), flat


def _line(tracer: Tracer, places: Floats) -> list[tuple[int, Columns, Ints]]:
    """Return node number, columns and set of the cheapest optima along a line."""
    branches, found = tracer.branches(), []
    for k, place in enumerate(places):
        costs = [tracer.cost(branch, place) for branch in branches]
        if not costs or not np.isfinite(min(costs)):
            continue
        run = run_at(branches[int(np.argmin(costs))], place)
        point = None if run is None else tracer.at(run, place)
        if run is not None and point is not None:
            found.append((k, point_of(tracer, run.held, point, run.tangents[0]), run.held))
    return found
