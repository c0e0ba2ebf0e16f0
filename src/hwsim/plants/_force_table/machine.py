"""One live bead on the force table: passes under way, sensors, scans, the hidden truth of each pass."""

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, nan, sqrt
from typing import Any, NamedTuple, Self

import numpy as np

from hwsim.protocols import FOREVER
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.weldbead.force.kernels import sensor_read
from sdpgrind.weldbead.kernels import Grinder, GroundBead, Motor, TableLayout, drawn_disc, drop, reach
from sdpgrind.weldbead.kernels import force_table as kernels
from sdpgrind.weldbead.passes import TiltedDisc
from sdpgrind.weldbead.passes import kernels as cutting

SUB_STEPS = 56  # of table and sensors in a sample: a multiple of the 8 inside the sensor
_GRINDING, _BOUNCING = (
    14,
    56,
)  # grinding sub-steps of a sample; of a grinder with inertia, which rings at some 50 Hz
IDLE, LEAD_IN, ON_BEAD, LEAD_OUT, RESET = range(5)
_IN_CONTACT = 2.0  # N; a reading above it counts as grinding
_DAMPING = 0.05  # of the grinder on its compliance
_NOISE = 512  # samples of noise drawn at once
_OF_PASS = ("grinding_power", "normal_force", "tangential_force", "removal_rate", "feed_rate", "cut_depth")
_AT_EVENTS = ("profile", "profile_x", "height", *_OF_PASS)
_NO_EVENT = dict.fromkeys(_AT_EVENTS, nan)


class ForceTableSetup(NamedTuple):
    """The stand, the bead before its first pass, and what the disc and its process really are."""

    stand: Any  # a ForceTableStand, which stands above this module
    bead: GroundBead
    disc: TiltedDisc


@dataclass
class StandReadings:
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
            self.power += speed * friction * radius / N_MM_S_PER_W


@dataclass
class Done:
    """The truth of one pass."""

    disc: TiltedDisc
    volume: float = 0.0
    force: float = 0.0  # N, mean over the samples on the bead
    samples: int = 0
    over: float = 0.0  # s beyond the burn limit


class ForceTable:
    """A bead under the force-controlled grinder (`hwsim.protocols.Machine`)."""

    def __init__(
        self, setup: ForceTableSetup, passes: np.random.Generator, noise: np.random.Generator
    ) -> None:
        self.time, self.done, self.event = 0, False, False
        self._setup, self._passes, self._noise = setup, passes, noise
        stand, disc = setup.stand, setup.disc
        self._z = setup.bead.z.copy()
        self._phase, self._left, self._feed = IDLE, 0, 0.0
        grinding = _BOUNCING if stand.grinder_inertia > 0 else _GRINDING
        step = stand.tick / SUB_STEPS
        self._drive_core, self._sensor_core = stand.drive.core(step), stand.sensor.core(step)
        self._layout = TableLayout(grinding, SUB_STEPS // grinding, stand.datum, disc.contact_stiffness)
        self._state = np.zeros(kernels.STATES)
        self._state[kernels.PHASE] = noise.uniform(0, 2 * np.pi)
        self._state[kernels.SPIN] = self._free_speed
        self._drive, self._sensors = (
            stand.drive.start(self._drawn_back()),
            np.zeros((2, stand.sensor.start().size)),
        )
        self._state[kernels.CENTER] = stand.start_x
        self._cut = np.zeros(cutting.STATES)
        self._log: list[Done] = []
        self._stalls, self._lead_samples = 0, 0
        self._reading = StandReadings()
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
        if start > (latest := self._setup.bead.x[0] + reach(self._setup.disc)):
            raise checks.refuse(
                "start_x", f"<= {latest:.6g}, so that the tip is before the bead", start, "mm"
            )
        self._log.append(Done(drawn_disc(stand.pass_scatter, self._setup.disc, self._passes)))
        self._prepare(start)

    def _prepare(self, start: float) -> None:
        """Put everything where a pass begins; spin angle, spin and wear stay as they are."""
        stand, back, disc = self._setup.stand, self._drawn_back(), self._log[-1].disc
        self._metal = self._setup.bead.metal(self._z, disc.model.bead_width)
        self._grinder = self._grinder_core(disc)
        self._core = self._disc_core(disc)
        self._drive[:] = stand.drive.start(back)
        self._sensors[:] = stand.sensor.start()
        self._queue = [back] * stand.delay_samples
        self._last_command = back
        kept, worn = self._state[[kernels.PHASE, kernels.SPIN]], self._cut[cutting.WEAR]
        self._state[:], self._cut[:] = 0.0, 0.0
        self._state[[kernels.PHASE, kernels.SPIN]], self._cut[cutting.WEAR] = kept, worn
        self._state[kernels.CENTER] = start
        self._cut[cutting.TIP_X] = start - reach(disc)
        self._cut[cutting.TIP_Z] = stand.datum - back - drop(disc)
        limit = stand.problem.burn_limit or stand.charges.burn_limit
        self._burning = inf if limit is None else float(limit.interval(disc.model, self._feed)[1])  # N
        self._phase, self._reading, self._pass_start = LEAD_IN, StandReadings(), self.time

    def _grinder_core(self, disc: TiltedDisc) -> Grinder:
        stand, motor, model = self._setup.stand, self._setup.stand.motor, disc.model
        inertia, stiffness = stand.grinder_inertia, disc.rotational_stiffness or 0.0
        motor = Motor(model.free_speed, model.speed_droop, spin_time=0.0) if motor is None else motor
        return Grinder(
            *(
                stand.tick / self._layout.grinding,
                disc.relaxed_angle,
                stiffness,
                inertia,
                2 * _DAMPING * sqrt(inertia * stiffness),
            ),
            *(motor.free_speed, motor.speed_droop, motor.spin_time, stand.runout),
            reads_spring=stand.spring_first,
        )

    def _disc_core(self, disc: TiltedDisc) -> cutting.CutCore:
        """With inertia, contact meets a spring that is stiffer by what turns the grinder in one sub-step."""
        core = disc.core
        core = core._replace(
            angles=np.ascontiguousarray(core.angles), torques=np.ascontiguousarray(core.torques)
        )
        if self._grinder.inertia == 0.0:
            return core
        slope, _ = kernels.inertial(self._grinder, np.zeros(kernels.STATES))
        return core._replace(torques=np.array([0.0, self._grinder.stiffness + slope]))

    @property
    def _free_speed(self) -> float:
        motor = self._setup.stand.motor
        return float(self._setup.disc.model.free_speed if motor is None else motor.free_speed)

    def _drawn_back(self) -> float:
        """Platform position (mm) with the disc clear of the bead."""
        stand, disc = self._setup.stand, self._setup.disc
        return float(stand.datum - self._z.max() - drop(disc) - stand.clearance)

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
            *(self._metal, self._core, self._cut, self._grinder, state, self._feed, self._applied()),
            *(self._drive, self._drive_core, self._sensors, self._sensor_core, self._layout),
        )
        self.time += 1
        if self._phase == ON_BEAD:
            done.samples += 1
            done.force += float(state[kernels.FORCE_SUM])
        else:
            self._lead_samples += 1
        if state[kernels.FORCE_SUM] > self._burning:
            done.over += self._setup.stand.tick
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
        bead, tip, stand = self._setup.bead, self._cut[cutting.TIP_X], self._setup.stand
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
            n = pass_.samples
            volume = cut * self._setup.bead.length * self._setup.disc.model.bead_width
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
        self._reading.add(force, friction, speed, self._setup.disc.model.disk_radius)

    def _measured(self) -> dict[str, Any]:
        stand = self._setup.stand
        now = self._at_event if self._at_event is not None else _NO_EVENT
        left = stand.start_time - self.time * stand.tick
        if self._phase in (IDLE, RESET):
            still = {"force": nan, "friction_force": nan, "disk_speed": self._free_speed, "center_x": nan}
            return {
                **still,
                "table_position": nan,
                "pass_time": nan,
                "time_left": left,
                "phase": float(self._phase),
                **now,
            }
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
        area, done = bead.length * self._setup.disc.model.bead_width, self._log
        return {
            "penalty": self._penalty(height),
            **{"height": height, "overground": mean, "overground_worst": worst},
            **{
                "passes": len(done),
                "time": self.time * stand.tick,
                "lead_time": self._lead_samples * stand.tick,
            },
            **{"lateness": self._lateness, "stalls": self._stalls},
            **{"burned": sum(each.over > 0 for each in done), "burn_time": sum(each.over for each in done)},
            "contour": self._z.copy(),
            "true_cut_depth": [each.volume / area for each in done],
            "true_specific_energy": [each.disc.model.specific_energy for each in done],
            "true_idle_power": [each.disc.model.idle_power for each in done],
            "true_friction_ratio": [each.disc.model.friction_ratio for each in done],
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
        shared = ("_setup", "_drive_core", "_sensor_core", "_core", "_grinder", "_layout")
        for name, value in vars(self).items():
            if name not in shared:
                setattr(twin, name, copy.deepcopy(value, memo))
        if twin._log:
            twin._metal = self._metal._replace(z=twin._z)
        return twin
