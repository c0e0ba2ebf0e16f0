"""One part on the adaptive grinder: a slide with lag, a power monitor with lag, a wheel that dulls."""

from collections.abc import Mapping
from math import ceil, exp, inf, nan
from typing import Any, NamedTuple

import numpy as np

from hwsim._part.clock import Clock, exact
from hwsim.devices import Gauge
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.locus.kernels import Ranges, best_rates
from sdpgrind.locus.processes import Grinding

SETTLED = 0.05  # converged: error over the best rate; chosen: the usual 5 % band
SKIN = 1e-6  # slack that counts as 0, W; chosen: above rounding
_LEGENDRE = np.polynomial.legendre.leggauss(16)
_NODES, _WEIGHTS = (_LEGENDRE[0] + 1) / 2, _LEGENDRE[1] / 2
_FORGOTTEN = 40.0  # lags after which a reading is forgotten; derived: e^-40 is below rounding
_SHORT = 2.0  # lags in one piece of the quadrature; chosen: 16 nodes resolve it
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


class _Course(NamedTuple):
    """Infeed that settles on a command: rate (mm/s) and depth (mm) over time, in closed form."""

    command: float
    excess: float  # initial rate minus command, mm/s
    lag: float
    removed: float  # initial depth, mm

    def rate(self, time: Any) -> Any:
        return self.command + (self.excess * np.exp(-time / self.lag) if self.lag else 0.0 * time)

    def depth(self, time: Any) -> Any:
        settling = -self.excess * self.lag * np.expm1(-time / self.lag) if self.lag else 0.0
        return self.removed + self.command * time + settling


class AdaptivePart:
    """A live part; see `hwsim.protocols.Machine`."""

    def __init__(self, rig: AdaptiveRig, process: Grinding, ranges: Ranges, rng: np.random.Generator) -> None:
        self.time, self.done, self.event = 0, False, False
        self._rig, self._process, self._ranges, self._rng = rig, process, ranges, rng
        self._clock = Clock(exact("tick", rig.tick))
        self._most = ceil(rig.max_time / rig.tick * (1 - 1e-12))
        self._command, self._rotation = 0.0, nan
        self._rate = self._removed = self._power = 0.0  # slide, mm/s; work, mm; monitor, W
        self._slack = self._part_slack = inf
        self._samples = [
            (0.0, 0.0, float(rig.wear_flat_area), 0.0, 0.0)
        ]  # time, rate, area, power, burning power
        self._seen = self._read()

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
        wheel = _Course(self._command, self._rate - self._command, self._rig.infeed_lag, self._removed)
        left = self._most - self.time
        fed = self._command > 0 or self._rate > 0
        if not fed and ticks > self._most:
            return
        ticks = self._until_gone(wheel, min(ticks, left))
        lasts = self._clock.seconds(ticks)
        if fed:
            self._feel(wheel, lasts)
        else:
            self._power *= exp(-lasts / self._rig.power_lag) if self._rig.power_lag else 0.0
        self.time += ticks
        self._rate, self._removed = float(wheel.rate(lasts)), float(wheel.depth(lasts))
        self._sample()
        self.done = self._removed >= self._rig.stock * (1 - _GONE) or self.time >= self._most

    def _until_gone(self, wheel: _Course, ticks: int) -> int:
        """Number of ticks until the stock is gone, at most `ticks`."""
        stock = self._rig.stock * (1 - _GONE)
        if wheel.depth(self._clock.seconds(ticks)) < stock:
            return ticks
        low, high = 0, ticks
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if wheel.depth(self._clock.seconds(middle)) >= stock else (middle, high)
        return high

    def _feel(self, wheel: _Course, lasts: float) -> None:
        """Monitored power and least slack during the next seconds.

        Nodes are squared towards the start of each piece: the power of a wheel that begins to cut rises like
        the square root of time.
        """
        cuts = _pieces(lasts, self._rig.infeed_lag, self._rig.power_lag)
        width = np.diff(cuts)[:, np.newaxis]
        times = (cuts[:-1, np.newaxis] + width * _NODES**2).ravel()
        power, burning = self._powers(wheel, np.concatenate([times, [0.0, lasts]]))
        self._judge(np.concatenate([times, [0.0, lasts]]), burning - power)
        lag = self._rig.power_lag
        if lag:
            weights = (width * _WEIGHTS * 2 * _NODES).ravel() * np.exp((times - lasts) / lag) / lag
            self._power = self._power * exp(-lasts / lag) + float(weights @ power[:-2])
        else:
            self._power = float(power[-1])

    def _powers(self, wheel: _Course, times: Floats) -> tuple[Floats, Floats]:
        """True grinding and burning power (W) at times from now."""
        rate = wheel.rate(times)
        area = self._area(wheel.depth(times))
        power = self._process.grinding_power(rate, self._rotation, area)
        return power, self._process.burning_power(rate, self._rotation)

    def _area(self, removed: Any) -> Any:
        return self._rig.wear_flat_area + self._rig.dulling * removed

    def _judge(self, times: Floats, slack: Floats) -> None:
        """Keep the least slack, with and without the touch-in."""
        self._part_slack = min(self._part_slack, float(slack.min()))
        judged = self._clock.seconds(self.time) + times >= self._rig.touch_in
        if judged.any():
            self._slack = min(self._slack, float(slack[judged].min()))

    def _sample(self) -> None:
        """Store the truth at this tick."""
        area, power, burning = float(self._area(self._removed)), 0.0, 0.0
        if self._rate > 0:
            power = float(self._process.grinding_power(self._rate, self._rotation, area))
            burning = float(self._process.burning_power(self._rate, self._rotation))
        self._samples.append((self._clock.seconds(self.time), self._rate, area, power, burning))

    def _read(self) -> dict[str, float]:
        power = self._rig.power_gauge.read(
            self._power + self._rig.idle_error, float(self._rng.standard_normal())
        )
        return {"grinding_power": power, "infeed_rate": self._rate, "removed": self._removed}

    def outcome(self) -> dict[str, Any]:
        """Result of the part; see the plant."""
        time, rate, area, power, burning = (np.array(column) for column in zip(*self._samples, strict=True))
        best = best_rates(self._process, self._ranges, area)
        slack = self._slack if self._slack < inf else nan
        lasted = self._clock.seconds(self.time)
        volume = np.pi * self._process.work_diameter * self._process.width * self._removed
        return {
            "time": lasted,
            "slack": slack,
            "part_slack": self._part_slack if self._part_slack < inf else nan,
            "burned": float(slack < -SKIN),
            "convergence_time": _settled(time, np.abs(rate - best) <= SETTLED * best),
            "removal_rate": float(volume / lasted) if lasted else 0.0,
            "remaining": max(0.0, self._rig.stock - self._removed),
            "timed_out": float(self._removed < self._rig.stock * (1 - _GONE)),
            "true_wear_flat_area": float(area[-1]),
            "sample_time": time,
            "true_infeed_rate": rate,
            "best_infeed_rate": best,
            "true_grinding_power": power,
            "burning_power": burning,
        }


def _pieces(lasts: float, infeed_lag: float, power_lag: float) -> Floats:
    """Cuts of 0..lasts between which exponentials of both lags are smooth."""
    rises = infeed_lag * 2.0 ** np.arange(6) if infeed_lag else np.empty(0)
    fades = lasts - power_lag * np.arange(_SHORT, _FORGOTTEN + _SHORT, _SHORT) if power_lag else np.empty(0)
    inner = np.concatenate([rises, fades])
    return np.unique(np.concatenate([[0.0, lasts], inner[(inner > 0) & (inner < lasts)]]))


def _settled(time: Floats, near: Any) -> float:
    """Time of the first sample from which on all are `near`; NaN: the last one is not."""
    if not near[-1]:
        return nan
    away = np.flatnonzero(~near)
    return float(time[away[-1] + 1]) if away.size else float(time[0])
