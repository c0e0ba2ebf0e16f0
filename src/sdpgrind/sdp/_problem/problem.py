"""Description of a problem: axes, moves, stops, stages, modes.

Callbacks get named tuples ``s`` (state coordinates; the stage coordinate of a ``timed`` move; ``mode``, a
whole number, of a problem with modes), ``c`` (controls) and ``e`` (noise). They are written elementwise
(operators and numpy functions, no ``if``): one body runs on floats in a compiled kernel and on broadcast
arrays in numpy.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from sdpgrind.base import checks, notebook
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.coordinates import Axis, Forever, Stages
from sdpgrind.sdp._problem.moves import Move, Stop


@dataclass(frozen=True)
class Problem:
    """Problem for the solver: axes, moves, stops, stages and modes.

    Parameters
    ----------
    axes : sequence of Axis
        Zero to three continuous coordinates.
    moves : sequence of Move
        Moves, in the order in which ties are broken.
    stops : sequence of Stop
        Stops; they win ties with moves.
    stages : Stages or Forever
        Countdown.
    modes : sequence of str
        Names of the discrete part of the state. In callbacks ``s.mode`` is the number of the mode in this
        order, a whole number or an array.
    """

    axes: Sequence[Axis]
    moves: Sequence[Move]
    stops: Sequence[Stop]
    stages: Stages | Forever
    modes: Sequence[str] = ("",)

    def __post_init__(self) -> None:
        for name in ("axes", "moves", "stops", "modes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if len(self.axes) > 3:
            raise ValueError(f"axes must be at most 3; got {len(self.axes)}")
        checks.unique("axes", [axis.name for axis in self.axes])
        checks.unique("modes", self.modes)
        names = [stop.name for stop in self.stops] + [move.name for move in self.moves]
        checks.unique("names of stops and moves", names)
        if not self.moves:
            raise ValueError("moves must hold at least one Move; got none")
        self._check_modes()
        self._check_edges()

    def _check_modes(self) -> None:
        for move in self.moves:
            into = (move.into,) if isinstance(move.into, str) else tuple(move.into or ())
            for name in into:
                checks.one_of(f"move {move.name!r}: into", name, self.modes)
            if not isinstance(move.into, str) and into and len(into) != move.choices:
                raise ValueError(
                    f"move {move.name!r}: "
                    f"into must name {move.choices} modes, one for each control; got {len(into)}"
                )
            if move.timed and isinstance(self.stages, Forever):
                raise ValueError(f"move {move.name!r}: timed must be False where stages is Forever; got True")

    def _check_edges(self) -> None:
        stopping = [axis.name for axis in self.axes if "stop" in (axis.below, axis.above)]
        exact = len(self.axes) == 1 and len(self.stops) == 1 and isinstance(self.stops[0].charge, Charge)
        two_axes = len(stopping) == 1 and len(self.stops) == 1 and isinstance(self.stops[0].charge, Charge)
        if stopping and not (exact or two_axes):
            raise ValueError(
                f"the edge 'stop' of {stopping[0]!r} needs exactly one Stop "
                "whose charge is a Charge of that axis"
            )

        numbers = [
            axis.name
            for axis in self.axes
            if not isinstance(axis.below, str) or not isinstance(axis.above, str)
        ]
        if numbers and isinstance(self.stages, Stages) and self.stages.late is not None:
            raise ValueError(
                f"the ends of the axis {numbers[0]!r} must not be numbers beside a late charge,"
                " which they would not bear; use 'stop'"
            )

    @property
    def stop_axis(self) -> int:
        """Index of the axis of a `Charge`: the one with a stopping edge, else the first."""
        return next((k for k, axis in enumerate(self.axes) if "stop" in (axis.below, axis.above)), 0)

    @property
    def step(self) -> float:
        """Length of a stage, in the unit of the stages (0 for `Forever`)."""
        return self.stages.step if isinstance(self.stages, Stages) else 0.0

    def _repr_html_(self) -> str:
        rows = [
            *(("axis", axis.name, f"{axis.low:g} to {axis.high:g}", axis.unit) for axis in self.axes),
            *(("stop", stop.name, "", "") for stop in self.stops),
            *(("move", move.name, ", ".join(move.controls), "") for move in self.moves),
        ]
        head = ("part", "name", "range or controls", "unit")
        return notebook.table(f"Problem, {self.stages!r}", head, rows)
