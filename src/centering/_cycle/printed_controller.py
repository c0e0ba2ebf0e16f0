"""The source's own strategy: energy balance, free sliding taken off, one correction carried along; for comparison."""

from collections.abc import Mapping
from math import atan2, ceil, cos, hypot, isfinite, nan, pi
from typing import Any, ClassVar, Protocol

from centering._cycle.correction import travelled
from centering._cycle.cycle_base import Command, CycleBase
from centering._cycle.cycle_view import PrintedPlace
from centering._cycle.following import FollowingGains
from centering._cycle.printed_planner import PrintedPlanner
from centering._cycle.settings import CycleSettings
from centering._cycle.states import CycleState
from centering._push.problem import CenteringProblem
from sdpgrind import units
from sdpgrind.base import checks
from sdpgrind.base.checks import one_of

_TURN = 2.0 * pi
_LATEST, _EARLIEST, _FREEZE = 1.3, 2.7, 4.0  # samples before: a profile can still be sent; is sent; the slide is stopped
_EVERY = 3  # readings between two looks at the model: 5 degrees at the source's speed are 4
_BLIND = 0.11  # s after a push until the probe follows again
_SLOWEST_TABLE = 0.1  # rad/s


class TableSpeeds(Protocol):
    """What has a table speed for each offset; a `Strategy` does."""

    def speed(self, offset: float) -> float: ...


class PrintedController(CycleBase):
    """Centre a part as Mears (2006) does, chapters 5 and 6; see `hwsim.protocols.Controller`.

    The slide follows the rim at a constant gap. When the running fit (PRLS) is valid by the rule of Mears (4.49)-(4.52), a push
    over the whole offset is planned: at the speed of the energy balance (5.25), not above that from which a part slides the
    offset by itself, and shorter by how far it will slide; with the lead of (5.17), which aligns at the end of the push, and the
    running correction (6.16)-(6.18). Then all begins anew. The part is centred when the offset, fitted to a whole turn, is within
    the tolerance.

    Two things are better than in the source, so that what is compared is the strategy: a push begins at its angle, not at the
    next sample, and its lead is solved for, not iterated.

    Parameters
    ----------
    problem : CenteringProblem
        Part, limits, tolerance.
    spindle_speed : float
        Table speed, rad/s; by default the 30 rpm that the cycles of chapter 5 must have had.
    push_speed : float, optional
        The same speed for all pushes, mm/s, as in figures 5.6 to 5.11; None: by energy balance.
    scheduled : Strategy, optional
        Whose table speeds are taken instead of `spindle_speed`; slower ones where the rim would arrive before the push.
    timing : {"printed", "exact"}
        Whether the lead has the slip of Mears (5.13)-(5.16).
    settings : CycleSettings, optional
        Of machine and cycle.
    gains : FollowingGains, optional
        Of the slide while it follows.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from centering._push.presets import preset
    >>> controller = PrintedController(preset("printed"))
    >>> controller.step(time=0.0, angle=0.0, slide=120.0, probe=float("nan"))["velocity"]  # mm/s, toward the part
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
        checks.kind("problem", problem, CenteringProblem)
        self.spindle_speed = checks.positive("spindle_speed", spindle_speed, "rad/s")
        self.push_speed = None if push_speed is None else checks.positive("push_speed", push_speed, "mm/s")
        self.scheduled = scheduled if scheduled is None else checks.able("scheduled", scheduled, "a strategy", "speed")
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
        self._anew()

    def _anew(self) -> None:
        """Measure from here."""
        self._fit.reset()
        self._samples, self._first = 0, nan
        self._offset = self._angle = self._radius = nan

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
        if self._state in (CycleState.PUSH, CycleState.WAIT) and (pushing > 0.5 or self._state is CycleState.PUSH):
            return self._pushing(pushing > 0.5)
        if self._state is CycleState.WAIT:
            return {}
        return self._measuring()

    def report(self) -> dict[str, float]:
        """Return state, offset (mm) and direction (rad) as fitted, pushes, running correction (mm), lead and trigger (rad)."""
        told = {"state": float(self._state), "pushes": float(self._pushes), "stroke_offset": self._planner.correction.value}
        if isfinite(self._offset):
            told |= {"offset": self._offset, "offset_angle": self._angle}
        if self._planner.push is not None and isfinite(self._trigger):
            told |= {"lead_angle": self._planner.push.lead_angle, "trigger_angle": self._trigger}
        return told

    # ---- measuring ------------------------------------------------------------------------------------------------

    def _measuring(self) -> Command:
        """Follow, collect, and work toward the next push."""
        following = self._follow() | self._turn_at(self._speed())
        if not isfinite(self._reading) or self._table.time < self._again:
            return following
        self._state = CycleState.COLLECT
        self._collect()
        if self._samples % _EVERY or not self._fit.valid:
            return following if self._planner.push is None else following | self._near()
        self._look()
        return following | self._decide()

    def _follow(self) -> Command:
        """Keep the gap; go in while the probe touches nothing."""
        gap = self.problem.limits.follow_gap
        if isfinite(self._reading):
            return self._stand_at(self._reading + gap)
        return {"velocity": self.problem.limits.approach_speed}

    def _speed(self) -> float:
        """Table speed at the offset that is known, rad/s."""
        if self.scheduled is None:
            return self.spindle_speed * self._planner.slower
        return self.scheduled.speed(self._offset if isfinite(self._offset) else self.problem.offset_max) * self._planner.slower

    def _collect(self) -> None:
        if self._samples == 0:
            self._first = self._table.angle
        self._fit.update(angle=self._table.angle, reading=self._reading)
        self._samples += 1

    def _look(self) -> None:
        """Take the model as it is now; the first valid one after a push tells what that did."""
        self._radius, x, y = self._fit.place
        self._offset, self._angle = hypot(x, y), atan2(y, x)
        if self._before is not None:
            way = travelled(*self._before, self._offset, self._angle)
            self._planner.correction.update(wanted=self._wanted, travelled=way, gap_left=max(self._nearest, 0.0))
            self._before = None

    def _decide(self) -> Command:
        """Finish, measure a whole turn, give up, or plan a push."""
        if self._offset <= self.problem.tolerance:
            whole = self._table.angle - self._first >= _TURN
            return self._end(CycleState.CENTERED) if whole else {}
        if self._pushes >= self.problem.pushes_max:
            return self._end(CycleState.TIMEOUT)
        self._plan(due=False)
        return self._near()

    # ---- a push ---------------------------------------------------------------------------------------------------

    def _plan(self, due: bool) -> None:
        """Plan the push, again if that is `due` or it is stale, and find the next angle at which it can begin."""
        planner, turning = self._planner, self._turning()
        if due or planner.stale(self._offset, turning):
            planner.plan(self._offset, self._gap(), turning)
        if planner.push is None:
            self._trigger = nan
            return
        wanted = self._angle - planner.push.lead_angle - self.settings.manual_lead
        soonest = self._table.angle + self._table.speed * _LATEST * self.period
        self._trigger = wanted + _TURN * ceil((soonest - wanted) / _TURN)

    def _turning(self) -> float:
        """Speed of the table at the trigger, rad/s."""
        return max(self._table.speed_at(self._trigger) if isfinite(self._trigger) else self._speed(), _SLOWEST_TABLE)

    def _gap(self) -> float:
        """Gap at the trigger, mm: the set one while the slide follows; what the rim leaves of it once the slide stands."""
        push = self._planner.push
        if push is None or abs(self._velocity) > 0.0:
            return self.problem.limits.follow_gap
        return self._tip - (self._radius + self._offset * cos(push.lead_angle))

    def _near(self) -> Command:
        """Stop the slide a few samples before the trigger, and send the push."""
        if self._planner.push is None or not isfinite(self._trigger):
            return {}
        samples = self._table.time_to(self._trigger) / self.period
        if samples > _FREEZE:
            return {}
        command = self._stand_still()
        if samples > _EARLIEST:
            return command
        self._look()
        self._plan(due=True)
        push = self._planner.push
        if push is None or self._table.time_to(self._trigger) > _FREEZE * self.period:
            return command
        self._state, self._nearest = CycleState.WAIT, nan
        return command | {"profile": push.profile.segments, "profile_angle": self._trigger}

    def _pushing(self, runs: bool) -> Command:
        """Note how near the tip came; when the profile is over, follow again."""
        if self._state is CycleState.WAIT:
            self._state = CycleState.PUSH
            self._pushes += 1
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
