"""One part on the adaptive grinder: a slide with lag, a power monitor with lag, a wheel that dulls."""

from collections.abc import Mapping
from math import ceil, inf, nan
from typing import Any, NamedTuple

import numpy as np

from hwsim._part.clock import Clock, exact
from hwsim.devices import Gauge
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus.kernels import GroundPart, InfeedCourse, Ranges, best_rates
from sdpgrind.locus.processes import Grinding

SETTLED = 0.05  # converged: error over the best rate; chosen: the usual 5 % band
SKIN = 1e-6  # slack that counts as 0, W; chosen: above rounding
_GONE = 1e-12  # rest over stock that counts as 0; chosen: above rounding


class AdaptiveRig(NamedTuple):
    """Machine and wheel at the start of a part; fields as in `AdaptiveGrinder`."""

    wear_flat_area: float
    dulling: float
    stock: float
    infeed_lag: float
    power_lag: float
    power_gauge: Gauge
    idle_error: float
    touch_in: float
    max_time: float
    tick: float


class AdaptivePart:
    """A live part; see `hwsim.protocols.Machine`."""

    def __init__(self, rig: AdaptiveRig, process: Grinding, ranges: Ranges, rng: np.random.Generator) -> None:
        self.time, self.done, self.event = 0, False, False
        self._ranges, self._rng, self._grinding = ranges, rng, process
        self._clock = Clock(exact("tick", rig.tick))
        self._most = ceil(rig.max_time / rig.tick * (1 - 1e-12))
        self._command, self._rotation = 0.0, nan
        self._begin(rig)
        self._seen = self._read()

    def _begin(self, rig: AdaptiveRig) -> None:
        """Put an unground part before the wheel."""
        self._rig = rig
        self._part = GroundPart(self._grinding, rig)
        self._samples = [(0.0, *self._part.truth(nan))]  # time, rate, area, power, burning power

    def step(self, command: Mapping[str, Any], ticks: int) -> dict[str, float]:
        """Take a command, grind for `ticks` or until the stock is gone, measure."""
        if command:
            self._take(command)
        if ticks and not self.done:
            self._grind(ticks)
            self._seen = self._read()
        return dict(self._seen)

    def _take(self, command: Mapping[str, Any]) -> None:
        if "infeed_rate" in command:
            rate = checks.nonnegative("infeed_rate", command["infeed_rate"], "mm/s")
            most = self._ranges.infeed_rate_max
            if rate > most * (1 + 1e-9):
                raise checks.refuse("infeed_rate", f"<= {most:g}", rate, "mm/s")
            self._command = rate
        if "work_rotation" in command:
            rotation = checks.positive("work_rotation", command["work_rotation"], "rad/s")
            least, most = self._ranges.work_rotation_min, self._ranges.work_rotation_max
            if not least * (1 - 1e-9) <= rotation <= most * (1 + 1e-9):
                raise checks.refuse("work_rotation", f"in [{least:g}, {most:g}]", rotation, "rad/s")
            self._rotation = rotation
        if self._command > 0 and self._rotation != self._rotation:
            raise ValueError("work_rotation must be commanded with the first infeed_rate; got none (rad/s)")

    def _grind(self, ticks: int) -> None:
        """Advance under the current command; without infeed, only for a limited time."""
        part, left = self._part, self._most - self.time
        if not (self._command > 0 or part.rate > 0) and ticks > self._most:
            return
        course = part.course(self._command)
        ticks = self._until_gone(course, min(ticks, left))
        part.advance(course, self._rotation, self._clock.seconds(self.time), self._clock.seconds(ticks))
        self.time += ticks
        self._samples.append((self._clock.seconds(self.time), *part.truth(self._rotation)))
        self.done = part.removed >= self._rig.stock * (1 - _GONE) or self.time >= self._most

    def _until_gone(self, course: InfeedCourse, ticks: int) -> int:
        """Number of ticks until the stock is gone, at most `ticks`."""
        stock = self._rig.stock * (1 - _GONE)
        if course.depth(self._clock.seconds(ticks)) < stock:
            return ticks
        low, high = 0, ticks
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (
                (low, middle) if course.depth(self._clock.seconds(middle)) >= stock else (middle, high)
            )
        return high

    def _read(self) -> dict[str, float]:
        power = self._rig.power_gauge.read(
            self._part.power + self._rig.idle_error, float(self._rng.standard_normal())
        )
        return {"grinding_power": power, "infeed_rate": self._part.rate, "removed": self._part.removed}

    def _best(self, area: Floats) -> Floats:
        """Best infeed rates, mm/s, at areas of the wheel; NaN where every rate burns."""
        return best_rates(self._part.process, self._ranges, area)

    def outcome(self) -> dict[str, Any]:
        """Result of the part; see the plant."""
        part = self._part
        time, rate, area, power, burning = (np.array(column) for column in zip(*self._samples, strict=True))
        best = self._best(area)
        slack = part.slack if part.slack < inf else nan
        lasted = self._clock.seconds(self.time)
        volume = np.pi * part.process.work_diameter * part.process.width * part.removed
        return {
            "time": lasted,
            "slack": slack,
            "part_slack": part.part_slack if part.part_slack < inf else nan,
            "burned": float(slack < -SKIN),
            "convergence_time": _settled(time, np.abs(rate - best) <= SETTLED * best),
            "removal_rate": float(volume / lasted) if lasted else 0.0,
            "remaining": max(0.0, self._rig.stock - part.removed),
            "timed_out": float(part.removed < self._rig.stock * (1 - _GONE)),
            "true_wear_flat_area": float(area[-1]),
            "sample_time": time,
            "true_infeed_rate": rate,
            "best_infeed_rate": best,
            "true_grinding_power": power,
            "burning_power": burning,
        }


def _settled(time: Floats, near: Any) -> float:
    """Time of the first sample from which on all are `near`; NaN: the last one is not."""
    if not near[-1]:
        return nan
    away = np.flatnonzero(~near)
    return float(time[away[-1] + 1]) if away.size else float(time[0])
