"""Properties of gains on a stretch: stability, violation, noise, drift."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.locus._path.calibration import hidden_ranges
from sdpgrind.locus._path.stretch import Stretch
from sdpgrind.locus.gains._drift import NEAR, ROOM, ROUNDS, Drift
from sdpgrind.locus.gains._gain_schedule import GainSchedule
from sdpgrind.locus.gains._least_value import least
from sdpgrind.locus.gains._loops import Lag, Pid, radius, sampled_radius

FACTOR = 0.9  # chosen: recommended share of the largest gain without violation; the rest covers model errors
ROUNDING = 1e-6  # chosen: share by which a gain may exceed the violation-free one


@dataclass(frozen=True, eq=False)
class GainDesign(Frozen):
    """Limits and properties of gains on a stretch, over a range of the hidden state; from `design_gain`.

    A gain k >= 0 has the units of the coordinate over those of the response. The controller moves the
    coordinate by k (limit - response) in the direction of falling slack.

    Attributes
    ----------
    gain : float
        Recommended gain: `FACTOR` times the lesser of `violation_free` and `deadbeat`.
    stable : float
        Upper bound of gains stable at every hidden state of the range: ``2/max|e_s|``.
    violation_free : float
        Greatest gain without a step beyond the optimum of a constant state: least (s* - s)/e from the start.
    deadbeat : float
        ``1/max|e_s|``: greatest gain without overshoot near the optimum.
    theta : float
        Recommended theta of a `schedule`: `FACTOR` times `theta_free`, dimensionless.
    theta_free : float
        Greatest theta of a `schedule` without a step beyond the optimum of a constant state, dimensionless.
    start : float
        Initial coordinate, with slack for every hidden state of the range.
    x : (float, float)
        Range of the hidden state.

    Examples
    --------
    >>> from sdpgrind import locus
    >>> curve = locus.plan(locus.preset("koren-example"))
    >>> design = locus.gains.design_gain(curve, along="v", x=(0.5, 20.0))
    >>> [round(k, 4) for k in (design.stable, design.violation_free, design.gain)]  # dimensionless here
    [0.1086, 0.0543, 0.0489]
    >>> [(round(a, 3), round(b, 3)) for a, b in design.stable_range(0.6)]  # stable with Koren's gain
    [(0.5, 4.052)]
    >>> round(design.drift_margin(0.01), 2)
    0.43
    """

    stretch: Stretch
    x: tuple[float, float]
    start: float
    stable: float
    violation_free: float
    theta_free: float

    @property
    def gain(self) -> float:
        """Recommended gain, in units of the coordinate over those of the response."""
        return FACTOR * min(self.violation_free, self.deadbeat)

    @property
    def theta(self) -> float:
        """Recommended share of deadbeat of a schedule, dimensionless."""
        return FACTOR * self.theta_free

    @property
    def deadbeat(self) -> float:
        """Gain of one-step convergence at the steepest loop slope: units of coordinate over response."""
        return 0.5 * self.stable

    @cached_property
    def noise_gain(self) -> float:
        """std(s)/std(reading) of `gain` at the worst hidden state: units of coordinate over response."""
        return self.noise_gain_at(self.gain)

    def noise_gain_at(self, gain: float, *, x: float | None = None) -> float:
        """Return k / sqrt(1 - (1 + k e_s)^2), the standard deviation of the coordinate for unit white noise.

        Parameters
        ----------
        gain : float
            k, in units of the coordinate over those of the response.
        x : float, optional
            Hidden state. None: the worst of the range.

        Raises
        ------
        ValueError
            When the gain is unstable.
        """
        k = checks.positive("gain", gain)
        place = None if x is None else self.stretch.coordinate_of(x)
        steepest = self.slope_at(place) if place is not None else 2 / self.stable
        if k * steepest >= 2:
            raise checks.refuse("gain", f"< {2 / steepest:.6g}, where it is stable", k)

        def noise(s: Floats) -> Floats:
            return np.asarray(k / np.sqrt(1 - (1 - k * self.slope_at(s)) ** 2))

        return (
            float(noise(np.asarray(place)))
            if place is not None
            else -least(lambda s: -noise(s), self._places)[0]
        )

    def slope_at(self, s: Any) -> Any:
        """Return ``|e_s|`` at a coordinate, in units of the response over those of the coordinate.

        Parameters
        ----------
        s : float or array
            Coordinate.
        """
        return np.abs(self.stretch.slopes.at(s)[..., 0])

    def stable_range(
        self, gain: float, *, kp: float = 0.0, kd: float = 0.0
    ) -> tuple[tuple[float, float], ...]:
        """Return the ranges of the hidden state with a stable loop, in its unit.

        Parameters
        ----------
        gain, kp, kd : float
            Integral, proportional and derivative gain, in units of the coordinate over those of the response.
        """
        pid, s = Pid(gain, kp, kd), np.linspace(*self._places, 513)
        return hidden_ranges(lambda s: self._radius(s, pid) < 1, s, self._hidden, 50)

    def radius(
        self,
        gain: float,
        *,
        kp: float = 0.0,
        kd: float = 0.0,
        lag: float = 0.0,
        sensor_lag: float = 0.0,
        period: float = 0.5,
        at: str = "command",
        x: float | None = None,
    ) -> float:
        """Return the largest modulus of the poles of the loop, dimensionless; stable below 1.

        Parameters
        ----------
        gain, kp, kd : float
            Integral, proportional and derivative gain, in units of the coordinate over those of the response.
        lag, sensor_lag : float
            Time constants of the coordinate and of the reading, s. The other controls have no lag.
        period : float
            Sampling period, s; without effect where there is no lag.
        at : {"command", "actual"}
            Coordinate of the limit.
        x : float, optional
            Hidden state. None: the worst of the range.
        """
        for name, time in (("lag", lag), ("sensor_lag", sensor_lag)):
            checks.nonnegative(name, time, "s")
        pid, delays = Pid(gain, kp, kd), Lag(lag, sensor_lag, checks.positive("period", period, "s"))
        checks.one_of("at", at, ("command", "actual"))
        s = (
            np.linspace(*self._places, 33 if lag else 513)
            if x is None
            else np.array([self.stretch.coordinate_of(x)])
        )
        if not lag:
            return float(self._radius(s, pid).max())
        return max(sampled_radius(self.stretch, float(place), pid, delays, at) for place in s)

    def _radius(self, s: Floats, pid: Pid) -> Floats:
        return radius(self.slope_at(s), pid)

    def _hidden(self, s: Floats) -> Floats:
        return self.stretch.rows(s)[:, len(self.stretch.names)]

    @property
    def _places(self) -> tuple[float, float]:
        low, high = sorted(self.stretch.coordinate_of(np.array(self.x), clamp=True).tolist())
        return low, high

    def schedule(self, theta: float | None = None) -> GainSchedule:
        """Return the schedule ``k(s) = theta/|e_s(s)|``, in units of coordinate over response.

        Parameters
        ----------
        theta : float, optional
            Share of deadbeat, in (0, 1], dimensionless. None: the recommended one.
        """
        return GainSchedule(self.stretch, self.theta if theta is None else theta)

    def drift_margin(self, rate: float, *, gain: float | GainSchedule | None = None) -> float:
        """Return the margin of the limit, in its unit, that prevents violations by a drifting hidden state.

        It is enough for every sequence of hidden states in the range with steps up to `rate`, from a start
        with slack, and is at least the violation without margin. First order: ``|ds*/dx| rate/k``, no less
        than the first step of a sudden drift, P_x rate.

        Parameters
        ----------
        rate : float
            Largest change of the hidden state between two readings, in its unit.
        gain : float or GainSchedule, optional
            Integral gain; the margin covers its overshoot, no `kp` and `kd`. None: the recommended one.

        Raises
        ------
        ValueError
            When the gain is unstable, or the loop cannot follow the drift.
        """
        checks.positive("rate", rate)
        if not isinstance(gain, GainSchedule):
            self.check(self.gain if gain is None else gain, warn=False)
        drift = Drift(self.stretch, self.loose, self.tight, rate, self._by_place(gain), self.start)
        margin = max(drift.worst(0.0), 0.0)
        for _ in range(ROUNDS):
            left = drift.worst(margin)
            if left <= NEAR * margin:
                return ROOM * margin
            if not np.isfinite(margin):
                break
            margin += 1.02 * left
        raise ValueError(f"rate must be so small that the loop keeps up with it; got {rate:g}")

    def _by_place(self, gain: float | GainSchedule | None) -> Callable[[Floats], Floats]:
        if isinstance(gain, GainSchedule):
            return gain
        fixed = self.gain if gain is None else float(gain)
        return lambda s: np.full(np.shape(s), fixed)

    @property
    def loose(self) -> float:
        """End of the range, in the unit of the hidden state, with the largest slack."""
        return self.x[1] if self.tight == self.x[0] else self.x[0]

    @property
    def tight(self) -> float:
        """End of the range, in the unit of the hidden state, with the least slack."""
        return tight_end(self.stretch, self.x)

    def check(self, gain: float, *, kp: float = 0.0, kd: float = 0.0, warn: bool = True) -> None:
        """Refuse gains unstable at a hidden state of the range; warn of those that may violate the limit.

        Parameters
        ----------
        gain, kp, kd : float
            Integral, proportional and derivative gain, in units of the coordinate over those of the response.
        warn : bool
            Whether to warn.

        Raises
        ------
        ValueError
            When the gains are unstable.
        """
        checks.positive("gain", gain)
        low, high = self._places
        if float(np.max(self._radius(np.linspace(low, high, 513), Pid(gain, kp, kd)))) >= 1:
            name, (a, b) = self.stretch.hidden_name, self.x
            ranges = (
                " and ".join(f"{c:.4g}..{d:.4g}" for c, d in self.stable_range(gain, kp=kp, kd=kd))
                or "nothing of it"
            )
            rule = f"< {self.stable:.4g}" if kp == kd == 0 else "smaller with these kp and kd"
            raise ValueError(
                f"gain must be {rule} to be stable for {name} in {a:g}..{b:g};"
                f" got {gain:g}, stable for {ranges}"
            )
        if warn and gain + kp > self.violation_free * (1 + ROUNDING):
            self._warn(f"gain {gain + kp:g}", self.violation_free)
        elif warn and kd > 0:
            warnings.warn(
                f"kd = {kd:g} may step beyond the limit:"
                " what is known of that holds for integral and proportional gains",
                stacklevel=4,
            )

    def check_schedule(self, schedule: GainSchedule) -> None:
        """Warn of a schedule that may violate the limit after the start.

        Parameters
        ----------
        schedule : GainSchedule
            Schedule with its `theta`, dimensionless.
        """
        if checks.kind("schedule", schedule, GainSchedule).theta > self.theta_free * (1 + ROUNDING):
            self._warn(f"theta {schedule.theta:g}", self.theta_free)

    def _warn(self, what: str, most: float) -> None:
        where = f"the start at {self.stretch.along} = {self.start:.6g}"
        warnings.warn(
            f"{what} may step beyond the limit from {where}: it never does up to {most:.4g}", stacklevel=5
        )


def tight_end(stretch: Stretch, x: tuple[float, float]) -> float:
    """Return the tight end of the range: P_x = e_s ds/dx, and its sign is that of both slopes."""
    return x[1] if stretch.loop_slope[0] * (stretch.hidden[-1] - stretch.hidden[0]) > 0 else x[0]
