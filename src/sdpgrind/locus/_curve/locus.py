"""The optimal locus over one hidden state: pieces, events, and the optimum for a state or a measurement."""

from collections.abc import Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import xarray as xr

from sdpgrind.base import checks, pictures
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan
from sdpgrind.locus._curve.inversion_kernels import find_state
from sdpgrind.locus._curve.point import Point, named_point
from sdpgrind.locus._curve.protocol import Event as Event
from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.system import System, system_of
from sdpgrind.locus._problem.tape_kernels import run, work_size
from sdpgrind.locus._trace import trace_kernels as kernels
from sdpgrind.locus._trace.kkt_kernels import GOOD
from sdpgrind.locus._trace.pieces import Columns, Piece, point_of
from sdpgrind.locus._trace.table_kernels import INSIDE
from sdpgrind.locus._trace.trace import ROUNDING, Tracer

if TYPE_CHECKING:
    from sdpgrind.base.sheets.blocks import AmountTable
    from sdpgrind.codegen import Recipe
    from sdpgrind.locus._curve.inversion import Inversion
    from sdpgrind.locus._path.stretch import Stretch
    from sdpgrind.locus._trace.table import LocusTable


# chosen: scaled distance, absolute and relative to that of the nodes, beyond which Newton found another
# branch
NEAR, FAR = 1e-6, 0.25


class Locus(Plan):
    """All optima of a problem with one hidden state, in the units of the problem; immutable.

    Files store a user's own functions as expressions.

    Attributes
    ----------
    problem : Problem
        The problem.
    pieces : tuple of Piece
        Global and merely local optima, branch by branch.
    degenerate : bool
        Whether several points were optimal; the one of the largest slack was taken.
    """

    kind = "locus.curve"

    def __init__(self, problem: Problem, table: Columns, pieces: tuple[Piece, ...], degenerate: bool = False):
        self.problem, self._table, self.pieces, self.degenerate = problem, table, pieces, degenerate

    @property
    def system(self) -> System:
        """Expressions of the problem; private to this package."""
        return system_of(self.problem, self.degenerate)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the controls."""
        return self.problem.names

    @property
    def hidden_name(self) -> str:
        """Name of the hidden state; its unit: `Problem.unit`."""
        return self.problem.hidden_names[0]

    @property
    def responses(self) -> tuple[str, ...]:
        """Names of the measured responses; their units: `Problem.unit`."""
        return self.problem.responses

    @property
    def error(self) -> float:
        """Largest scaled residual (unit 1) of the optimality conditions over all points."""
        return float(np.max(self._table.residual))

    @cached_property
    def best(self) -> tuple[Piece, ...]:
        """The global pieces, by rising hidden state (units of the problem)."""
        return tuple(
            sorted((piece for piece in self.pieces if piece.is_global), key=lambda piece: piece.range)
        )

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """Events along all pieces, by rising hidden state (units of the problem)."""
        found: dict[tuple[str, float], Event] = {}
        for piece in self.pieces:
            for kind, k in ((piece.start, 0), (piece.end, -1)):
                x = float(piece.table.hidden[k])
                if kind not in ("", "range"):
                    found.setdefault(
                        (kind, round(x, 12)), Event(kind, x, self._named(piece.table.controls[k]))
                    )
        return tuple(sorted(found.values(), key=lambda event: event.hidden))

    @property
    def folds(self) -> tuple[Event, ...]:
        """Turning points of branches (units of the problem)."""
        return tuple(event for event in self.events if event.kind == "fold")

    @property
    def jumps(self) -> tuple[Event, ...]:
        """Changes to another branch (units of the problem)."""
        return tuple(event for event in self.events if event.kind == "jump")

    @cached_property
    def range(self) -> tuple[float, float]:
        """Least and greatest hidden state with an optimum, in its unit."""
        return self.best[0].range[0], self.best[-1].range[1]

    @cached_property
    def _ends(self) -> Floats:
        return np.array([piece.range[1] for piece in self.best])

    def _named(self, values: Iterable[float]) -> dict[str, float]:
        return dict(zip(self.names, map(float, values), strict=True))

    def at(self, *, throw: bool = True, **hidden: float) -> Point:
        """Return the exact optimum for a hidden state.

        Parameters
        ----------
        **hidden : float
            The hidden state by its name, in its unit.
        throw : bool
            Whether a state out of range is an error. False: it is clamped, and the point is marked so.

        Raises
        ------
        ValueError
            When the state is not finite, of another name, out of range, or without a feasible point.
        """
        name = self.hidden_name
        if set(hidden) != {name}:
            raise ValueError(
                f"hidden state must be given by its name, {name}=...;"
                f" got {', '.join(sorted(hidden)) or 'nothing'}"
            )
        x = checks.number(name, hidden[name], self.problem.unit(name))
        point, (low, high) = self._at(x), self.range
        if throw and point.clamped:
            raise checks.refuse(
                name, f"in [{low:g}, {high:g}], where best points are known", x, self.problem.unit(name)
            )
        return point

    def _at(self, x: float, clamped: bool = False) -> Point:
        low, high = self.range
        clamped = clamped or max(low - x, x - high) > ROUNDING * (high - low)  # error of the ends
        x = min(max(x, low), high)
        piece = self._piece(x)
        return named_point(self.problem, {self.hidden_name: x}, self.point_at(piece, x), piece.kind, clamped)

    def point_at(self, piece: Piece, x: float) -> Columns:
        """Return the exact row of a piece at a hidden state; private to this package."""
        table, n, m = piece.table, self.system.n, self.system.m
        place = self.system.scaled(np.array([x]), n)
        k = int(np.clip(np.searchsorted(table.hidden, x), 1, len(table.hidden) - 1))
        point, near = np.empty_like(table.points[0]), k - (table.hidden[k] - x > x - table.hidden[k - 1])
        ends = (table.points[k - 1], table.points[k], table.along[k - 1], table.along[k])
        length = kernels.between(*ends, place[0], point)
        guess, kkt, hidden = point.copy(), self.system.kkt_tape, np.zeros(1)
        left = kernels.settle_at(kkt, n, m, 1, hidden, 0, piece.held, point, 20)
        if not left <= GOOD or np.max(np.abs(point - guess)) > max(NEAR, FAR * length):
            point = guess  # at an end, where multipliers or slopes have no limit
        return point_of(Tracer(self.system, hidden), piece.held, point, table.along[near])

    def _piece(self, x: float) -> Piece:
        k = min(int(np.searchsorted(self._ends, x)), len(self.best) - 1)
        piece = self.best[k]
        if x < piece.range[0]:
            before = self.best[k - 1].range[1]
            if piece.range[0] - before <= NEAR * (self.range[1] - self.range[0]):  # where branches part
                return piece
            gap = f"between {before:.6g} and {piece.range[0]:.6g} none is known"
            raise ValueError(f"{self.hidden_name} must have a feasible point: {gap}; got {x:g}")
        return piece

    def retrieve(self, *, throw: bool = False, **measured: float) -> Point:
        """Return the optimum for the hidden state inverted from one response measured at any controls.

        Parameters
        ----------
        **measured : float
            All controls and one response, by name, in their units.
        throw : bool
            Whether a measurement that no hidden state explains is an error. False: the state is clamped.

        Raises
        ------
        ValueError
            When a name or value is invalid, or the response is independent of the hidden state there.
        """
        responses = [name for name in self.responses if name in measured]
        if set(measured) != {*self.names, *responses} or len(responses) != 1:
            needed = f"all of {', '.join(self.names)} and one of {', '.join(self.responses)}"
            raise ValueError(f"measured must be {needed}; got {', '.join(sorted(measured))}")
        values = {
            name: checks.number(name, value, self.problem.unit(name)) for name, value in measured.items()
        }
        controls = np.array([self.problem.control(name, values[name]) for name in self.names])
        x, inside = self._inverted(controls, responses[0], values[responses[0]])
        if throw and not inside:
            raise checks.refuse(
                responses[0], "what some hidden state in its range explains", values[responses[0]]
            )
        return self._at(x, clamped=not inside)

    def _inverted(self, controls: Floats, response: str, measured: float) -> tuple[float, bool]:
        tape, (low, high) = self.system.response_tape, self.problem.hidden[self.hidden_name]
        out, work = np.empty(2 * self.system.m), np.empty(work_size(tape))
        inputs = np.append(controls, 0.5 * (low + high))
        run(tape, inputs, work, out)
        j, slope = self.responses.index(response), self.system.m + self.responses.index(response)
        if not abs(out[slope]) > 0.0:
            raise ValueError(
                f"{response} must tell something of {self.hidden_name}; at these controls it tells nothing"
            )
        places = (len(controls), j, slope)
        flag = find_state(tape, inputs, places, low, high, np.sign(out[slope]), measured, work, out)
        return float(inputs[-1]), flag == INSIDE

    def table(self, key: str | None = None, *, points: int = 200) -> "LocusTable":
        """Return the optimal controls as a compiled table: cubic with exact slopes.

        Parameters
        ----------
        key : str, optional
            Hidden state (None), control, or response equal to its limit (Koren, Fig. 2), in its unit.
        points : int
            Approximate number of nodes.

        Raises
        ------
        ValueError
            When the key is not monotone along the locus.
        """
        from sdpgrind.locus._curve.tables import table

        return table(self, key, points)

    def __export__(self) -> "Recipe":
        """Return what `sdpgrind.export` writes of it: its table by the hidden state."""
        return self.table().__export__()

    def inversion(self, response: str | None = None, *, points: int = 200) -> "Inversion":
        """Return the compiled map from a response at any controls to hidden state and optimal controls.

        Parameters
        ----------
        response : str, optional
            Name of the response, in its unit. None: the first.
        points : int
            Approximate number of nodes of the table.

        Raises
        ------
        ValueError
            When the response is not monotone in the hidden state.
        """
        from sdpgrind.locus._curve.tables import inversion

        return inversion(self, response, points)

    def stretch(self, along: str, x: tuple[float, float] | None = None) -> "Stretch":
        """Return the part on which a controller may move; see `Stretch`.

        Parameters
        ----------
        along : str
            Coordinate: a control or the hidden state, single-valued there.
        x : (float, float), optional
            Least and greatest hidden state, in its unit. Default: range of the problem.

        Raises
        ------
        ValueError
            When the range has a fold, a jump, a part without active constraint, or `along` turns in it.
        """
        from sdpgrind.locus._curve.stretch import stretch

        return stretch(self, along, x)

    @cached_property
    def dataset(self) -> xr.Dataset:
        """All points as labelled arrays with units."""
        from sdpgrind.locus._curve.record import dataset_of

        return dataset_of(self.problem, self.pieces, self.degenerate)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        from sdpgrind.locus._curve.record import fields_in

        return cls(*fields_in(dataset))

    def plot(self) -> Any:
        """Draw controls and responses over the hidden state and the first two controls; return the figure."""
        return pictures.drawn("sdpgrind.locus._curve.picture:picture", self)

    def _figures(self) -> "tuple[AmountTable]":
        from sdpgrind.locus._curve.record import best_points

        return (best_points(self.problem, [piece.table for piece in self.best], self.error),)

    @property
    def status(self) -> str:
        """Summary in one sentence (units of the problem)."""
        low, high = self.range
        count = f"{len(self.best)} piece{'s' if len(self.best) > 1 else ''}"
        told = f"{count} over {self.hidden_name} = {low:.6g} to {high:.6g}, residual {self.error:.1g}"
        if self.jumps:
            told += f"; jumps at {', '.join(f'{event.hidden:.6g}' for event in self.jumps)}"
        if self.folds:
            told += f"; folds at {', '.join(f'{event.hidden:.6g}' for event in self.folds)}"
        first, last = self.problem.hidden[self.hidden_name]
        if max(low - first, last - high) > 1e-9 * (last - first):
            told += f"; no best point was found elsewhere in {first:g} to {last:g}"
        return told + (
            "; many points are as good, the one of the most slack was taken" if self.degenerate else ""
        )

    def _told(self) -> str:
        return self.status
