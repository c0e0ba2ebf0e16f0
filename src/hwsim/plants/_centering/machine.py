"""One part on a centering machine: the compiled core with its random numbers, commands and samples."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from centering import CenteringProblem, PushScatter
from centering.kernels import Ring, checked_profile, gauges, slide
from centering.kernels import machine as kernels
from centering.kernels import ring as laws
from centering.push import PushModel
from hwsim._part.clock import Clock
from hwsim._processor.scheduler import Scheduler
from hwsim.plants._centering.tasks import Tasks
from hwsim.protocols import FOREVER
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_NOTHING = np.zeros((0, 3))
_ROUNDING = 1e-9  # relative; chosen: above rounding of limits
_AWAY = 2.0  # longest time for the ring to stop, s; chosen: friction stops it long before
_SHORT = 0.02  # time between two looks at the stopping ring, s; chosen: shorter ones cost time
LEAST_FRICTION = 0.1  # smallest friction drawn over its mean; chosen: keeps it positive


class CenteringRig(NamedTuple):
    """Constants of a part on the machine."""

    problem: CenteringProblem
    scatter: PushScatter
    model: PushModel
    friction: float  # friction of this part over that of the model
    radius: float
    shape: Floats
    lobes: Floats
    gauge: Floats
    settings: Floats
    clock: Clock
    time_max: float
    scheduler: Scheduler | None
    control_ticks: int  # ticks between releases of the controller's task


class CenteringPart:
    """A live part; see `hwsim.protocols.Machine`."""

    def __init__(
        self, rig: CenteringRig, ring: Ring, gap: float, rngs: Sequence[np.random.Generator]
    ) -> None:
        self.time, self.done, self.event = 0, False, False
        self._rig = rig
        self._of_pushes, self._of_gauges, of_tasks = rngs
        self._cell, self._state = rig.settings.copy(), np.zeros(slide.STATES)
        self._most = math.ceil(rig.time_max / float(rig.clock.tick) * (1 - 1e-12))
        laws.hold(self._cell, rig.friction)
        self._profile, self._waiting = _NOTHING, _NOTHING
        self._said = self._timed_out = self._lost = False
        self._centers: list[tuple[float, float]] = []
        self._ended: float | None = None
        self._pending: Mapping[str, Any] = {}
        state = self._state
        state[slide.SEGMENT], state[slide.X], state[slide.Y] = -1.0, ring.center_x, ring.center_y
        state[slide.REFERENCE] = float(kernels.reading(state, rig.shape, rig.lobes)[0]) + gap
        self._tasks = None if rig.scheduler is None else Tasks(rig.scheduler, of_tasks)
        if self._tasks:
            self._tasks.sample(0, self, rig.time_max)
        self._seen = self._read()

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, float]:
        """Take a command, advance by `ticks`, measure."""
        if command and not self.done:
            self._pending = dict(command)
            if self._tasks is None:
                self.take_effect()
        if ticks and not self.done:
            self._advance(min(self.time + ticks, self._most) if ticks < FOREVER else self._most)
        return dict(self._seen)

    def _advance(self, until: int) -> None:
        """Advance to a tick, or to the sample that belongs to it."""
        if self._tasks is None:
            self.move_to(self._rig.clock.seconds(until))
            self.time = until
        elif not self._next_sample(self._tasks, until):
            return
        if until >= self._most:
            self._timed_out = self.done = True
        self._check_lost()
        self._seen = self._read()

    def _next_sample(self, tasks: Tasks, until: int) -> bool:
        """Advance to the start of the controller's job released at a tick, or of the next if missed."""
        period = self._rig.control_ticks
        if until % period and until < self._most:
            rule = f"a whole number of those of the task control, {self._rig.clock.seconds(period):g}"
            raise checks.refuse(
                "period of the controller", rule, self._rig.clock.seconds(until - self.time), "s"
            )
        job = tasks.sample(-(-until // period), self, self._rig.clock.seconds(self._most))
        self.time = (
            self._most
            if job is None and not self.done
            else self.time
            if job is None
            else min(job * period, self._most)
        )
        return not self.done

    def move_to(self, seconds: float) -> None:
        """Advance the physics to a time, s; a waiting profile begins on the way."""
        while kernels.advance(self._state, self._cell, self._profile, self._rig.lobes, seconds):
            self._begin_push()

    def spindle(self) -> tuple[float, float, float, float]:
        """Angle (rad), speed (rad/s), acceleration (rad/s^2) and its remaining time (s)."""
        angle, speed, wanted = (float(self._state[k]) for k in (slide.ANGLE, slide.SPEED, slide.SPEED_SET))
        rate = (
            math.copysign(float(self._cell[slide.SPINDLE_ACCELERATION]), wanted - speed)
            if wanted != speed
            else 0.0
        )
        return angle, speed, rate, abs((wanted - speed) / rate) if rate else math.inf

    def take_effect(self) -> bool:
        """Apply the command of the last sample; return whether it changes the motion of the spindle."""
        command, self._pending = self._pending, {}
        before = self.spindle()[2:]
        if command:
            self._take(command)
        return self.spindle()[2:] != before

    @property
    def _beyond(self) -> bool:
        """Whether the axis is outside the ring, where it cannot be measured."""
        reach = self._rig.radius - self._rig.shape[2]
        return bool(math.hypot(self._state[slide.X], self._state[slide.Y]) >= reach)

    def _check_lost(self) -> None:
        if self._beyond:
            self._lost = self.done = True

    def _take(self, command: Mapping[str, Any]) -> None:
        if "spindle_acceleration" in command:
            self._set_acceleration(command["spindle_acceleration"])
        if "spindle_speed" in command:
            self._set_spindle(command["spindle_speed"])
        if "velocity" in command:
            most = self._cell[slide.SPEED_MAX]
            self._state[slide.VELOCITY_SET] = min(
                max(checks.number("velocity", command["velocity"], "mm/s"), -most), most
            )
        if "profile" in command:
            self._load(command["profile"], command.get("profile_angle"))
        if command.get("retract") or command.get("finished"):
            self._said = bool(command.get("finished"))
            self._end()

    def _set_spindle(self, speed: object) -> None:
        most = self._rig.problem.limits.spindle_speed_max
        wanted = checks.nonnegative("spindle_speed", speed, "rad/s")
        if wanted > most * (1 + _ROUNDING):
            raise checks.refuse(
                "spindle_speed",
                f"<= spindle_speed_max = {most:.6g}; units.rpm(20) for rev/min",
                wanted,
                "rad/s",
            )
        self._state[slide.SPEED_SET] = wanted

    def _set_acceleration(self, rate: object) -> None:
        """Set the acceleration of changes of the speed, and the friction left for the place meanwhile."""
        most = self._rig.problem.limits.spindle_acceleration_max
        wanted = checks.positive("spindle_acceleration", rate, "rad/s^2")
        if wanted > most * (1 + _ROUNDING):
            raise checks.refuse(
                "spindle_acceleration", f"<= spindle_acceleration_max = {most:.6g}", wanted, "rad/s^2"
            )
        self._cell[slide.SPINDLE_ACCELERATION] = wanted
        laws.hold(self._cell, float(self._cell[slide.FRICTION]))

    def _load(self, profile: Any, angle: object) -> None:
        """Store a profile until its angle, or begin it; drop it while another one runs."""
        rows = checked_profile(profile, self._cell)
        if self._state[slide.SEGMENT] >= 0:
            return
        self._waiting = rows
        self._state[slide.ARMED] = float(len(rows) > 0)
        if not len(rows):
            return
        self._state[slide.START] = self._state[slide.ANGLE]
        if angle is not None:
            self._state[slide.START] = checks.number("profile_angle", angle, "rad")
        if self._state[slide.START] <= self._state[slide.ANGLE]:
            self._begin_push()

    def _begin_push(self) -> None:
        """Begin the waiting profile and draw the scatter of this push."""
        state, cell, rig = self._state, self._cell, self._rig
        self._profile, self._waiting = self._waiting, _NOTHING
        slide.begin_segment(state, self._profile, 0)
        state[slide.ARMED] = state[slide.TOUCHED] = 0.0
        state[slide.PUSHES] += 1.0
        self._centers.append((float(state[slide.X]), float(state[slide.Y])))
        friction, aim, stop = self._of_pushes.standard_normal(3).tolist()
        of_push = 1.0 + rig.scatter.friction_push_sd * friction
        laws.hold(cell, max(rig.friction * of_push, LEAST_FRICTION))
        cell[slide.AIM], cell[slide.STOP] = rig.scatter.direction_sd * aim, rig.scatter.stop_sd * stop

    def _end(self) -> None:
        """Withdraw the slide at full speed until the ring lies still or is lost; end the part."""
        state = self._state
        self._ended = until = float(state[slide.TIME])
        state[slide.SEGMENT], state[slide.ARMED] = -1.0, 0.0
        state[slide.VELOCITY_SET] = -self._cell[slide.SPEED_MAX]
        while until < self._ended + _AWAY and (
            until == self._ended or not (kernels.settled(state) or self._beyond)
        ):
            until += _SHORT
            self.move_to(until)
        self._check_lost()
        self.done = True

    def _read(self) -> dict[str, float]:
        rig, shown = self._rig, np.empty(len(gauges.NAMES))
        normal, (first, second) = self._of_gauges.standard_normal(), self._of_gauges.random(2).tolist()
        gauges.measure(
            self._state,
            self._cell,
            self._profile,
            rig.shape,
            rig.lobes,
            rig.gauge,
            normal,
            first,
            second,
            shown,
        )
        shown[gauges.REFRESHED] = 1.0 if self._tasks is None else float(self._tasks.refreshed)
        return dict(zip(gauges.NAMES, shown.tolist(), strict=True))

    def outcome(self) -> dict[str, Any]:
        """Result of the part; see the plant."""
        state, rig = self._state, self._rig
        x, y = float(state[slide.X]), float(state[slide.Y])
        offset = math.hypot(x, y)
        places = np.array([*self._centers, (x, y)])
        overruns, response = (0.0, 0.0) if self._tasks is None else self._tasks.report()
        return {
            "time": self._ended if self._ended is not None else float(state[slide.TIME]),
            "pushes": float(state[slide.PUSHES]),
            "offset": offset,
            "said_finished": float(self._said),
            "finished": float(self._said and offset <= rig.problem.tolerance),
            "timed_out": float(self._timed_out),
            "slipped": float(state[slide.SLIPPED]),
            "lost": float(self._lost),
            "collisions": float(state[slide.COLLISIONS]),
            "peak_force": float(state[slide.PEAK_EVER]),
            "true_mu_static": float(rig.model.mu_static * rig.friction),
            "true_mu_kinetic": float(rig.model.mu_kinetic * rig.friction),
            "overruns": overruns,
            "worst_response": response,
            "center_x": places[:, 0],
            "center_y": places[:, 1],
        }
