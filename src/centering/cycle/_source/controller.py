"""Strategy of the source: energy balance, subtracted free slide, one running correction; for comparison."""

from collections.abc import Mapping
from math import atan2, ceil, copysign, hypot, isfinite, nan, pi
from typing import ClassVar, Protocol

from centering._problem.problem import CenteringProblem
from centering.cycle._control.base import Command, CycleBase
from centering.cycle._control.following import FollowingGains
from centering.cycle._control.part_view import PrintedPlace
from centering.cycle._control.states import CycleState
from centering.cycle._measuring.settings import CycleSettings
from centering.cycle._source.correction import travelled
from centering.cycle._source.planner import PrintedPlanner
from centering.push._plan.push import Push
from sdpgrind import units
from sdpgrind.base import checks
from sdpgrind.base.checks import one_of

_TURN = 2.0 * pi
# Samples before a push: it can still be sent; is sent; the slide is stopped; it is planned from where the
# slide is. Chosen: below 1 a push comes too late for its angle, one sample at least is between the first two,
# and the slide has time to stop.
_LATEST, _EARLIEST, _FREEZE, _NEAR = 1.3, 2.7, 6.0, 14.0
_EVERY = 3  # readings between two looks at the model: 5 degrees at the source's speed are 4
_BLIND = 0.11  # chosen: s after a push until the probe follows again
_SLOWEST_TABLE = 0.1  # chosen: rad/s


class TableSpeeds(Protocol):
    """Table speed for each offset, as a `Strategy` gives it."""

    def spindle_speed(self, offset: float) -> float: ...


class PrintedController(CycleBase):
    """Centre a part as Mears (2006) does, chapters 5 and 6; see `hwsim.protocols.Controller`.

    The slide follows the rim at a constant gap. When the running fit (PRLS) is valid by Mears (4.49)-(4.52),
    a push over the whole offset is planned: at the speed of the energy balance (5.25), limited to that of a
    free slide over the whole offset, and shortened by the free slide; with the lead of (5.17), aligned at the
    end of the push, and the running correction (6.16)-(6.18). After it the measurement starts again. The part
    is centred when the offset, fitted over a whole turn, is within the tolerance.

    For a fair comparison of the strategies two details are better than in the source: a push starts at its
    angle, not at the next sample, and its lead is solved for, not iterated.

    Parameters
    ----------
    problem : CenteringProblem
        Part, limits, tolerance.
    spindle_speed : float
        Table speed, rad/s. Default: the 30 rpm implied by the cycles of chapter 5.
    push_speed : float, optional
        Speed of all pushes, mm/s, as in figures 5.6 to 5.11. None: by energy balance.
    scheduled : Strategy, optional
        Source of the table speeds in place of `spindle_speed`; reduced where the rim would arrive before the
        push.
    timing : {"printed", "exact"}
        Whether the lead includes the slip of Mears (5.13)-(5.16).
    settings : CycleSettings, optional
        Settings of machine and cycle.
    gains : FollowingGains, optional
        Gains of the slide while it follows.

    Raises
    ------
    ValueError
        A value is out of range.

    Examples
    --------
    >>> from centering._problem.presets import preset
    >>> controller = PrintedController(preset("printed"))
    >>> controller.step(time=0.0, angle=0.0, slide=120.0, probe=float("nan"))["velocity"]  # mm/s
    83.33333333333333
    """

    reports: ClassVar[Mapping[str, str]] = {
        "state": "",
        "offset": "mm",
        "offset_angle": "rad",
        "pushes": "",
        "stroke_offset": "mm",
        "lead_angle": "rad",
        "trigger_angle": "rad",
    }

    def __init__(
        self,
        problem: CenteringProblem,
        *,
        spindle_speed: float = units.rpm(30.0),
        push_speed: float | None = None,
        scheduled: TableSpeeds | None = None,
        timing: str = "printed",
        settings: CycleSettings | None = None,
        gains: FollowingGains | None = None,
    ) -> None:
        limits = checks.kind("problem", problem, CenteringProblem).limits
        self.spindle_speed = checks.at_most(
            "spindle_speed", spindle_speed, "spindle_speed_max", limits.spindle_speed_max, "rad/s"
        )
        if push_speed is not None:
            push_speed = checks.at_most(
                "push_speed", push_speed, "push_speed_max", limits.push_speed_max, "mm/s"
            )
        self.push_speed = push_speed
        self.scheduled = (
            scheduled
            if scheduled is None
            else checks.able("scheduled", scheduled, "a strategy", "spindle_speed")
        )
        self.timing = one_of("timing", timing, ("printed", "exact"))
        self._planner = PrintedPlanner(problem, self.push_speed, self.timing)
        self._fit = PrintedPlace("prls")
        super().__init__(problem, settings, gains)

    def _begin(self) -> None:
        super()._begin()
        self._planner.reset()
        self._wanted = 0.0  # of the last push, mm
        self._before: tuple[float, float] | None = None  # offset (mm) and direction before it
        self._nearest = nan  # least gap in the last push, mm
        self._trigger = nan
        self._again = 0.0  # time from which on is measured
        self._held = False  # whether the slide was stopped for the push
        self._anew()

    def _anew(self) -> None:
        """Start a new measurement."""
        self._fit.reset()
        self._samples, self._first = 0, nan
        self._offset = self._angle = self._radius = nan

    def _next(self, pushing: bool) -> Command:
        if self._state in (CycleState.PUSH, CycleState.WAIT) and (pushing or self._state is CycleState.PUSH):
            return self._pushing(pushing)
        if self._state is CycleState.WAIT:
            return {}
        return self._measuring()

    def report(self) -> dict[str, float]:
        """Return state, offset (mm), direction (rad), pushes, correction (mm), lead and trigger (rad)."""
        told = {
            "state": float(self._state),
            "pushes": float(self._pushes),
            "stroke_offset": self._planner.correction.value,
        }
        if isfinite(self._offset):
            told |= {"offset": self._offset, "offset_angle": self._angle}
        if self._planner.push is not None and isfinite(self._trigger):
            told |= {"lead_angle": self._planner.push.lead_angle, "trigger_angle": self._trigger}
        return told

    def _measuring(self) -> Command:
        """Follow, collect, and prepare the next push."""
        held, self._held = self._held, False
        following = self._follow() | ({} if held else self._turn_at(self._speed()))
        if not isfinite(self._reading) or self._table.time < self._again:
            return following
        self._state = CycleState.COLLECT
        self._collect()
        if not self._fit.valid or (self._samples % _EVERY and not self._soon()):
            return following
        self._look()
        return following | self._decide()

    def _follow(self) -> Command:
        """Keep the gap; approach while the probe touches nothing."""
        gap = self.problem.limits.follow_gap
        if isfinite(self._reading):
            return self._stand_at(self._reading + gap)
        return {"velocity": self.problem.limits.approach_speed}

    def _speed(self) -> float:
        """Table speed at the estimated offset, rad/s."""
        slower = self._planner.slower
        if self.scheduled is None:
            return self.spindle_speed * slower
        return (
            self.scheduled.spindle_speed(self._offset if isfinite(self._offset) else self.problem.offset_max)
            * slower
        )

    def _collect(self) -> None:
        if self._samples == 0:
            self._first = self._table.angle
        self._fit.update(angle=self._table.angle, reading=self._reading)
        self._samples += 1

    def _look(self) -> None:
        """Update the fit; the first valid one after a push evaluates that push."""
        self._radius, x, y = self._fit.place
        self._offset, self._angle = hypot(x, y), atan2(y, x)
        if self._before is not None:
            way = travelled(*self._before, self._offset, self._angle)
            self._planner.correction.update(
                wanted=self._wanted, travelled=way, gap_left=max(self._nearest, 0.0)
            )
            self._before = None

    def _decide(self) -> Command:
        """Finish, measure a whole turn, abandon, or plan a push."""
        if self._offset <= self.problem.tolerance:
            whole = self._table.angle - self._first >= _TURN
            return self._end(CycleState.CENTERED) if whole else {}
        if self._pushes >= self.problem.pushes_max:
            return self._end(CycleState.PUSHES_MAX)
        if not self._soon():
            self._plan()
        return self._near() if self._soon() else {}

    def _soon(self) -> bool:
        """Whether a push is due so soon that the true place of the slide matters."""
        return self._planner.push is not None and self._samples_left() <= _NEAR

    def _samples_left(self) -> float:
        """Samples until the push begins."""
        return self._table.time_to(self._trigger) / self.period

    def _plan(self) -> None:
        """Plan the push for a following slide, where it is stale, and find its trigger angle."""
        turning = self._turning()
        if self._planner.stale(self._offset, turning):
            self._planner.plan(self._offset, self.problem.limits.follow_gap, turning)
        self._find_trigger()

    def _find_trigger(self) -> None:
        """The next angle of the table at which the push can begin."""
        push = self._planner.push
        if push is None:
            self._trigger = nan
            return
        wanted = self._angle - push.lead_angle - self.settings.manual_lead
        soonest = self._table.angle + self._table.speed * _LATEST * self.period
        self._trigger = wanted + _TURN * ceil((soonest - wanted) / _TURN)

    def _turning(self) -> float:
        """Speed of the table at the trigger, rad/s."""
        return max(
            self._table.speed_at(self._trigger) if isfinite(self._trigger) else self._speed(), _SLOWEST_TABLE
        )

    def _standing(self) -> float:
        """Place of the tip if the slide is stopped now, mm from the axis."""
        speed = self._moving
        way = abs(speed) * (self.period + 0.5 * abs(speed) / self.problem.limits.acceleration_max)
        return self._tip - copysign(way, speed)

    def _near(self) -> Command:
        """Plan the push from the place of the slide if stopped now; stop it when due, and send the push.

        A following slide lags behind the rim: its actual gap differs from the commanded one.
        """
        room = self._standing() - (self._radius + self._offset)
        if room >= self.problem.limits.safety:
            self._planner.plan_from(self._offset, room, self._turning())
        elif self._samples_left() <= _FREEZE:
            self._planner.slow_down()
        self._find_trigger()
        if self._planner.push is None or self._samples_left() > _FREEZE:
            return {}
        self._held = True
        command = self._stand_still()
        return command if self._samples_left() > _EARLIEST else command | self._send(self._planner.push)

    def _send(self, push: Push) -> Command:
        """The push, to begin at the trigger."""
        self._state, self._nearest = CycleState.WAIT, nan
        return {"profile": push.profile.segments, "profile_angle": self._trigger}

    def _pushing(self, runs: bool) -> Command:
        """Record the least gap of the tip; follow again after the profile."""
        if self._state is CycleState.WAIT:
            self._state = CycleState.PUSH
            self._pushes += 1
            self._planner.slower = 1.0
            self._before, self._wanted = (self._offset, self._angle), self._offset
        if isfinite(self._reading):
            gap = self._tip - self._reading
            self._nearest = gap if not isfinite(self._nearest) else min(self._nearest, gap)
        if runs:
            return {}
        self._state, self._planner.push, self._trigger = CycleState.REFOLLOW, None, nan
        self._again = self._table.time + _BLIND
        self._follower.reset()
        self._anew()
        return self._follow()
