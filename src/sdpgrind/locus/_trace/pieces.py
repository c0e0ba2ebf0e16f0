"""Pieces of a locus as tables of points at equal arclength, in the user's units."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._trace.spread_kernels import spread
from sdpgrind.locus._trace.trace import Ints, Tracer, TraceRun

NONE = 1e-12  # chosen: least weight of the cost; below it multipliers are infinite


@dataclass(frozen=True)
class Columns:
    """Columns of k points of one or more pieces, in order.

    Attributes
    ----------
    points, along : array (k, n + m + 2)
        Scaled unknowns (controls, weights, hidden state) and unit tangents.
    controls, slope : array (k, n)
        Controls in the user's units, and their slopes by the hidden state.
    hidden : array (k,)
        The traced hidden state.
    multipliers : array (k, m)
        Cost per unit of each constraint.
    bound_multipliers : array (k, n)
        Cost per unit of a shifted bound of each control; 0: free.
    cost : array (k,)
        Least cost.
    response, limit : array (k, m)
        P_c and P_b.
    margin : array (k,)
        Least curvature of the Lagrangian in free directions, controls scaled to their ranges. inf: none.
    residual : array (k,)
        Scaled residual of the optimality conditions.
    """

    points: Floats
    along: Floats
    controls: Floats
    slope: Floats
    hidden: Floats
    multipliers: Floats
    bound_multipliers: Floats
    cost: Floats
    response: Floats
    limit: Floats
    margin: Floats
    residual: Floats

    def part(self, piece: slice) -> "Columns":
        """Return some of the points; private to this package."""
        return Columns(*(getattr(self, column.name)[piece] for column in fields(self)))

    @classmethod
    def joined(cls, tables: Sequence["Columns"]) -> "Columns":
        """Concatenate tables; private to this package."""
        return cls(
            *(np.concatenate([getattr(table, column.name) for table in tables]) for column in fields(cls))
        )

    def blank(self) -> "Columns":
        """Return as many rows of NaN; private to this package."""
        return Columns(*(np.full_like(getattr(self, column.name), np.nan) for column in fields(self)))


@dataclass(frozen=True)
class Piece:
    """A part of the locus with a constant active set.

    Attributes
    ----------
    kind : {"interior", "locus", "bound", "vertex"}
        No active constraint; active ones; a control at its bound; as many active constraints as controls.
    active : tuple of str
        Names of the active constraints.
    bounds : dict
        Name of each control at a bound to "least" or "greatest".
    is_global : bool
        Whether it is the best known optimum.
    start, end : str
        Events at the least and greatest hidden state.
    table : Columns
        Points by rising hidden state (units of the problem).
    held : array (n + m,)
        -1, 1: control at its least, greatest value; 1: constraint active; else 0.
    """

    kind: str
    active: tuple[str, ...]
    bounds: dict[str, str]
    is_global: bool
    start: str
    end: str
    table: Columns
    held: Ints

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest hidden state, in its unit."""
        return float(self.table.hidden[0]), float(self.table.hidden[-1])

    def __repr__(self) -> str:
        low, high = self.range
        what = (
            ", ".join([*self.active, *(f"{name} {end}" for name, end in self.bounds.items())])
            or "nothing active"
        )
        return (
            f"Piece({self.kind}: {what}; {low:.6g} to {high:.6g}; {self.start or '-'} to {self.end or '-'})"
        )


def counts(runs: Sequence[TraceRun], points: int) -> list[int]:
    """Return the number of points of each run, shared by arclength, at least 2."""
    lengths = np.array([np.sum(np.sqrt(np.sum(np.diff(run.nodes, axis=0) ** 2, axis=1))) for run in runs])
    return [max(2, round(share)) for share in points * lengths / np.sum(lengths)]


def tabulate(tracer: Tracer, runs: Sequence[TraceRun], sizes: Sequence[int]) -> Columns:
    """Return the exact points of runs."""
    system, total = tracer.system, sum(sizes)
    n, m, h = system.n, system.m, system.h
    points, along, pulls = np.empty((total, n + m + 2)), np.empty((total, n + m + 2)), np.empty((total, n))
    residual, curvature = np.empty(total), np.empty(total)
    since = 0
    for run, size in zip(runs, sizes, strict=True):
        part = slice(since, since + size)
        spread(
            system.kkt_tape, n, m, h, tracer.hidden, tracer.t, run.held, run.nodes, run.tangents,
            points[part], along[part], pulls[part], residual[part], curvature[part],
        )  # fmt: skip
        since += size
    return columns(tracer, points, along, pulls, residual, curvature)


def columns(
    tracer: Tracer, points: Floats, along: Floats, pulls: Floats, residual: Floats, curvature: Floats
) -> Columns:
    system, n, m = tracer.system, tracer.system.n, tracer.system.m
    places = np.empty((len(points), n + system.h))
    places[:, :n], places[:, n:], places[:, n + tracer.t] = points[:, :n], tracer.hidden, points[:, -1]
    values = system.unscaled(places)
    controls, hidden, stretch = values[:, :n], values[:, n:], system.stretch(values)
    cost, response, limit = system.values_of(values)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = along[:, :n] / along[:, -1:] * stretch[:, :n] / stretch[:, n + tracer.t, None]
        weights = np.where(points[:, n, None] > NONE, points[:, n, None], 0.0)  # 0 where feasibility ends
        multipliers = np.nan_to_num(
            points[:, n + 1 : n + 1 + m] / weights * (system.cost_scale / system.scales),
            nan=0.0,
            posinf=np.inf,
        )
    pulls = np.abs(pulls) * system.cost_scale / stretch[:, :n]
    margin = np.nan_to_num(curvature * system.cost_scale, nan=0.0, posinf=np.inf, neginf=-np.inf)
    known = controls, slope, hidden[:, tracer.t], multipliers, pulls, cost, response, limit, margin, residual
    return Columns(points, along, *known)


def point_of(tracer: Tracer, held: Ints, point: Floats, along: Floats) -> Columns:
    """Return the columns of one exact point; `along` is a tangent near it."""
    return ends_of(tracer, [TraceRun(point[None], along[None], held)])


def ends_of(tracer: Tracer, runs: Sequence[TraceRun]) -> Columns:
    """Return the columns of the exact points at the ends of runs, a row each."""
    ends = [
        TraceRun(np.repeat(run.nodes[-1:], 2, axis=0), np.repeat(run.tangents[-1:], 2, axis=0), run.held)
        for run in runs
    ]
    return tabulate(tracer, ends, [1] * len(ends))


def pieces(
    problem: Problem, runs: Sequence[tuple[TraceRun, bool]], table: Columns, sizes: Sequence[int]
) -> tuple[Piece, ...]:
    """Return the runs as named pieces with their points."""
    names, responses = problem.names, list(problem.responses)
    n, found, since = len(names), [], 0
    for (run, best), size in zip(runs, sizes, strict=True):
        bounds = {names[i]: "least" if run.held[i] < 0 else "greatest" for i in range(n) if run.held[i] != 0}
        active = tuple(name for j, name in enumerate(responses) if run.held[n + j])
        start, end = (_told(event, names, responses) for event in (run.start, run.end))
        part = table.part(slice(since, since + size))
        found.append(Piece(kind_of(run.held, n), active, bounds, best, start, end, part, run.held))
        since += size
    return tuple(found)


def kind_of(held: Ints, n: int) -> str:
    """Return the kind of a set."""
    if np.any(held[:n]):
        return "bound"
    active = int(np.sum(held[n:]))
    if not active:
        return "interior"
    return "vertex" if active == n else "locus"


def _told(event: tuple[str, int], names: Sequence[str], responses: Sequence[str]) -> str:
    kind, index = event
    if kind in ("least", "greatest", "released"):
        return f"{names[index]} {kind}"
    return f"{responses[index]} {kind}" if kind in ("active", "inactive") else kind
