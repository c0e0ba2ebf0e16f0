"""Next push: choice, command and table angle of its start."""

from math import ceil, isfinite, nan, pi
from typing import Any, Protocol

from centering._problem.problem import CenteringProblem
from centering.cycle._control.launch import Approach, SentPush, launch, preview
from centering.cycle._control.table_motion import TableMotion
from centering.cycle._strategy.belief import Belief, PushEvidence
from centering.cycle._strategy.outcomes import PushKind
from centering.cycle._strategy.tip_ways import LATEST
from sdpgrind.base.checks import Floats

_TURN = 2.0 * pi
# chosen: relative change that makes a planned push stale, far ahead and shortly before it
_ROUGH, _STALE = 0.4, 0.03
_STANDS = 1e-6  # rad/s, chosen: a table that does not turn
_SOON = 0.07  # s, chosen: before a push it is planned exactly; a rough plan may start later


class ChosenPush(Protocol):
    """Answer of a strategy."""

    @property
    def aim(self) -> float: ...
    @property
    def stroke(self) -> float: ...
    @property
    def shape(self) -> str: ...
    @property
    def push_speed(self) -> float: ...
    @property
    def retract(self) -> bool: ...
    @property
    def spindle_speed(self) -> float: ...


class PushStrategy(Protocol):
    """Interface of a strategy for the controller."""

    @property
    def problem(self) -> CenteringProblem: ...
    @property
    def finish(self) -> float: ...
    @property
    def offset_max(self) -> float: ...
    def push(self, *, offset: float, friction: float, evidence: float) -> ChosenPush: ...
    def update_belief(
        self,
        friction: float,
        evidence: float,
        commanded: Any,
        travelled: float,
        *,
        weights: Floats | None = None,
        shown: PushEvidence | None = None,
    ) -> tuple[float, float] | Belief: ...


class NextPush:
    """Chooses the push and replans it when assumptions change: coarsely at first, exactly when it is sent.

    Parameters
    ----------
    strategy : Strategy
        Sequence of pushes.
    lag : float
        Delay of the loaded slide, s.
    """

    def __init__(self, strategy: PushStrategy, lag: float) -> None:
        self._strategy, self._problem, self._lag = strategy, strategy.problem, lag
        self._least = strategy.finish * (1.0 + 1e-6)
        self.forget()

    def forget(self) -> None:
        """Drop choice and plan."""
        self.choice: ChosenPush | None = None
        self.launch: SentPush | None = None
        self.trigger = nan
        self.start, self._exact = Approach(0.0, 0.0, 0.0), False
        self._asked = (nan, nan, nan)
        self._answer: ChosenPush | None = None

    def ask(self, offset: float, friction: float, evidence: float) -> ChosenPush:
        """Return the choice of the strategy at an offset (mm), clamped to its range.

        Parameters
        ----------
        offset : float
            Offset, mm.
        friction, evidence : float
            Belief: friction scale, and evidence in pushes.
        """
        asked = (min(max(offset, self._least), self._strategy.offset_max), friction, evidence)
        if self._answer is None or asked != self._asked:
            self._asked = asked
            self._answer = self._strategy.push(offset=asked[0], friction=friction, evidence=evidence)
        return self._answer

    def plan(self, choice: ChosenPush, start: Approach, friction: float, table: TableMotion) -> None:
        """Plan a push unless a plan exists for about the same `start` (mm, rad/s): coarsely until it is due.

        Parameters
        ----------
        choice : PushChoice
            The push.
        start : Approach
            Its start.
        friction : float
            Believed friction scale.
        table : TableMotion
            Motion of the table, for the time left.
        """
        rough = 0.0 if self.launch is None else _ROUGH * self.launch.stop_time
        near = isfinite(self.trigger) and table.time_to(self.trigger) < _SOON + rough
        if near and (not self._exact or _stale(self.start, start, _STALE)):
            self.finish_plan(choice, start, friction)
        elif self.launch is None or _stale(self.start, start, _ROUGH):
            self.launch = preview(
                _kind(choice), choice.stroke, start, self._problem.model, self._problem.limits, friction
            )
            self.start, self._exact = start, False

    def finish_plan(self, choice: ChosenPush, start: Approach, friction: float) -> SentPush:
        """Plan a push exactly and return it; parameters as for `plan` (mm, rad/s)."""
        model, limits = self._problem.model, self._problem.limits
        self.launch = launch(_kind(choice), choice.stroke, start, model, limits, self._lag, friction)
        self.start, self._exact = start, True
        return self.launch

    def arriving(self, direction: float, table: TableMotion) -> float:
        """Return the table speed (rad/s) at the start of the soonest push of a part at `direction` (rad).

        A push takes about the same time up to its alignment at any speed, and a table that gains speed turns
        less in it: the speed of a later turn would have the sooner one seem missed.
        """
        steady = 0.0 if self.launch is None else self.launch.lead / max(self.start.spindle_speed, _STANDS)
        aligned = direction + _TURN * ceil((table.angle - direction) / _TURN)
        while table.time_to(aligned, steady) < steady + self._latest:
            aligned += _TURN
        return table.speed_in(table.time_to(aligned, steady) - steady)

    def set_trigger(self, direction: float, table: TableMotion, arriving: float) -> None:
        """Set the angle at which the planned push starts next.

        Parameters
        ----------
        direction : float
            Table angle with the high point under the tip, rad.
        table : TableMotion
            Motion of the table.
        arriving : float
            Table speed at the start, rad/s; a push that was planned for another one takes as long.
        """
        lead = 0.0
        if self.launch is not None:
            lead = self.launch.lead * arriving / max(self.start.spindle_speed, _STANDS)
        soonest = table.angle + table.speed * self._latest
        self.trigger = direction - lead + _TURN * ceil((soonest - direction + lead) / _TURN)

    @property
    def _latest(self) -> float:
        """Time before its start until which a push can be sent, s."""
        return LATEST * self._problem.limits.sample_time


def _kind(choice: ChosenPush) -> PushKind:
    return PushKind(choice.shape, choice.push_speed, choice.retract)


def _stale(planned: Approach, start: Approach, share: float) -> bool:
    """Whether the assumptions of a planned push changed by more than a share."""
    return (
        abs(planned.offset - start.offset) > share * start.offset
        or abs(planned.spindle_speed - start.spindle_speed) > share * start.spindle_speed
        or abs(planned.room - start.room) > 2.0 * share
    )
