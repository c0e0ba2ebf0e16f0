"""Optima over several hidden states, followed from the nodes of a grid."""

import itertools
from functools import cached_property
from typing import Any, Self, TypeAlias

import numpy as np
import xarray as xr
from scipy import optimize

from sdpgrind.base import checks, pictures
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan
from sdpgrind.locus._curve.point import Point, named_point
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.system import System, system_of
from sdpgrind.locus._trace.grid import TraceGrid
from sdpgrind.locus._trace.pieces import ends_of, kind_of
from sdpgrind.locus._trace.trace import ROUNDING, Ints, Tracer, TraceRun

Front: TypeAlias = tuple[Floats, Floats, Ints]
"""Scaled hidden states, the optimum there, and its set."""


class Area(Plan):
    """All optima of a problem with several hidden states, in the units of the problem; immutable.

    `at` follows the branches from the surrounding nodes of a grid of exact optima, through changes of the
    active set, and takes the cheapest. Files store a user's own functions as expressions.

    Attributes
    ----------
    problem : Problem
        The problem.
    degenerate : bool
        Whether several points were optimal; the one of the largest slack was taken.
    """

    kind = "locus.area"

    def __init__(self, problem: Problem, grid: TraceGrid, degenerate: bool = False):
        self.problem, self.grid, self.degenerate = problem, grid, degenerate

    @property
    def system(self) -> System:
        """Expressions of the problem; private to this package."""
        return system_of(self.problem, self.degenerate)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the controls."""
        return self.problem.names

    @property
    def responses(self) -> tuple[str, ...]:
        """Names of the measured responses; their units: `Problem.unit`."""
        return self.problem.responses

    @cached_property
    def _places(self) -> Floats:
        return np.linspace(0.0, 1.0, self.grid.points.shape[0])

    @property
    def known(self) -> Any:
        """Mask of grid nodes with a known optimum; scaled hidden states (unit 1) are equally spaced."""
        return np.isfinite(self.grid.residual)

    @property
    def error(self) -> float:
        """Largest scaled residual (unit 1) of the optimality conditions over the grid."""
        return float(np.max(self.grid.residual[self.known]))

    def at(self, **hidden: float) -> Point:
        """Return the exact optimum for hidden states.

        Parameters
        ----------
        **hidden : float
            All hidden states by name, in their units.

        Raises
        ------
        ValueError
            When a state is missing or out of range, or no point is feasible.
        """
        names = self.problem.hidden_names
        if set(hidden) != set(names):
            raise ValueError(f"hidden states must be {', '.join(names)}; got {', '.join(sorted(hidden))}")
        x = np.array(
            [
                checks.within(name, hidden[name], *self.problem.hidden[name], self.problem.unit(name))
                for name in names
            ]
        )
        return self._at(x)

    def _at(self, x: Floats, clamped: bool = False) -> Point:
        place = self.system.scaled(x, self.system.n)
        found = self._ends(place)
        if not found:
            given = ", ".join(
                f"{name} = {value:g}" for name, value in zip(self.problem.hidden_names, x, strict=True)
            )
            raise ValueError(f"hidden states must have a feasible point; none is known at {given}")
        ends = ends_of(Tracer(self.system, place, 0), found)
        k = min(range(len(found)), key=ends.cost.tolist().__getitem__)
        states = dict(zip(self.problem.hidden_names, map(float, x), strict=True))
        kind = kind_of(found[k].held, self.system.n)
        return named_point(self.problem, states, ends.part(slice(k, k + 1)), kind, clamped)

    def _corners(self, place: Floats) -> list[tuple[int, ...]]:
        last = len(self._places) - 1
        low = np.clip(np.searchsorted(self._places, place, side="right") - 1, 0, last - 1)
        around = (tuple(low + step) for step in itertools.product((0, 1), repeat=len(place)))
        return [corner for corner in around if self.known[corner]]

    def _ends(self, place: Floats) -> list[TraceRun]:
        """Follow from the nodes around a place to it, one hidden state after the other.

        Branches that end are left out; those that meet in one point go on as one.
        """
        front = [
            (self._places[list(corner)], self.grid.points[corner], self.grid.held[corner])
            for corner in self._corners(place)
        ]
        for t in (*range(1, len(place)), 0):
            met: list[Front] = []
            for hidden, point, held in front:
                there = self._followed(hidden, point, held, t, place[t])
                if there is not None and not any(_same(there, other) for other in met):
                    met.append(there)
            front = met
        return [
            TraceRun(point[None], np.eye(1, len(point), len(point) - 1), held) for _, point, held in front
        ]

    def _followed(self, hidden: Floats, point: Floats, held: Ints, t: int, end: float) -> Front | None:
        """Follow a point of the hidden states to an end of the t-th; None: the branch ends before."""
        since, point, there = hidden[t], point.copy(), hidden.copy()
        point[-1], there[t] = since, end
        if since == end:
            return there, point, held
        low, high = sorted((since, end))
        run = Tracer(self.system, hidden, t).follow(point, held, np.sign(end - since), low, high)[-1]
        return (there, run.nodes[-1], run.held) if run.end[0] == "range" else None

    def retrieve(self, **measured: float) -> Point:
        """Return the optimum for hidden states inverted from responses measured at any controls.

        Parameters
        ----------
        **measured : float
            All controls and at least as many responses as hidden states, by name, in their units.

        Raises
        ------
        ValueError
            When a name is missing or unknown, a value is not finite, or no point is feasible.
        """
        responses = [name for name in self.responses if name in measured]
        h = len(self.problem.hidden)
        if set(measured) != {*self.names, *responses} or len(responses) < h:
            needed = f"all of {', '.join(self.names)} and {h} of {', '.join(self.responses)}"
            raise ValueError(f"measured must be {needed}; got {', '.join(sorted(measured))}")
        values = {
            name: checks.number(name, value, self.problem.unit(name)) for name, value in measured.items()
        }
        controls = np.array([self.problem.control(name, values[name]) for name in self.names])
        rows = [self.responses.index(name) for name in responses]
        place, clamped = self._inverted(controls, rows, np.array([values[name] for name in responses]))
        return self._at(self.system.unscaled(place, self.system.n), clamped)

    def _inverted(self, controls: Floats, rows: list[int], measured: Floats) -> tuple[Floats, bool]:
        system, scales = self.system, self.system.scales[rows]

        def misfit(place: Floats) -> Floats:
            hidden = system.unscaled(place, system.n)
            return (system.values(controls, hidden)[1][rows] - measured) / scales

        found = optimize.least_squares(
            misfit, np.full(system.h, 0.5), bounds=(0.0, 1.0), xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        return np.clip(found.x, 0.0, 1.0), bool(np.max(np.abs(found.fun)) > 1e-6)

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The grid as labelled arrays with units; NaN where no optimum is known."""
        from sdpgrind.locus._curve.record import area_dataset

        return area_dataset(self.problem, self.grid, self.degenerate)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        from sdpgrind.locus._curve.record import area_fields

        return cls(*area_fields(dataset))

    def plot(self) -> Any:
        """Draw each control over the first two hidden states and return the figure."""
        return pictures.drawn("sdpgrind.locus._curve.picture:area_picture", self)

    @property
    def status(self) -> str:
        """Summary in one sentence (residual in unit 1)."""
        share = np.mean(self.known)
        told = f"{self.known.sum()} exact points, {100 * share:.0f} % of the grid, residual {self.error:.1g}"
        return told + (
            "; many points are as good, the one of the most slack was taken" if self.degenerate else ""
        )

    def _told(self) -> str:
        return self.status


def _same(one: Front, other: Front) -> bool:
    """Return whether two optima of the same hidden states are one; both are exact to rounding."""
    return (
        one[0].tolist() == other[0].tolist()
        and one[2].tolist() == other[2].tolist()
        and bool(np.abs(one[1] - other[1]).max() < ROUNDING)
    )
