"""Equations of axis and controller as derived, turned into matrices by unit vectors."""

from collections.abc import Callable

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.states import floats, places
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.finishing.torque._controller_kernels import controller_sample
from sdpgrind.finishing.torque._gains import DampingGains, Gains, LqgGains, PidffGains
from sdpgrind.finishing.torque._law import Setting
from sdpgrind.finishing.torque._loop import INPUTS, OUTPUTS, AxisLoop
from sdpgrind.finishing.torque._states import CONTROLLER

# From state and inputs to what the state becomes and the outputs; linear.
_Flow = Callable[[Floats, Floats], tuple[list[float], list[float]]]
_KEPT = {
    "constant": (),
    "pidff": ("reading", "integral", "obs_angle", "obs_speed", "obs_torque"),
    "damped": ("reading", "slow_speed"),
    "lqg": ("obs_angle", "obs_speed", "obs_torque", "obs_rate"),
}
"""What a controller remembers from sample to sample, the prefilter left out: it is not in the loop."""
_SEEN, _ESTIMATE = places(CONTROLLER, "seen", "estimate")


def continuous(setting: Setting, truth: TorqueAxis) -> AxisLoop:
    """Loop in continuous time, without rounding and prefilter."""
    makers: dict[type, Callable[[Setting, TorqueAxis, Gains], tuple[_Flow, int]]] = {
        PidffGains: _pidff,
        DampingGains: _damped,
        LqgGains: _lqg,
    }
    if setting.gains is None:
        return _linear(*_constant(setting, truth))
    return _linear(*makers[type(setting.gains)](setting, truth, setting.gains))


def sampled(setting: Setting, truth: TorqueAxis) -> AxisLoop:
    """Loop of the compiled controller over a sample, without rounding; currents and surface are constant."""
    parameters = setting.linear
    names = ("integral",) if setting.kind == "pidff" and setting.observer == "ideal" else _KEPT[setting.kind]
    kept = list(places(CONTROLLER, *names)) if names else []

    def flow(x: Floats, u: Floats) -> tuple[list[float], list[float]]:
        state = floats(CONTROLLER)
        state[_SEEN], state[kept] = 1.0, x[2:]
        torque = truth.contact_angular_stiffness * (x[0] - u[2])
        current = controller_sample(parameters, state, x[0], u[0], torque, x[1])
        angle, speed = _swung(truth, x[0], x[1], current, u)
        return [angle, speed, *state[kept]], [torque, state[_ESTIMATE]]

    return _linear(flow, 2 + len(kept), setting.axis.sample_time)


def _swung(truth: TorqueAxis, angle: float, speed: float, current: float, u: Floats) -> tuple[float, float]:
    """Angle and speed after a sample, in permanent contact."""
    rest = u[2] + (truth.torque_constant * current - u[1]) / truth.contact_angular_stiffness
    w = truth.natural_frequency
    c, s = np.cos(w * truth.sample_time), np.sin(w * truth.sample_time)
    return rest + (angle - rest) * c + speed / w * s, speed * c - (angle - rest) * w * s


def _linear(flow: _Flow, order: int, sample_time: float = 0.0) -> AxisLoop:
    """Matrices of a linear map, column by column."""
    rows = np.eye(order + len(INPUTS))
    columns = np.array([np.concatenate(flow(row[:order], row[order:])) for row in rows]).T
    A, B = columns[:order, :order], columns[:order, order:]
    C, D = columns[order:, :order], columns[order:, order:]
    assert len(C) == len(OUTPUTS)
    return AxisLoop(A, B, C, D, sample_time)


def _accelerated(
    truth: TorqueAxis, believed: TorqueAxis, angle: float, drive: float, u: Floats
) -> tuple[float, float]:
    """Acceleration of the motor and contact torque for a commanded torque `drive` (N m)."""
    torque = truth.contact_angular_stiffness * (angle - u[2])
    real = truth.torque_constant / believed.torque_constant * drive
    return (real - torque - u[1]) / truth.inertia, torque


def _constant(setting: Setting, truth: TorqueAxis) -> tuple[_Flow, int]:
    def flow(x: Floats, u: Floats) -> tuple[list[float], list[float]]:
        gain, torque = _accelerated(truth, setting.axis, x[0], u[0], u)
        return [x[1], gain], [torque, u[0]]

    return flow, 2


def _damped(setting: Setting, truth: TorqueAxis, gains: Gains) -> tuple[_Flow, int]:
    assert isinstance(gains, DampingGains)
    slow, speed_gain = gains.highpass_time, gains.speed_gain(setting.axis)

    def flow(x: Floats, u: Floats) -> tuple[list[float], list[float]]:
        drive = u[0] - speed_gain * (x[1] - x[2])
        gain, torque = _accelerated(truth, setting.axis, x[0], drive, u)
        return [x[1], gain, (x[1] - x[2]) / slow], [torque, drive]

    return flow, 3


def _pidff(setting: Setting, truth: TorqueAxis, gains: Gains) -> tuple[_Flow, int]:
    """States: angle, speed, integral of the error; and angle, speed, torque of the observer."""
    assert isinstance(gains, PidffGains)
    axis, observe = setting.axis, _OBSERVERS[setting.observer]
    J, stiffness = axis.inertia, axis.contact_angular_stiffness

    def flow(x: Floats, u: Floats) -> tuple[list[float], list[float]]:
        true = truth.contact_angular_stiffness * (x[0] - u[2])
        estimate, follow = observe(x, gains, J, true)
        error = u[0] - estimate
        drive = J / stiffness * (gains.kp * error + gains.ki * x[2] - gains.kd * stiffness * x[1]) + u[0]
        gain, torque = _accelerated(truth, axis, x[0], drive, u)
        return [x[1], gain, error, *follow(drive)], [torque, estimate]

    return flow, 3 if setting.observer == "ideal" else 6


_Observed = tuple[float, Callable[[float], list[float]]]


def _ideal(x: Floats, gains: PidffGains, J: float, true: float) -> _Observed:
    return true, lambda drive: []


def _pid_observer(x: Floats, gains: PidffGains, J: float, true: float) -> _Observed:
    """J s^2 theta^ = k_t i + C (theta - theta^), estimate -C (theta - theta^): Wang (9), corrected."""
    angle, speed = x[0] - x[3], x[1] - x[4]
    pull = gains.obs_kp * angle + x[5] + gains.obs_kd * speed
    return -pull, lambda drive: [x[4], (drive + pull) / J, gains.obs_ki * angle]


def _state_observer(x: Floats, gains: PidffGains, J: float, true: float) -> _Observed:
    """Observer with a constant load torque as its third state."""
    e = x[0] - x[3]
    return x[5], lambda drive: [
        x[4] + gains.obs_kd / J * e,
        (drive - x[5] + gains.obs_kp * e) / J,
        -gains.obs_ki * e,
    ]


_OBSERVERS: dict[str, Callable[[Floats, PidffGains, float, float], _Observed]] = {
    "ideal": _ideal,
    "pid": _pid_observer,
    "state": _state_observer,
}


def _lqg(setting: Setting, truth: TorqueAxis, gains: Gains) -> tuple[_Flow, int]:
    """States: angle and speed, and the four of the Kalman filter."""
    assert isinstance(gains, LqgGains)
    A, B = gains.model(setting.axis)
    L, (first, second) = gains.kalman_continuous(setting.axis), gains.feedback(setting.axis)
    stiffness = setting.axis.contact_angular_stiffness

    def flow(x: Floats, u: Floats) -> tuple[list[float], list[float]]:
        known = x[2:]
        estimate = stiffness * known[0] + known[2]
        drive = u[0] - first / stiffness * (estimate - u[0]) - second * (known[1] + known[3] / stiffness)
        gain, torque = _accelerated(truth, setting.axis, x[0], drive, u)
        return [x[1], gain, *(A @ known + B * drive + L * (x[0] - known[0]))], [torque, estimate]

    return flow, 6
