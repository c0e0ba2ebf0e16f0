"""Next push: choice, command and table angle of its start."""

from math import ceil, isfinite, nan, pi
from typing import Any, Protocol

from centering._problem.problem import CenteringProblem
from centering.cycle._control.launch import Approach, SentPush, launch, preview
from centering.cycle._control.table_motion import TableMotion
from centering.cycle._strategy.belief import Belief, PushEvidence
from centering.cycle._strategy.outcomes import PushKind
from sdpgrind.base.checks import Floats

_TURN = 2.0 * pi
_LATEST = 1.3  # chosen: samples before the trigger until which a profile can be sent
# chosen: relative change that makes a planned push stale, far ahead and within the time (s)
_ROUGH, _STALE, _SOON = 0.4, 0.1, 0.07


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
        near = isfinite(self.trigger) and table.time_to(self.trigger) < _SOON
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

    def set_trigger(self, direction: float, table: TableMotion) -> None:
        """Set the planned push's next trigger angle, for a high point under the tip at `direction` (rad)."""
        wanted = direction - (self.launch.lead if self.launch is not None else 0.0)
        soonest = table.angle + table.speed * _LATEST * self._problem.limits.sample_time
        self.trigger = wanted + _TURN * ceil((soonest - wanted) / _TURN)


def _kind(choice: ChosenPush) -> PushKind:
    return PushKind(choice.shape, choice.push_speed, choice.retract)


def _stale(planned: Approach, start: Approach, share: float) -> bool:
    """Whether the assumptions of a planned push changed by more than a share."""
    return (
        abs(planned.offset - start.offset) > share * start.offset
        or abs(planned.spindle_speed - start.spindle_speed) > share * start.spindle_speed
        or abs(planned.room - start.room) > 2.0 * share
    )
