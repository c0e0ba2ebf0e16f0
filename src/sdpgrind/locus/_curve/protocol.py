"""Interface of a locus for tables and stretches; events."""

from dataclasses import dataclass
from typing import Protocol

from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.system import System
from sdpgrind.locus._trace.pieces import Columns, Piece


@dataclass(frozen=True)
class Event:
    """An event at one value of the hidden state.

    Attributes
    ----------
    kind : str
        "<constraint> active" or "inactive", "<control> least", "greatest" or "released", for a rising hidden
        state; "fold", "jump", "infeasible", "branch point".
    hidden : float
        Hidden state, in its unit.
    controls : dict
        Controls at the event.
    """

    kind: str
    hidden: float
    controls: dict[str, float]


class Curve(Protocol):
    """Locus as seen by tables and stretches; see `Locus`."""

    @property
    def problem(self) -> Problem: ...
    @property
    def system(self) -> System: ...
    @property
    def names(self) -> tuple[str, ...]: ...
    @property
    def hidden_name(self) -> str: ...
    @property
    def responses(self) -> tuple[str, ...]: ...
    @property
    def best(self) -> tuple[Piece, ...]: ...
    @property
    def jumps(self) -> tuple[Event, ...]: ...
    def point_at(self, piece: Piece, x: float) -> Columns: ...
