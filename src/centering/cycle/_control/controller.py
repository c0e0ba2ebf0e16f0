"""Controller of the centering cycle: measures in the run-up, pushes as soon as it pays, ends when certain."""

from collections.abc import Mapping
from math import isfinite
from typing import ClassVar

import numpy as np

from centering.cycle._control.base import Command, CycleBase
from centering.cycle._control.following import FollowingGains
from centering.cycle._control.launch import Approach
from centering.cycle._control.learning import PartLearner
from centering.cycle._control.next_push import ChosenPush, NextPush, PushStrategy
from centering.cycle._control.part_view import PartView
from centering.cycle._control.slip_watch import SlipWatch
from centering.cycle._control.states import CycleState
from centering.cycle._measuring.rotations import SEEMS, push_scatter
from centering.cycle._measuring.settings import CycleSettings
from centering.cycle._strategy.table_limit import TableLimit
from centering.cycle._strategy.tip_ways import FREEZE, coasting_time, run_up, waiting_room
from sdpgrind.base import checks

_EARLIEST = 2.7  # chosen: samples before the start of a push at which it is sent
_THROWS = 1  # chosen: throws after which a part begins again
_SLOWER = 0.5  # chosen: acceleration of the table after a throw over that before
_BACK = 0.8  # chosen: share of the probe's reach at which the slide waits for a thrown part
_REST = 0.1  # s, chosen: in which a part comes to rest on a table that stands
_NO_PUSH = np.zeros((0, 3))  # takes a waiting push back
_AHEAD = 3.0  # derived: samples until a push that is sent; the acceleration stays meanwhile
_MISSED = 2.0  # chosen: samples after which the machine has not begun a push: it will not
_BLIND = 1.5  # derived: samples without a reading after which the part may be gone; one may be dust
_STOPPED = 0.5  # mm/s, chosen: commanded speed of a slide that counts as waiting
_WELL = 3.0  # chosen: standard deviations of a push's direction
_NEARER = 0.05  # chosen: mm by which the slide may wait further out than it need


class CenteringController(CycleBase):
    """Centre a part in the least expected time of a strategy; see `hwsim.protocols.Controller`.

    The slide does not follow the rim: it waits close to it, so approaches are short, and only the probe, with
    its longer stroke, follows. All readings count, those of the run-up included, unless the
    `GeometryEstimator` rejects them; centre, radius and lobes of 2 to 7 undulations are estimated together,
    and radius and lobes stay known after a push. A push is sent two samples ahead with the table angle of its
    start, and starts within a sample; until then it is replanned as the estimate improves. The controller
    pushes as soon as the measuring error is below the scatter of the push. It reports "centred" only when the
    offset with its uncertainty is within the tolerance.

    Parameters
    ----------
    strategy : Strategy
        Sequence of pushes (mm, mm/s): `plan(problem)`.
    settings : CycleSettings, optional
        Settings of machine and cycle.
    gains : FollowingGains, optional
        Gains of the slide on the way to its place.

    Raises
    ------
    TypeError
        `strategy` is not a strategy.

    Examples
    --------
    >>> import centering, hwsim  # doctest: +SKIP
    >>> problem = centering.preset("printed")  # doctest: +SKIP
    >>> controller = centering.CenteringController(centering.plan(problem))  # doctest: +SKIP
    >>> hwsim.run(hwsim.CenteringMachine(problem), controller).outcome  # doctest: +SKIP
    """

    commands: ClassVar[Mapping[str, str]] = {**CycleBase.commands, "spindle_acceleration": "rad/s^2"}
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
        self,
        strategy: PushStrategy,
        *,
        settings: CycleSettings | None = None,
        gains: FollowingGains | None = None,
    ) -> None:
        self.strategy = checks.able(
            "strategy", strategy, "a strategy such as centering.plan(problem)", "push", "update_belief"
        )
        chosen = settings or CycleSettings()
        problem = strategy.problem
        self._view = PartView(problem.model.part.radius, chosen, problem.scatter.measuring_sd)
        self._learner = PartLearner(strategy, chosen.following_lag, chosen.force_max)
        self._watch = SlipWatch()
        self._coming = NextPush(strategy, chosen.following_lag)
        super().__init__(strategy.problem, settings, gains)

    def _begin(self) -> None:
        super()._begin()
        self._view.reset()
        self._learner.reset()
        self._coming.forget()
        self._expected = self.problem.offset_max  # offset, mm, while there is no estimate
        self._pushed_aim = 0.0  # of the last push, mm
        self._watch.reset()
        self._again = 0.0  # time from which on a thrown part is measured again, s
        self._throws = 0  # how often the table has thrown the part
        self._rest_angle = 0.0  # of the table, from which on the part is at rest again

    def _next(self, pushing: bool) -> Command:
        if self._state is CycleState.REFOLLOW:
            return self._stopping()
        if self._state is CycleState.PUSH:
            return self._pushing(pushing)
        if self._state is CycleState.WAIT and pushing:
            return self._begin_push()
        if self._state is CycleState.WAIT and self._table.angle > self._coming.trigger + self._way(_MISSED):
            self._coming.forget()
            self._state = CycleState.COLLECT
        return self._measuring()

    def _way(self, samples: float) -> float:
        """Rotation of the table in a number of samples, rad."""
        return samples * self._table.speed * self.period

    def report(self) -> dict[str, float]:
        """Return state, offset (mm), direction (rad), confidence (mm), friction, trigger angles (rad)."""
        view = self._view
        told = {
            "state": float(self._state),
            "friction": self._learner.friction,
            "pushes": float(self._pushes),
        }
        if view.known:
            told |= {"offset": view.offset, "offset_angle": view.offset_angle, "band": view.band}
        launch = self._coming.launch
        if launch is not None and isfinite(self._coming.trigger):
            told |= {"lead_angle": launch.lead, "trigger_angle": self._coming.trigger}
        return told

    def _measuring(self) -> Command:
        """Store the reading, decide, and hold the slide at its waiting place."""
        view = self._view
        if isfinite(self._reading):
            if self._leaves():
                return self._thrown()
            view.take(self._table.angle, self._reading)
            if self._state is CycleState.APPROACH:
                self._state = CycleState.COLLECT
        if self._state is CycleState.WAIT:
            return {}
        missing = not isfinite(self._reading) and view.samples > 0
        if missing and (self._blind or not self._due):  # nobody knows where the part is
            return self._stand_off(self._expected) | self._turn_at(self._table.speed)
        if view.known:
            self._expected = view.offset
            return self._decide()
        return self._stand_off(self._expected) | self._turn_at(self._speed_for(self._expected))

    @property
    def _blind(self) -> bool:
        """Whether more than one reading in a row is missing."""
        return self._table.time - self._seen > _BLIND * self.period

    @property
    def _due(self) -> bool:
        """Whether a push starts so soon that slide and table keep their speed."""
        return self._table.time_to(self._coming.trigger) <= FREEZE * self.period

    def _leaves(self) -> bool:
        """Whether the part leaves the place at which it was known to lie."""
        return self._watch.leaves(*self._view.missed(self._table.angle, self._reading))

    def _thrown(self) -> Command:
        """Stop the table, back the slide; believe in the friction that this showed."""
        limit, table = TableLimit(self.problem, self._learner.least), self._table
        self._throws += 1
        self._learner.thrown(limit.shown(self._view.offset, table.speed, table.acceleration))
        if self._throws > _THROWS:
            return self._end(CycleState.THROWN)
        self._coming.forget()
        self._view.reset()
        self._watch.reset()
        self._state, self._expected = CycleState.REFOLLOW, self.problem.offset_max
        return {"profile": _NO_PUSH} | self._stopping()

    def _stopping(self) -> Command:
        """Keep the slide back, the part within reach of the probe, until table and part rest; begin again."""
        table = self._table
        back = self._stand_still()
        if isfinite(self._reading):
            back = self._stand_at(self._reading + _BACK * self.settings.probe_reach)
        if table.speed > 0.0:
            self._again = table.time + _REST
            return back | self._turn_at(0.0)
        if isfinite(self._reading) and table.time >= self._again:
            self._follower.reset()
            self._state = CycleState.APPROACH
        return back

    def _trouble(self, force: float, pushing: bool) -> CycleState | None:
        """Error that ends the cycle; a part that was thrown and is not found has been thrown."""
        trouble = super()._trouble(force, pushing)
        return CycleState.THROWN if trouble is CycleState.LOST and self._throws else trouble

    def _end(self, state: CycleState) -> Command:
        """End the cycle; under a part that is not where it was, or that was hit, the table stops."""
        command = super()._end(state)
        if state in (CycleState.THROWN, CycleState.LOST, CycleState.COLLISION):
            most = self.problem.limits.spindle_acceleration_max
            self._last = command = command | {"spindle_speed": 0.0, "spindle_acceleration": most}
        return command

    def _decide(self) -> Command:
        """Finish, continue to measure, or prepare the next push."""
        view, tolerance = self._view, self.problem.tolerance
        doubt = self.settings.doubt * view.band
        if view.offset + doubt <= tolerance:
            return self._end(CycleState.CENTERED)
        if view.offset - view.band > self.strategy.offset_max:
            return self._end(CycleState.BEYOND)
        maybe = view.offset - doubt <= tolerance
        self._state = CycleState.CHECK if maybe and view.offset <= SEEMS * tolerance else CycleState.COLLECT
        if maybe and view.turns < self.settings.turns_in_doubt:
            return self._stand_off(view.offset) | self._turn_at(self._speed_for(max(view.offset, tolerance)))
        if self._pushes >= self.problem.pushes_max:
            return self._end(CycleState.PUSHES_MAX)
        return self._end(CycleState.FRICTION) if self._learner.hopeless else self._prepare()

    def _stand_off(self, offset: float) -> Command:
        """Waiting place of the tip: outside the furthest rim and that seen now, within the probe's reach."""
        room = self._room()
        furthest = self._view.radius + offset + room
        if not self._blind and isfinite(self._rim):
            reach = self._rim + 0.9 * self.settings.probe_reach
            furthest = min(max(furthest, self._rim + room), reach)
        if 0.0 <= self._tip - furthest <= _NEARER * self.settings.margin and abs(self._velocity) < _STOPPED:
            return self._stand_still()
        return self._stand_at(furthest + 0.5 * _NEARER * self.settings.margin)

    def _room(self) -> float:
        """Distance from the waiting tip to the furthest rim, mm: run-up plus uncertainty."""
        choice = self._coming.choice
        need = run_up(choice.push_speed, self.problem.limits) if choice is not None else self.settings.margin
        return waiting_room(need, self._view.sd if self._view.known else 0.0, self.settings.margin)

    def _speed_for(self, offset: float) -> float:
        """Table speed of the strategy at an offset, rad/s."""
        return self._choose(offset).spindle_speed

    def _turn_at(self, speed: float) -> Command:
        """Command a table speed (rad/s) and an acceleration at which friction still holds the ring."""
        limit, table, furthest = TableLimit(self.problem, self._learner.least), self._table, self._furthest()
        speed = min(speed, limit.speed(max(furthest, self.problem.tolerance)))
        command = super()._turn_at(speed)
        ahead = min(table.speed + _AHEAD * self.period * table.acceleration, max(speed, table.speed))
        rate = _SLOWER**self._throws * limit.acceleration(furthest, ahead)
        if table.speed == speed or rate == table.acceleration:
            return command
        table.acceleration = rate
        return command | {"spindle_acceleration": rate}

    def _furthest(self) -> float:
        """Greatest plausible offset, mm."""
        view = self._view
        return view.offset + min(view.band, self.problem.offset_max) if view.known else self._expected

    def _choose(self, offset: float) -> ChosenPush:
        """Choice of the strategy at an offset."""
        return self._coming.ask(offset, self._learner.friction, self._learner.evidence)

    def _prepare(self) -> Command:
        """Choose and plan the push; stop the slide in time; send the push when due."""
        view, table, coming = self._view, self._table, self._coming
        ready = self._good_enough()
        if ready:
            self._learner.see(view)
        coming.choice = choice = self._choose(view.offset)
        standing = self._stand_off(view.offset)
        turning = self._turn_at(choice.spindle_speed) if coming.launch is None else {}
        arriving = coming.arriving(self._aim_angle(), table)
        coming.plan(choice, self._start(arriving), self._learner.friction, table)
        coming.set_trigger(self._aim_angle(), table, arriving)
        samples = table.time_to(coming.trigger) / self.period
        if samples > FREEZE or not ready:
            return standing | turning | self._turn_at(choice.spindle_speed)
        arriving = table.speed_at(coming.trigger)
        command = self._stand_still() | self._turn_at(arriving)
        if samples > _EARLIEST:
            return command
        return command | self._send(choice, arriving)

    def _start(self, speed: float) -> Approach:
        """Start of a push at a table speed (rad/s)."""
        view = self._view
        return Approach(view.offset, max(self._tip - view.rim, 0.0), speed)

    def _aim_angle(self) -> float:
        """Table angle with the high point under the tip, corrected for the learned direction, rad."""
        return self._view.offset_angle - self._learner.bias - self.settings.manual_lead

    def _good_enough(self) -> bool:
        """Whether the measuring error is below the scatter of the push."""
        view = self._view
        return view.sd <= float(push_scatter(self.problem.scatter, view.offset))

    def _send(self, choice: ChosenPush, speed: float) -> Command:
        """Send the push with the latest estimate."""
        self._view.look()
        push = self._coming.finish_plan(choice, self._start(speed), self._learner.friction)
        self._coming.set_trigger(self._aim_angle(), self._table, speed)
        if self._table.time_to(self._coming.trigger) > FREEZE * self.period:  # it has just been missed
            return {}
        self._state = CycleState.WAIT
        return {"profile": push.rows, "profile_angle": self._coming.trigger}

    def _begin_push(self) -> Command:
        """Record the place of the part, and forget it."""
        push, choice = self._coming.launch, self._coming.choice
        if push is None or choice is None:
            raise RuntimeError("a push began that was not planned")
        self._state = CycleState.PUSH
        self._pushes += 1
        self._learner.pushed(self._view, choice, push, self._coming.start)
        self._feel()
        self._pushed_aim = choice.aim
        speed = max(self._table.set_point, 1e-6)
        thrown = coasting_time(choice.shape, choice.push_speed, self.problem.model)
        self._rest_angle = self._coming.trigger + speed * (push.stop_time + thrown + self.period)
        self._view.moved()
        self._watch.reset()
        return {}

    def _feel(self) -> None:
        """Record the force of the push; the table turns at the speed at which the push began."""
        if isfinite(self._force):
            gone = (self._table.angle - self._coming.trigger) / max(self._table.speed, 1e-6)
            self._learner.feel(gone, self._force)

    def _pushing(self, runs: bool) -> Command:
        """Wait until the part rests; readings count from then on, even during the retreat."""
        if runs:
            self._feel()
        if self._table.angle < self._rest_angle:
            return {} if runs else self._stand_off(self._left())
        if isfinite(self._reading):
            self._view.take(self._table.angle, self._reading)
        if runs:
            return {}
        self._coming.forget()
        self._state = CycleState.COLLECT
        self._follower.reset()
        return self._measuring_after()

    def _measuring_after(self) -> Command:
        """First sample after the profile: the table turns as for the expected remaining offset."""
        self._expected = self._left()
        return self._stand_off(self._expected) | self._turn_at(self._speed_for(self._expected))

    def _left(self) -> float:
        """Plausible offset after the last push, mm."""
        return max(_WELL * self.problem.scatter.direction_sd * self._pushed_aim, self.problem.tolerance)
