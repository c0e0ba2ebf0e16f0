"""Names, axes, stages and edges of a problem for look-ups: plain data, saved with the policy."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.coordinates import Axis, Stages
from sdpgrind.sdp._problem.countdown import Countdown
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._problem.moves import Move
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._problem.stops import StopCharges


@stored("sdp.action_names")
@dataclass(frozen=True)
class ActionNames(Frozen):
    """Move in a policy: name, duration in stages, continuous control and listed controls."""

    name: str
    duration: int
    level: str | None
    lists: tuple[tuple[str, tuple[float, ...]], ...]


@stored("sdp.layout")
@dataclass(frozen=True)
class Layout(Frozen):
    """Names and numbers of a problem.

    `count`: -1 without deadline; `has_base`: the first slice serves all stages before the table.
    """

    axes: tuple[Axis, ...]
    moves: tuple[ActionNames, ...]
    stops: tuple[str, ...]
    modes: tuple[str, ...]
    count: int
    step: float
    stage_name: str
    stage_unit: str
    late: Any
    has_base: bool
    edge_charge: Charge | None
    edge_extra: tuple[float, ...]

    @classmethod
    def of(cls, problem: Problem, grid: Grid, has_base: bool) -> "Layout":
        """Read a problem on its final grid."""
        stages = problem.stages if isinstance(problem.stages, Stages) else None
        stopping = any("stop" in (axis.below, axis.above) for axis in problem.axes)
        extra = tuple(float(x) for x in StopCharges(problem, grid).level()) if stopping else ()
        charge = problem.stops[0].charge if stopping else None
        return cls(
            axes=grid.axes,
            moves=tuple(_names(move) for move in problem.moves),
            stops=tuple(stop.name for stop in problem.stops),
            modes=tuple(problem.modes),
            count=stages.count if stages else -1,
            step=stages.step if stages else 0.0,
            stage_name=stages.name if stages else "",
            stage_unit=stages.unit if stages else "",
            late=stages.late if stages else None,
            has_base=has_base,
            edge_charge=charge if isinstance(charge, Charge) else None,
            edge_extra=extra,
        )

    @property
    def endless(self) -> bool:
        """Whether there is no deadline."""
        return self.count < 0

    @cached_property
    def grid(self) -> Grid:
        """The grid."""
        return Grid(self.axes)

    def countdown(self, first: int) -> Countdown:
        """Return the map of stages to slices, the first one that of stage `first`."""
        return Countdown(self.step, self.late, first, self.has_base, self.endless)


def _names(move: Move) -> ActionNames:
    lists = tuple((name, tuple(float(x) for x in entry)) for name, entry in move.lists.items())
    return ActionNames(move.name, move.duration, move.level_name, lists)
