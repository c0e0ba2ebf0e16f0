"""What tables and stretches ask of a locus, so that they need not import it; and its events."""

from dataclasses import dataclass
from typing import Protocol

from sdpgrind.locus._problem.problem import Problem
from sdpgrind.locus._problem.system import System
from sdpgrind.locus._trace.pieces import Columns, Piece


@dataclass(frozen=True)
class Event:
    """Something that happens at one value of the hidden state.

    Attributes
    ----------
    kind : str
        "<constraint> active" or "inactive", "<control> least", "greatest" or "released", as the hidden state rises; "fold",
        "jump", "infeasible", "branch point".
    hidden : float
        Where, in the unit of the hidden state.
    controls : dict
        The controls there.
    """

    kind: str
    hidden: float
    controls: dict[str, float]


class Curve(Protocol):
    """A locus, as far as others need it; see `Locus`."""

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
