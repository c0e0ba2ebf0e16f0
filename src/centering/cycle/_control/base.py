"""Common base of both controllers: readings, errors, approach, stand-off of the slide."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from math import isfinite
from typing import Any, ClassVar

from centering._problem.problem import CenteringProblem
from centering.cycle._control.following import Follower, FollowingGains, FollowingLimits
from centering.cycle._control.states import CycleState
from centering.cycle._control.table_motion import TableMotion
from centering.cycle._measuring.settings import CycleSettings
from sdpgrind.base import checks

Command = dict[str, Any]


class CycleBase(ABC):
    """Readings, errors, approach and stand-off of a cycle; subclasses decide on the part."""

    tier: ClassVar[str] = "control"
    reads: ClassVar[Mapping[str, str]] = {
        "time": "s",
        "angle": "rad",
        "slide": "mm",
        "probe": "mm",
        "force": "N",
        "spindle_speed": "rad/s",
        "pushing": "",
    }
    commands: ClassVar[Mapping[str, str]] = {
        "velocity": "mm/s",
        "profile": "s, mm/s, mm/s^2",
        "profile_angle": "rad",
        "retract": "",
        "spindle_speed": "rad/s",
        "finished": "",
    }

    def __init__(
        self, problem: CenteringProblem, settings: CycleSettings | None, gains: FollowingGains | None
    ) -> None:
        self.problem = checks.kind("problem", problem, CenteringProblem)
        self.settings = checks.kind("settings", settings or CycleSettings(), CycleSettings)
        limits = problem.limits
        bounds = FollowingLimits(limits.slide_speed_max, limits.acceleration_max, limits.sample_time)
        self._follower = Follower(gains, bounds)
        self._table = TableMotion(limits.spindle_acceleration_max)
        self._begin()

    def __repr__(self) -> str:
        part = self.problem.model.part
        return (
            f"{type(self).__name__}({part.mass:g} kg, radius {part.radius:g} mm, {self._state.name.lower()})"
        )

    @property
    def period(self) -> float:
        """Time between two steps, s."""
        return self.problem.limits.sample_time

    @property
    def job(self) -> Mapping[str, object]:
        """Part (kg, mm), tolerance (mm) and machine (mm/s, rad/s) of the problem."""
        return self.problem.job

    def _begin(self) -> None:
        """Forget the part before."""
        self._state = CycleState.APPROACH
        self._pushes = 0
        self._reading = float("nan")
        self._force = 0.0
        self._rim, self._seen = self._reading, 0.0  # last reading, mm, and its time, s
        self._tip = float("nan")  # pusher tip from the axis
        self._velocity = 0.0  # of the slide, as commanded
        self._moving = 0.0
        self._last: Command = {}
        self._table.reset()
        self._follower.reset()

    def reset(self) -> None:
        """Forget the part before."""
        self._begin()

    def verdict(self) -> dict[str, float]:
        """Return the result of the cycle: the number of its `CycleState`, unit 1."""
        return {"state": float(self._state)}

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
        """Return the commands to slide and table until the next sample.

        Parameters
        ----------
        time, angle : float
            Time, s; angle of the table, rad, turns counted.
        slide, probe : float
            Position of slide and probe, mm, positive away from the axis; their sum is the rim on the push
            line. NaN: the probe touches nothing.
        force : float
            Force of the tip, N.
        spindle_speed : float
            Speed of the table, rad/s.
        pushing : float
            1 while a profile runs.
        **others
            Other measurements; not used.
        """
        if self._state.over:
            return self._last
        self._force = force
        self._sense(time, angle, slide, probe, spindle_speed)
        trouble = self._trouble(force, pushing > 0.5)
        return self._next(pushing > 0.5) if trouble is None else self._end(trouble)

    @abstractmethod
    def _next(self, pushing: bool) -> Command:
        """Decide on a part without error; `pushing`: a profile runs."""

    def _sense(self, time: float, angle: float, slide: float, probe: float, spindle_speed: float) -> None:
        """Store the readings."""
        self._table.see(time, angle, spindle_speed)
        self._moving = self._velocity  # speed commanded at the sample before
        self._tip = slide + self.settings.probe_closed
        self._reading = slide + probe
        if isfinite(self._reading):
            self._rim, self._seen = self._reading, time

    def _trouble(self, force: float, pushing: bool) -> CycleState | None:
        """Error that ends the cycle now, or None."""
        settings, time = self.settings, self._table.time
        if isfinite(force) and abs(force) > settings.force_idle and not (pushing or self._expects_force()):
            return CycleState.COLLISION
        if time > settings.timeout:
            return CycleState.TIMEOUT
        if self._state is CycleState.APPROACH:
            near = self.problem.model.part.radius - self.problem.offset_max
            return CycleState.LOST if self._tip < near and not isfinite(self._reading) else None
        return CycleState.LOST if time - self._seen > settings.lost_after else None

    def _expects_force(self) -> bool:
        """Whether the tip may touch the part, as just before and after a profile."""
        return self._state in (CycleState.PUSH, CycleState.REFOLLOW, CycleState.WAIT)

    def _end(self, state: CycleState) -> Command:
        """End the cycle: retract."""
        self._state = state
        self._last = {"velocity": 0.0, "retract": 1.0} | ({} if state.failed else {"finished": 1.0})
        return self._last

    def _stand_at(self, place: float, feed_forward: float = 0.0) -> Command:
        """Move the tip to a place (mm from the axis) that moves outward at a speed (mm/s)."""
        self._velocity = self._follower.step(self._tip - place, -feed_forward)
        return {"velocity": self._velocity}

    def _stand_still(self) -> Command:
        """Stop the slide where it is."""
        self._follower.reset()
        self._velocity = 0.0
        return {"velocity": 0.0}

    def _turn_at(self, speed: float) -> Command:
        """Command the table speed, rad/s."""
        if speed == self._table.set_point:
            return {}
        self._table.set_point = speed
        return {"spindle_speed": speed}
