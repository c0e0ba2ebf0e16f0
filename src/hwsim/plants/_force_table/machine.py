"""One bead on the force table: commands, gauges, scans, and the time between passes."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, nan
from typing import Any, ClassVar, NamedTuple

import numpy as np

from hwsim.plants._weldbead.machine import OF_PASS
from hwsim.protocols import FOREVER
from sdpgrind.base import checks
from sdpgrind.base.controllers import Stateful
from sdpgrind.base.units import N_MM_S_PER_W
from sdpgrind.weldbead.kernels import IDLE, RESET, BeadOnTable, GroundBead, drawn_disc, reach
from sdpgrind.weldbead.kernels import force_table as kernels
from sdpgrind.weldbead.passes import TiltedDisc

_IN_CONTACT = 2.0  # least reading in contact, N; chosen: above the noise of the sensor
_NOISE = 512  # samples whose noise is drawn together; chosen: fewer cost a call each
_AT_EVENTS = ("profile", "profile_x", "height", *OF_PASS)
_NO_EVENT = dict.fromkeys(_AT_EVENTS, nan)


class ForceTableSetup(NamedTuple):
    """The stand, the bead before its first pass, and the true mean disc."""

    stand: Any  # a ForceTableStand, defined above this module
    bead: GroundBead
    disc: TiltedDisc


@dataclass
class StandReadings:
    """Sums of readings over the samples of one pass in contact."""

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


class ForceTable(Stateful):
    """A bead under the force-controlled grinder (`hwsim.protocols.Machine`)."""

    _changing: ClassVar[tuple[str, ...]] = ("_passes", "_noise", "_table", "_reading")

    def __init__(
        self, setup: ForceTableSetup, passes: np.random.Generator, noise: np.random.Generator
    ) -> None:
        self.time, self.done, self.event = 0, False, False
        self._setup, self._passes, self._noise = setup, passes, noise
        self._table = BeadOnTable(*setup, noise.uniform(0, 2 * np.pi))
        self._left = 0  # ticks until the end of the reset
        self._reading = StandReadings()
        self._read, self._normals_now = (0.0, 0.0, self._table.free_speed), [0.0] * 5
        self._normals: list[list[float]] = []  # numbers of Python: five entries of an array take longer
        self._next = 0
        self._command = self._table.drawn_back()
        self._scan = self._scanned()
        self._at_event: dict[str, Any] | None = dict(self._scan, **dict.fromkeys(OF_PASS, nan))

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, Any]:
        """Apply `command`, advance by at most `ticks` samples, measure."""
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
        """Draw the truth of the pass and begin it."""
        stand = self._setup.stand
        if self._table.phase != IDLE:
            raise ValueError("start must wait for the end of the pass before, its reset and its scan")
        if "feed_rate" not in command:
            raise ValueError("a pass needs feed_rate (mm/s) with its start")
        feed = checks.positive("feed_rate", command["feed_rate"], "mm/s")
        start = checks.number("start_x", command.get("start_x", stand.start_x), "mm")
        if start > (latest := self._setup.bead.x[0] + reach(self._setup.disc)):
            raise checks.refuse(
                "start_x", f"<= {latest:.6g}, so that the tip is before the bead", start, "mm"
            )
        self._table.begin(drawn_disc(stand.pass_scatter, self._setup.disc, self._passes), start, feed)
        self._reading, self._pass_start = StandReadings(), self.time
        self._read, self._normals_now = (0.0, 0.0, self._table.free_speed), [0.0] * 5

    def _advance(self, ticks: int) -> None:
        self.event, self._at_event = False, None
        if self._table.phase == IDLE:
            self.time += ticks if ticks < FOREVER else 0  # an idle stand does not advance for ever
            return
        while ticks > 0 and not self.event:
            ticks -= self._wait(ticks) if self._table.phase == RESET else self._sample()

    def _wait(self, ticks: int) -> int:
        """Let the grinder return; scan at its end."""
        moved = min(ticks, self._left)
        self.time += moved
        self._left -= moved
        if self._left == 0:
            self._table.phase, self.event = IDLE, True
            self._finish_pass()
        return moved

    def _sample(self) -> int:
        """One control sample of a pass."""
        stand = self._setup.stand
        self._table.advance(self._command)
        self.time += 1
        self._sense()
        self._table.go_on()
        if self._table.phase == RESET:
            self._left = max(1, round(stand.charges.reset_time / stand.tick))
        return 1

    def _finish_pass(self) -> None:
        """Scan, and measure the pass from sensors and both scans."""
        before, self._scan = self._scan, self._scanned()
        cut, pass_ = before["height"] - self._scan["height"], self._reading
        of_pass = dict.fromkeys(OF_PASS, nan) | {"feed_rate": self._table.feed, "cut_depth": cut}
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

    def _normal(self) -> list[float]:
        """Five standard normal numbers for the gauges of one sample."""
        if self._next == len(self._normals):
            self._normals, self._next = self._noise.standard_normal((_NOISE, 5)).tolist(), 0
        self._next += 1
        return self._normals[self._next - 1]

    def _sense(self) -> None:
        """Read forces and spin, once a sample."""
        stand, normal = self._setup.stand, self._normal()
        sd, self._normals_now = stand.sensor.noise_sd, normal
        force, friction = self._table.read(sd * normal[0], sd * normal[1])
        speed = stand.speed_gauge.read(float(self._table.state[kernels.SPIN]), normal[2])
        self._read = force, friction, speed
        self._reading.add(force, friction, speed, self._setup.disc.model.disk_radius)

    def _measured(self) -> dict[str, Any]:
        stand, table = self._setup.stand, self._table
        force, friction, speed = self._read
        measured = {"force": force, "friction_force": friction, "disk_speed": speed}
        if table.phase in (IDLE, RESET):
            measured = {"force": nan, "friction_force": nan, "disk_speed": table.free_speed}
            measured |= dict.fromkeys(("center_x", "table_position", "pass_time"), nan)
        else:
            center, platform = float(table.state[kernels.CENTER]), float(table.drive[4])
            measured["center_x"] = stand.feed_gauge.read(center, self._normals_now[3])
            measured["table_position"] = stand.table_gauge.read(platform, self._normals_now[4])
            measured["pass_time"] = (self.time - self._pass_start) * stand.tick
        left = stand.start_time - self.time * stand.tick
        now = self._at_event if self._at_event is not None else _NO_EVENT
        return {**measured, "time_left": left, "phase": float(table.phase), **now}

    def _scanned(self) -> dict[str, Any]:
        bead = self._setup.bead
        x, z = self._setup.stand.scanner.scan(bead.x, self._table.z, self._noise)
        above = z - np.interp(x, bead.x, bead.parent)
        return {"profile": z, "profile_x": x, "height": float(np.trapezoid(above, x)) / bead.length}

    def outcome(self) -> dict[str, Any]:
        """Result of the bead; see the stand."""
        stand, bead, table, done = self._setup.stand, self._setup.bead, self._table, self._table.passes
        height, (mean, worst) = bead.height(table.z), bead.overground(table.z)
        area, models = bead.length * self._setup.disc.model.bead_width, [each.disc.model for each in done]
        return {
            "penalty": self._penalty(height),
            "height": height,
            "overground": mean,
            "overground_worst": worst,
            "passes": len(done),
            "time": self.time * stand.tick,
            "lead_time": table.lead_samples * stand.tick,
            "lateness": self._lateness,
            "stalls": table.stalls,
            "burned": sum(each.over > 0 for each in done),
            "burn_time": sum(each.over for each in done),
            "contour": table.z.copy(),
            "true_cut_depth": [each.volume / area for each in done],
            "true_specific_energy": [model.specific_energy for model in models],
            "true_idle_power": [model.idle_power for model in models],
            "true_friction_ratio": [model.friction_ratio for model in models],
            "true_force": [each.force / max(1, each.samples) for each in done],
            "true_volume": [each.volume for each in done],
        }

    @property
    def _lateness(self) -> float:
        stand = self._setup.stand
        return float(max(0.0, self.time * stand.tick - stand.start_time))

    def _penalty(self, height: float) -> float:
        """Charges for height, lateness, the finish of the last pass, and passes, $."""
        charges, passes = self._setup.stand.charges, len(self._table.passes)
        penalty = float(charges.height_charge(height)) + charges.pass_charge * passes
        if charges.lateness_charge is not None:
            penalty += float(np.asarray(charges.lateness_charge(np.asarray(self._lateness))))
        if charges.finish_charge is not None and passes:
            penalty += float(charges.finish_charge(self._table.feed))
        return float(penalty)
