"""One live bead on the force table: passes under way, sensors, scans, the hidden truth of each pass."""

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, nan
from typing import Any, NamedTuple, Self

import numpy as np

from hwsim.plants import _force_table_kernels as kernels
from hwsim.plants._force_table_bead import Bead, Disc
from hwsim.plants._force_table_kernels import DiscCore, Truth
from hwsim.plants._force_table_truth import Motor
from hwsim.protocols import FOREVER
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead import GrindingProcess
from sdpgrind.weldbead.force._kernels import sensor_read

GRINDING, TABLE = 14, 4  # grinding sub-steps of a sample, table sub-steps in each: 56, a multiple of the sensor's 8
IDLE, LEAD_IN, ON_BEAD, LEAD_OUT, RESET = range(5)
_IN_CONTACT = 2.0  # N; a reading above it counts as grinding
_DAMPING = 0.05  # of the grinder on its compliance
_NOISE = 512  # samples of noise drawn at once
_OF_PASS = ("grinding_power", "normal_force", "tangential_force", "removal_rate", "feed_rate", "cut_depth")
_AT_EVENTS = ("profile", "profile_x", "height", *_OF_PASS)
_NO_EVENT = dict.fromkeys(_AT_EVENTS, nan)


class Setup(NamedTuple):
    """The stand, the bead before its first pass, and what disc and process really are."""

    stand: Any  # a ForceTableStand, which stands above this module
    bead: Bead
    disc: Disc
    process: GrindingProcess


@dataclass
class Readings:
    """Sums over the samples of one pass in which the sensors say that there is contact."""

    samples: int = 0
    force: float = 0.0
    friction: float = 0.0
    power: float = 0.0

    def add(self, force: float, friction: float, speed: float, radius: float) -> None:
        """Count a sample in contact."""
        if force > _IN_CONTACT:
            self.samples += 1
            self.force += force
            self.friction += friction
            self.power += speed * friction * radius / 1000


@dataclass
class Done:
    """The truth of one pass."""

    process: GrindingProcess
    volume: float = 0.0
    force: float = 0.0  # N, mean over the samples on the bead
    samples: int = 0
    over: float = 0.0  # s beyond the burn limit


class ForceTable:
    """A bead under the force-controlled grinder (`hwsim.protocols.Machine`)."""

    def __init__(self, setup: Setup, passes: np.random.Generator, noise: np.random.Generator) -> None:
        self.time, self.done, self.event = 0, False, False
        self._setup, self._passes, self._noise = setup, passes, noise
        stand, disc = setup.stand, setup.disc
        self._z = setup.bead.z.copy()
        self._phase, self._left, self._feed = IDLE, 0, 0.0
        step = stand.tick / (GRINDING * TABLE)
        self._drive_core, self._sensor_core = stand.drive.core(step), stand.sensor.core(step)
        self._shape = np.array([GRINDING, TABLE, stand.datum, disc.stiffness])
        self._state = np.zeros(kernels.STATES)
        self._state[kernels.PHASE] = noise.uniform(0, 2 * np.pi)
        self._state[kernels.SPIN] = self._free_speed
        self._drive, self._sensors = stand.drive.start(self._drawn_back()), np.zeros((2, stand.sensor.start().size))
        self._state[kernels.CENTER] = stand.start_x
        self._log: list[Done] = []
        self._stalls, self._lead_samples = 0, 0
        self._reading = Readings()
        self._read = (0.0, 0.0, self._free_speed)
        self._normals, self._next = np.empty((0, 5)), 0
        self._command, self._last_command = self._drawn_back(), self._drawn_back()
        self._scan = self._scanned()
        self._at_event: dict[str, Any] | None = dict(self._scan, **dict.fromkeys(_OF_PASS, nan))

    # What is commanded ------------------------------------------------------------------------------------------------

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, Any]:
        """Take `command`, advance by at most `ticks` samples, measure."""
        if command:
            self._take(command)
        if ticks and not self.done:
            self._advance(ticks)
        return self._measured()

    def _take(self, command: Mapping[str, Any]) -> None:
        if command.get("stop"):
            self.done = True
            return
        if "platform_command" in command:
            self._command = float(command["platform_command"])
            if not -inf < self._command < inf:
                raise checks.refuse("platform_command", "finite", self._command, "mm")
        if command.get("start"):
            self._begin(command)

    def _begin(self, command: Mapping[str, Any]) -> None:
        """Draw the truth of the pass, and put the disc where it begins."""
        stand = self._setup.stand
        if self._phase != IDLE:
            raise ValueError("start must wait for the end of the pass before, its reset and its scan")
        if "feed_rate" not in command:
            raise ValueError("a pass needs feed_rate (mm/s) with its start")
        self._feed = checks.positive("feed_rate", command["feed_rate"], "mm/s")
        start = checks.number("start_x", command.get("start_x", stand.start_x), "mm")
        if start > (latest := self._setup.bead.x[0] + self._reach):
            raise checks.refuse("start_x", f"<= {latest:.6g}, so that the tip is before the bead", start, "mm")
        self._log.append(Done(stand.pass_scatter.drawn(self._setup.process, self._passes)))
        self._prepare(start)

    def _prepare(self, start: float) -> None:
        stand, back = self._setup.stand, self._drawn_back()
        process = self._log[-1].process
        self._truth = Truth(process.specific_energy, process.idle_power, process.friction_ratio)
        self._core = self._disc_core(process)
        self._drive[:] = stand.drive.start(back)
        self._sensors[:] = stand.sensor.start()
        self._queue = [back] * stand.delay_samples
        self._last_command = back
        kept = self._state[[kernels.PHASE, kernels.SPIN, kernels.WEAR]]
        self._state[:] = 0.0
        self._state[[kernels.PHASE, kernels.SPIN, kernels.WEAR]] = kept
        disc = self._setup.disc
        self._state[kernels.CENTER] = start
        self._state[kernels.TIP_X] = start - self._reach
        self._state[kernels.TIP_Z] = stand.datum - back - disc.radius * np.sin(disc.relaxed_angle)
        self._grid = np.array([self._setup.bead.x[0], self._setup.bead.spacing, self._z.max()])
        self._phase, self._reading, self._pass_start = LEAD_IN, Readings(), self.time

    def _disc_core(self, process: GrindingProcess) -> DiscCore:
        stand, disc, motor = self._setup.stand, self._setup.disc, self._setup.stand.motor
        limit = stand.charges.burn_limit
        burn = inf if limit is None else float(limit.interval(process, self._feed)[1])
        inertia = stand.grinder_inertia
        damping = 2 * _DAMPING * float(np.sqrt(inertia * disc.torques[1] / disc.angles[1]))
        motor = Motor(process.free_speed, process.speed_droop, spin_time=0.0) if motor is None else motor
        return DiscCore(
            *(stand.tick / GRINDING, disc.radius, process.bead_width, disc.relaxed_angle, disc.angles, disc.torques),
            *(inertia, damping, motor.free_speed, motor.speed_droop, motor.spin_time),
            *(stand.runout, stand.grinding_ratio),
            reads_spring=stand.spring_first,
            burn_force=burn,
        )

    @property
    def _free_speed(self) -> float:
        motor = self._setup.stand.motor
        return float(self._setup.process.free_speed if motor is None else motor.free_speed)

    @property
    def _reach(self) -> float:
        """From tip to centre of the relaxed disc, mm."""
        return self._setup.disc.radius * float(np.cos(self._setup.disc.relaxed_angle))

    def _drawn_back(self) -> float:
        """Platform position (mm) with the disc clear of the bead."""
        stand, disc = self._setup.stand, self._setup.disc
        return float(stand.datum - self._z.max() - disc.radius * np.sin(disc.relaxed_angle) - stand.clearance)

    # What happens -----------------------------------------------------------------------------------------------------

    def _advance(self, ticks: int) -> None:
        self.event, self._at_event = False, None
        if self._phase == IDLE:
            self.time += ticks if ticks < FOREVER else 0  # idle; for ever would be for ever
            return
        while ticks > 0 and not self.event:
            ticks -= self._wait(ticks) if self._phase == RESET else self._sample()

    def _wait(self, ticks: int) -> int:
        """Let the grinder return; scan when it is back."""
        moved = min(ticks, self._left)
        self.time += moved
        self._left -= moved
        if self._left == 0:
            self._phase, self.event = IDLE, True
            self._finish_pass()
        return moved

    def _sample(self) -> int:
        """One control sample of a pass."""
        state, done = self._state, self._log[-1]
        kernels.sample(
            *(self._z, self._grid, self._core, state, self._truth, self._feed, self._applied(), self._drive),
            *(self._drive_core, self._sensors, self._sensor_core, self._shape),
        )
        self.time += 1
        if self._phase == ON_BEAD:
            done.samples += 1
            done.force += float(state[kernels.FORCE_SUM])
        else:
            self._lead_samples += 1
        done.over += float(state[kernels.OVER_SUM])
        self._sense()
        self._go_on()
        return 1

    def _applied(self) -> float:
        """The command that takes effect now: late by the delay, and guarded against a stall."""
        self._queue.append(self._command)
        command = self._queue.pop(0)
        motor = self._setup.stand.motor
        if motor is not None and self._state[kernels.SPIN] < motor.guard * motor.free_speed:
            command = min(command, self._last_command)
        self._last_command = command
        return command

    def _go_on(self) -> None:
        """From lead-in to bead to lead-out to reset; a stalled or overloaded grinder is drawn back at once."""
        bead, tip, stand = self._setup.bead, self._state[kernels.TIP_X], self._setup.stand
        motor = stand.motor
        stalled = 0.0 if motor is None else motor.stall * motor.free_speed
        if self._state[kernels.SPIN] <= stalled or self._state[kernels.FORCE] > stand.overload:
            self._stalls += 1
            self._end()
        elif tip > bead.x[-1] + stand.lead_out:
            self._end()
        else:
            self._phase = LEAD_IN if tip < bead.x[0] else ON_BEAD if tip <= bead.x[-1] else LEAD_OUT

    def _end(self) -> None:
        self._log[-1].volume = float(self._state[kernels.REMOVED])
        self._left = max(1, round(self._setup.stand.charges.reset_time / self._setup.stand.tick))
        self._phase = RESET
        self._state[kernels.SPIN] = self._free_speed

    def _finish_pass(self) -> None:
        """Scan; what the sensors and the two scans say of the pass."""
        before, self._scan = self._scan, self._scanned()
        cut, pass_ = before["height"] - self._scan["height"], self._reading
        of_pass = dict.fromkeys(_OF_PASS, nan) | {"feed_rate": self._feed, "cut_depth": cut}
        if pass_.samples:
            n, bead, process = pass_.samples, self._setup.bead, self._setup.process
            volume = cut * bead.length * process.bead_width
            of_pass |= {
                "grinding_power": pass_.power / n,
                "normal_force": pass_.force / n,
                "tangential_force": pass_.friction / n,
                "removal_rate": volume / (n * self._setup.stand.tick),
            }
        self._at_event = self._scan | of_pass

    # What is measured -------------------------------------------------------------------------------------------------

    def _normal(self) -> Floats:
        """Five standard normal numbers for the gauges of one sample."""
        if self._next == len(self._normals):
            self._normals, self._next = self._noise.standard_normal((_NOISE, 5)), 0
        self._next += 1
        row: Floats = self._normals[self._next - 1]
        return row

    def _sense(self) -> None:
        """Read forces and spin, once a sample."""
        stand, normal = self._setup.stand, self._normal()
        sd, self._normals_now = stand.sensor.noise_sd, normal
        force = float(sensor_read(self._sensors[0], self._sensor_core, sd * normal[0]))
        friction = float(sensor_read(self._sensors[1], self._sensor_core, sd * normal[1]))
        speed = stand.speed_gauge.read(float(self._state[kernels.SPIN]), float(normal[2]))
        self._read = force, friction, speed
        self._reading.add(force, friction, speed, self._setup.disc.radius)

    def _measured(self) -> dict[str, Any]:
        stand = self._setup.stand
        now = self._at_event if self._at_event is not None else _NO_EVENT
        left = stand.start_time - self.time * stand.tick
        if self._phase in (IDLE, RESET):
            still = {"force": nan, "friction_force": nan, "disk_speed": self._free_speed, "center_x": nan}
            return {**still, "table_position": nan, "pass_time": nan, "time_left": left, "phase": float(self._phase), **now}
        force, friction, speed = self._read if self.time > self._pass_start else (0.0, 0.0, self._free_speed)
        normal = self._normals_now if self.time > self._pass_start else np.zeros(5)
        return {
            "force": force,
            "friction_force": friction,
            "disk_speed": speed,
            "center_x": stand.feed_gauge.read(float(self._state[kernels.CENTER]), float(normal[3])),
            "table_position": stand.table_gauge.read(float(self._drive[4]), float(normal[4])),
            "pass_time": (self.time - self._pass_start) * stand.tick,
            "time_left": left,
            "phase": float(self._phase),
            **now,
        }

    def _scanned(self) -> dict[str, Any]:
        bead = self._setup.bead
        x, z = self._setup.stand.scanner.scan(bead.x, self._z, self._noise)
        above = z - np.interp(x, bead.x, bead.parent)
        return {"profile": z, "profile_x": x, "height": float(np.trapezoid(above, x)) / bead.length}

    def outcome(self) -> dict[str, Any]:
        """What the bead became; see the stand."""
        stand, bead = self._setup.stand, self._setup.bead
        height, (mean, worst) = bead.height(self._z), bead.overground(self._z)
        area, done = bead.length * self._setup.process.bead_width, self._log
        return {
            "penalty": self._penalty(height),
            **{"height": height, "overground": mean, "overground_worst": worst},
            **{"passes": len(done), "time": self.time * stand.tick, "lead_time": self._lead_samples * stand.tick},
            **{"lateness": self._lateness, "stalls": self._stalls},
            **{"burned": sum(each.over > 0 for each in done), "burn_time": sum(each.over for each in done)},
            "contour": self._z.copy(),
            "true_cut_depth": [each.volume / area for each in done],
            "true_specific_energy": [each.process.specific_energy for each in done],
            "true_idle_power": [each.process.idle_power for each in done],
            "true_friction_ratio": [each.process.friction_ratio for each in done],
            "true_force": [each.force / max(1, each.samples) for each in done],
            "true_volume": [each.volume for each in done],
        }

    @property
    def _lateness(self) -> float:
        stand = self._setup.stand
        return float(max(0.0, self.time * stand.tick - stand.start_time))

    def _penalty(self, height: float) -> float:
        """Charges for height, lateness, the finish of the last pass, and passes, $."""
        charges = self._setup.stand.charges
        penalty = float(charges.height_charge(height)) + charges.pass_charge * len(self._log)
        if charges.lateness_charge is not None:
            penalty += float(np.asarray(charges.lateness_charge(np.asarray(self._lateness))))
        if charges.finish_charge is not None and self._log:
            penalty += float(charges.finish_charge(self._feed))
        return float(penalty)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """A machine with a state of its own; what never changes is shared."""
        twin = copy.copy(self)
        shared = ("_setup", "_drive_core", "_sensor_core", "_core", "_truth", "_shape")
        for name, value in vars(self).items():
            if name not in shared:
                setattr(twin, name, copy.deepcopy(value, memo))
        return twin
