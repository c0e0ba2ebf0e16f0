"""The controller of the centering cycle: measure while the table runs up, push as soon as that pays, finish when sure."""

from collections.abc import Mapping
from math import ceil, hypot, isfinite, pi
from typing import Any, ClassVar, Protocol

from centering._cycle.cycle_base import Command, CycleBase
from centering._cycle.cycle_launch import Approach, Launch, launch, run_up
from centering._cycle.cycle_learning import LearnedBias, Travel
from centering._cycle.cycle_view import PartView
from centering._cycle.following import FollowingGains
from centering._cycle.outcomes import PushKind
from centering._cycle.settings import CycleSettings
from centering._cycle.states import CycleState
from centering._push.problem import CenteringProblem
from sdpgrind.base import checks

_TURN = 2.0 * pi
_LATEST, _EARLIEST, _FREEZE = 1.3, 2.7, 5.0  # samples before: a profile can still be sent; is sent; the slide is stopped
_STOPPED = 0.5  # mm/s: commanded speed of a slide that counts as waiting
_STALE = 0.02  # relative change of offset or table speed that makes a planned push stale
_SOON = 0.07  # s
_TOLD, _HIDDEN = 0.05, 2e-3  # of the wanted travel, and mm: what turning may add before a push tells nothing of friction
_LONG = 1.0  # mm: what a longer push is off by is more of its direction than of friction, and small pushes tell it better
_MEMORY = 4.0  # pushes' worth of evidence at most: friction may change, and models err
_TELLING = 0.02  # mm: shorter travels say nothing about the direction
_DIRECTION_BIAS = 0.0035  # rad: sd of a constant error of direction, before anything is known
_NEARER = 0.05  # mm by which the slide may wait further out than it need


class ChosenPush(Protocol):
    """What a strategy answers."""

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
    """What the controller asks of a strategy."""

    @property
    def problem(self) -> CenteringProblem: ...
    @property
    def finish(self) -> float: ...
    def push(self, *, offset: float, friction: float, pushes: float) -> ChosenPush: ...
    def update_belief(self, friction: float, pushes: float, commanded: Any, travelled: float) -> tuple[float, float]: ...


class CenteringController(CycleBase):
    """Centre a part in the least time that its strategy knows; see `hwsim.protocols.Controller`.

    The slide does not follow the rim: it waits as near as the rim comes, so that approaches are short, and the probe, which has
    the stroke for it, follows alone. Every reading goes to a `GeometryEstimator`, while the table runs up, too; after a push the
    radius stays known. A push is sent two samples before it begins, with the angle of the table at which it begins, so that it
    starts within a sample; until then it is planned anew as the estimate improves. It is not waited for a sure estimate: a push
    that measuring errors spoil less than its own scatter is worth more. "Centred" is said only when the offset and its
    uncertainty are within the tolerance.

    Parameters
    ----------
    strategy : Strategy
        Which push when: `plan(problem)`.
    settings : CycleSettings, optional
        Of machine and cycle.
    gains : FollowingGains, optional
        Of the slide where it moves to its place.

    Raises
    ------
    TypeError
        When `strategy` is none.

    Examples
    --------
    >>> import centering, hwsim  # doctest: +SKIP
    >>> problem = centering.preset("printed")  # doctest: +SKIP
    >>> controller = centering.CenteringController(centering.plan(problem))  # doctest: +SKIP
    >>> hwsim.run(hwsim.CenteringMachine(problem), controller).outcome  # doctest: +SKIP
    """

    reports: ClassVar[Mapping[str, str]] = {
        "state": "",
        "offset": "mm",
        "offset_angle": "rad",
        "band": "mm",
        "friction": "",
        "pushes": "",
        "lead_angle": "rad",
        "trigger_angle": "rad",
    }

    def __init__(
        self, strategy: PushStrategy, *, settings: CycleSettings | None = None, gains: FollowingGains | None = None
    ) -> None:
        self.strategy = checks.able("strategy", strategy, "a strategy such as centering.plan(problem)", "push", "update_belief")
        self._view = PartView(strategy.problem.model.part.radius, settings or CycleSettings())
        self._direction = LearnedBias(_DIRECTION_BIAS)
        super().__init__(strategy.problem, settings, gains)

    def _begin(self) -> None:
        super()._begin()
        self._view.reset()
        self._direction.reset()
        self._friction = 1.0
        self._evidence = 0.0  # pushes' worth of what the belief has seen
        self._expected = self.problem.offset_max  # offset, mm, while there is no estimate
        self._before: tuple[float, float, float] | None = None  # centre and its sd before the last push
        self._pushed: ChosenPush | None = None  # the last push
        self._aimed = self._beyond = 0.0  # its direction on the table (rad), and what turning adds to its travel (mm)
        self._choice: ChosenPush | None = None
        self._launch: Launch | None = None
        self._planned = Approach(0.0, 0.0, 0.0)
        self._trigger = float("nan")
        self._rest_angle = 0.0  # of the table, from which on the part is at rest again

    def reset(self) -> None:
        """Forget the part before."""
        self._begin()

    def step(
        self,
        *,
        time: float,
        angle: float,
        slide: float,
        probe: float,
        force: float = 0.0,
        spindle_speed: float = 0.0,
        pushing: float = 0.0,
        **others: Any,
    ) -> Command:
        """Return what slide and table shall do until the next sample.

        Parameters
        ----------
        time, angle : float
            s; of the table, rad, turns counted.
        slide, probe : float
            mm, both positive away from the axis; together where the rim is on the push line. A probe that touches nothing: NaN.
        force : float
            Of the tip, N.
        spindle_speed : float
            Of the table, rad/s.
        pushing : float
            1 while a profile runs.
        **others
            Whatever else the machine measures; not used.
        """
        if self._state.over:
            return self._last
        self._sense(time, angle, slide, probe, spindle_speed)
        trouble = self._trouble(force, pushing > 0.5)
        if trouble is not None:
            return self._end(trouble)
        if self._state is CycleState.PUSH:
            return self._pushing(pushing > 0.5)
        if self._state is CycleState.WAIT and (pushing > 0.5 or self._table.angle >= self._trigger):
            return self._begin_push(pushing > 0.5)
        return self._measuring()

    def report(self) -> dict[str, float]:
        """Return what is known and intended: state, offset (mm), its direction (rad), band (mm), friction, angles (rad)."""
        view = self._view
        told = {"state": float(self._state), "friction": self._friction, "pushes": float(self._pushes)}
        if view.known:
            told |= {"offset": view.offset, "offset_angle": view.offset_angle, "band": view.band}
        if self._launch is not None and isfinite(self._trigger):
            told |= {"lead_angle": self._launch.lead, "trigger_angle": self._trigger}
        return told

    # ---- measuring ------------------------------------------------------------------------------------------------

    def _measuring(self) -> Command:
        """Take the reading in, decide, and keep the slide where it waits."""
        if isfinite(self._reading):
            self._view.take(self._table.angle, self._reading)
            if self._state is CycleState.APPROACH:
                self._state = CycleState.COLLECT
        view = self._view
        if self._state is CycleState.WAIT:
            return {}
        if view.known:
            self._expected = view.offset
            return self._decide()
        return self._stand_off(self._expected) | self._turn_at(self._speed_for(self._expected))

    def _decide(self) -> Command:
        """Finish, go on measuring, or work toward the next push."""
        view, tolerance = self._view, self.problem.tolerance
        doubt = self.settings.doubt * view.band
        if view.offset + doubt <= tolerance:
            return self._end(CycleState.CENTERED)
        maybe = view.offset - doubt <= tolerance
        self._state = CycleState.CHECK if maybe else CycleState.COLLECT
        if maybe and view.turns < self.settings.turns_in_doubt:
            return self._stand_off(view.offset) | self._turn_at(self._speed_for(max(view.offset, tolerance)))
        if self._pushes >= self.problem.pushes_max:
            return self._end(CycleState.TIMEOUT)
        return self._prepare()

    def _stand_off(self, offset: float) -> Command:
        """Let the tip wait outside the furthest that the rim comes, but never so far off that the probe loses it."""
        furthest = self._view.radius + offset + self._room()
        if isfinite(self._reading):
            furthest = min(furthest, self._reading + 0.9 * self.settings.probe_reach)
        if 0.0 <= self._tip - furthest <= _NEARER * self.settings.margin and abs(self._velocity) < _STOPPED:
            return self._stand_still()
        return self._stand_at(furthest + 0.5 * _NEARER * self.settings.margin)

    def _room(self) -> float:
        """Between the tip that waits and the furthest that the rim comes, mm: what the run-up needs, and what is not known."""
        need = run_up(self._choice.push_speed, self.problem.limits) if self._choice is not None else self.settings.margin
        unsure = 4.0 * self._view.sd if self._view.known else 0.0
        return max(need, 0.3 * self.settings.margin) + min(unsure, self.settings.margin)

    # ---- before a push --------------------------------------------------------------------------------------------

    def _speed_for(self, offset: float) -> float:
        """Table speed that the strategy wants at an offset, rad/s."""
        return self._choose(offset).spindle_speed

    def _choose(self, offset: float) -> ChosenPush:
        """What the strategy does at an offset; one that it would leave alone is pushed as the least that it would not."""
        least = self.strategy.finish * (1.0 + 1e-6)
        return self.strategy.push(offset=max(offset, least), friction=self._friction, pushes=self._evidence)

    def _prepare(self) -> Command:
        """Choose and plan the push; stop the slide in time; send the push when it is due."""
        view, table = self._view, self._table
        if self._good_enough():
            self._learn()
        self._choice = choice = self._choose(view.offset)
        standing = self._stand_off(view.offset)
        turning = self._turn_at(choice.spindle_speed) if self._launch is None else {}
        self._plan(choice, table.speed_at(self._trigger) if isfinite(self._trigger) else choice.spindle_speed)
        samples = table.time_to(self._trigger) / self.period
        if samples > _FREEZE or not self._good_enough():
            return standing | turning | self._turn_at(choice.spindle_speed)
        arriving = table.speed_at(self._trigger)
        command = self._stand_still() | self._turn_at(arriving)
        if samples > _EARLIEST:
            return command
        return command | self._send(choice, arriving)

    def _plan(self, choice: ChosenPush, speed: float) -> Launch:
        """Plan the push again where what it rests on has changed, and find the next angle at which it can begin."""
        view = self._view
        room = max(self._tip - view.radius - view.offset, 0.0)
        start = Approach(view.offset, room, speed)
        if self._launch is None or _stale(self._planned, start, self._near()):
            self._launch = self._launched(choice, start)
            self._planned = start
        wanted = view.offset_angle - self._launch.lead - self._direction.value - self.settings.manual_lead
        soonest = self._table.angle + self._table.speed * _LATEST * self.period
        self._trigger = wanted + _TURN * ceil((soonest - wanted) / _TURN)
        return self._launch

    def _near(self) -> float:
        """Relative change that makes a planned push stale: little only when it is soon due."""
        if not isfinite(self._trigger):
            return _STALE
        return _STALE if self._table.time_to(self._trigger) < _SOON else 20.0 * _STALE

    def _launched(self, choice: ChosenPush, start: Approach) -> Launch:
        """The push with the part's friction as it is believed to be."""
        model = self.problem.model
        felt = model.replace(mu_static=model.mu_static * self._friction, mu_kinetic=model.mu_kinetic * self._friction)
        kind = PushKind(choice.shape, choice.push_speed, choice.retract)
        return launch(kind, choice.stroke, start, felt, self.problem.limits, self.settings.following_lag)

    def _good_enough(self) -> bool:
        """Whether measuring errors spoil the push less than its own scatter does."""
        view, scatter = self._view, self.problem.scatter
        own = hypot(scatter.direction_sd * view.offset, scatter.stop_sd, scatter.measuring_sd)
        return view.sd <= own

    def _send(self, choice: ChosenPush, speed: float) -> Command:
        """Send the push with the latest estimate."""
        self._view.look()
        self._launch = None
        push = self._plan(choice, speed)
        if self._table.time_to(self._trigger) > _FREEZE * self.period:  # it has just been missed
            return {}
        self._state = CycleState.WAIT
        return {"profile": push.rows, "profile_angle": self._trigger}

    # ---- the push and after ---------------------------------------------------------------------------------------

    def _begin_push(self, begun: bool) -> Command:
        """Note where the part was, and forget it."""
        push, view, choice = self._launch, self._view, self._choice
        if push is None or choice is None:
            raise RuntimeError("a push began that was not planned")
        self._state = CycleState.PUSH
        self._pushes += 1
        self._before = (view.x, view.y, view.sd)
        self._pushed, self._aimed = choice, view.offset_angle + pi - self._direction.value
        self._beyond = push.beyond
        speed = max(self._table.set_point, 1e-6)
        thrown = 0.0 if choice.shape == "gentle" else 2.0 * choice.push_speed / (self.problem.model.mu_kinetic * 9807.0)
        self._rest_angle = self._trigger + speed * (push.stop_time + thrown + self.period)
        view.moved()
        return {}

    def _pushing(self, runs: bool) -> Command:
        """Wait for the part to rest; readings count from then on, even while the tip goes back."""
        if self._table.angle < self._rest_angle:
            return {}
        if isfinite(self._reading):
            self._view.take(self._table.angle, self._reading)
        if runs:
            return {}
        self._launch, self._choice, self._trigger = None, None, float("nan")
        self._state = CycleState.COLLECT
        self._follower.reset()
        return self._measuring_after()

    def _measuring_after(self) -> Command:
        """The first sample after the profile: nothing is known yet, so the table turns as for what such a push leaves."""
        share = 3.0 * self.problem.scatter.direction_sd
        self._expected = max(share * self._pushed.aim if self._pushed is not None else 0.0, self.problem.tolerance)
        return self._stand_off(self._expected) | self._turn_at(self._speed_for(self._expected))

    def _learn(self) -> None:
        """Take in what the last push did to the part, once."""
        if self._before is None or self._pushed is None:
            return
        x, y, sd = self._before
        view, self._before = self._view, None
        travel = Travel.between((x, y), (view.x, view.y), towards=self._aimed)
        if self._pushed.aim <= _LONG and abs(self._beyond) <= max(
            _TOLD * self._pushed.aim, _HIDDEN
        ):  # else turning hides what friction did
            told = max(travel.distance - self._beyond, 0.0)
            belief = self.strategy.update_belief(self._friction, self._evidence, self._pushed, told)
            self._friction, self._evidence = belief[0], min(belief[1], _MEMORY)
        if travel.along > _TELLING:
            spread = hypot(self.problem.scatter.direction_sd, hypot(sd, view.sd) / travel.along)
            self._direction.see(travel.across / travel.along, spread)


def _stale(planned: Approach, start: Approach, share: float) -> bool:
    """Whether a planned push rests on what has changed since, by more than a share."""
    pairs = ((planned.offset, start.offset), (planned.spindle_speed, start.spindle_speed))
    return any(abs(a - b) > share * abs(b) for a, b in pairs) or abs(planned.room - start.room) > 2.0 * share
