"""Parameters of a controller as plain arrays for compiled code."""

import dataclasses
from functools import cached_property
from math import ceil, exp
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import specs
from sdpgrind.base.states import floats, named
from sdpgrind.finishing.torque import _states as at
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.finishing.torque._gains import DampingGains, Gains, LqgGains, PidffGains

KINDS = {"constant": at.CONSTANT, "pidff": at.PIDFF, "damped": at.DAMPED, "lqg": at.LQG}
OBSERVERS = {"pid": at.PID_OBSERVER, "state": at.STATE_OBSERVER, "ideal": at.IDEAL}
_GAINS = {"pidff": PidffGains, "damped": DampingGains, "lqg": LqgGains}


class TorqueLaw(NamedTuple):
    """Arrays of a controller for compiled loops; see `sdpgrind.finishing.kernels`.

    Attributes
    ----------
    parameters : array
        Law of `kernels.controller_step`, in N m, A, rad and s.
    start : array
        State at the start of a part; loops work on a copy.
    time : array, shape (m,)
        Times of the motion, s; a single one without a motion.
    torque : array, shape (m,)
        Torque reference with the known load torque, N m.
    load : array, shape (m,)
        Known load torque, N m.
    """

    parameters: Floats
    start: Floats
    time: Floats
    torque: Floats
    load: Floats


@dataclasses.dataclass(frozen=True)
class Setting:
    """Parts of a loop: believed axis, kind, gains, source of the torque."""

    axis: TorqueAxis
    kind: str
    gains: Gains | None
    observer: str
    prefilter: bool

    @property
    def speed(self) -> float | None:
        """Fastest pole (1/s), a bound on the sample time; None: there is no loop."""
        if isinstance(self.gains, PidffGains):
            return self.gains.pole
        if isinstance(self.gains, LqgGains):
            return self.gains.bandwidth
        return None if self.gains is None else self.axis.natural_frequency

    def check_sampling(self) -> None:
        """Refuse a sample time that is too long."""
        speed, axis = self.speed, self.axis
        if speed is not None and axis.sample_time > 1.0 / (5.0 * speed):
            raise checks.refuse(
                "sample_time",
                f"<= 1/(5 p) = {1 / (5 * speed):.3g} for p = {speed:.4g} 1/s",
                axis.sample_time,
                "s",
            )

    @cached_property
    def linear(self) -> Floats:
        """Array of the bare loop for compiled code: no rounding, clipping or prefilter."""
        found = self.parameters(digital=False)
        named(found, at.LAW).prefilter = 0.0
        return found

    def parameters(self, settle_time: float = 0.0, digital: bool = True) -> Floats:
        """Array for compiled code; without `digital` no rounding and clipping of currents."""
        axis, row = self.axis, floats(at.LAW)
        p = named(row, at.LAW)
        p.kind, p.observer = KINDS[self.kind], OBSERVERS[self.observer]
        p.sample_time, p.motor_constant = axis.sample_time, axis.torque_constant
        p.current_max, p.current_step = (axis.current_limit, axis.current_step) if digital else (np.inf, 0.0)
        p.settle_steps = ceil(settle_time / axis.sample_time - 1e-9)
        p.inertia, p.stiffness = axis.inertia, axis.contact_angular_stiffness
        if isinstance(self.gains, PidffGains):
            self._pidff(p, self.gains)
        elif isinstance(self.gains, DampingGains):
            p.speed_gain = self.gains.speed_gain(axis)
            p.speed_pole = exp(-axis.sample_time / self.gains.highpass_time)
        elif self.gains is not None:
            self._lqg(p, self.gains)
        return row

    def _pidff(self, p: Any, gains: PidffGains) -> None:
        for name in specs(PidffGains):
            setattr(p, name, getattr(gains, name))
        if self.prefilter:
            p.prefilter = exp(-gains.prefilter_rate(self.axis) * self.axis.sample_time)

    def _lqg(self, p: Any, gains: LqgGains) -> None:
        A, B, _ = gains.sampled(self.axis)
        p.feedback_torque, p.feedback_speed = gains.feedback(self.axis)
        p.gain, p.input, p.matrix = gains.kalman(self.axis), B, A.ravel()


def setting(axis: TorqueAxis, kind: str, gains: object, observer: str, prefilter: bool) -> Setting:
    """Check the parts of a controller."""
    if kind != "pidff" and (observer != "pid" or prefilter):
        raise ValueError(
            f"observer and prefilter must be left as they are with kind {kind!r};"
            f" got {observer!r} and {prefilter}"
        )
    return Setting(axis, kind, _gains(kind, gains), observer, prefilter)


def _gains(kind: str, gains: object) -> Gains | None:
    if kind == "constant":
        if gains is not None:
            raise checks.refuse("gains", "left out with kind 'constant', which has no loop", gains)
        return None
    wanted: type[Gains] = _GAINS[kind]
    if gains is None:
        return wanted()
    return checks.kind("gains", gains, wanted, f", for kind {kind!r}")
