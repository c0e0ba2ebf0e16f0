"""Exact motion of the torque axis over a tick: oscillation in contact, free flight, touches and lifts."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.finishing.torque._states import AXIS, MOTOR

_EVENTS = 100  # chosen: touches and lifts in a piece of a tick; a contact lasts half a period


@compiled
def encoder_reading(angle, resolution):
    """Angle (rad) shown by an encoder of a resolution (rad); resolution 0: the angle itself."""
    if resolution <= 0.0:
        return angle
    return resolution * np.floor(angle / resolution + 0.5)


@compiled
def axis_tick(state, current, load_torque, surface, next_surface, axis):
    """Advance the axis exactly over a tick and return the contact torque at its end, N m.

    J theta'' = k_t i - T_f - T_L, Wang (3) corrected, with T_f = max(0, k_e (theta - theta_s)).

    Parameters
    ----------
    state : array, (STATES,)
        State of the axis, a row of `MOTOR`; receives the mean contact torque of the tick (N m).
    current, load_torque : float
        Constant over the tick, A and N m.
    surface, next_surface : float
        Angle of first touch at the start and the end of the tick, rad; linear in between.
    axis : array, (4,)
        J (kg m^2), k_e (N m/rad), k_t (N m/A) and length of a tick (s): a row of `AXIS`.
    """
    return _axis_tick(axis.view(AXIS)[0], state.view(MOTOR)[0], current, load_torque, surface, next_surface)


@compiled
def _axis_tick(axis, motor, current, load_torque, surface, next_surface):
    """Advance the axis over a tick; loops view axis and state once and call this."""
    inertia, stiffness, tick = axis.inertia, axis.stiffness, axis.tick
    drive = axis.torque_constant * current - load_torque
    slope = (next_surface - surface) / tick
    frequency = np.sqrt(stiffness / inertia)
    pieces = int(np.ceil(frequency * tick))  # of less than 1 rad each, far from half a period
    gap, speed = motor.angle - surface, motor.speed - slope
    for _ in range(pieces):
        gap, speed = _piece(gap, speed, tick / pieces, drive / inertia, drive / stiffness, frequency)
    before = motor.speed
    motor.angle, motor.speed = next_surface + gap, speed + slope
    motor.mean_torque = drive - inertia * (motor.speed - before) / tick
    return stiffness * max(gap, 0.0)


@compiled
def _piece(gap, speed, left, push, depth, frequency):
    """Gap (rad, positive in contact) and speed after `left` s, over touches and lifts.

    `push` (rad/s^2) acts in flight; `depth` is the gap at rest (rad).
    """
    for _ in range(_EVENTS):
        if gap > 0.0 or (gap == 0.0 and (speed > 0.0 or (speed == 0.0 and push > 0.0))):
            gap, speed, left = _in_contact(gap, speed, left, depth, frequency)
        else:
            gap, speed, left = _in_flight(gap, speed, left, push)
        if left <= 0.0:
            break
    return gap, speed


@compiled
def _first(a, b, c):
    """First x > 0 at which a x^2 + 2 b x + c, with c >= 0, turns negative; inf: never."""
    root = b * b - a * c
    if b < 0.0:
        return c / (np.sqrt(root) - b) if root >= 0.0 else np.inf
    return (b + np.sqrt(root)) / -a if a < 0.0 else np.inf


@compiled
def _in_contact(gap, speed, left, depth, frequency):
    """Oscillate about the depth at rest to end or lift-off: a quadratic in the tangent of half a phase."""
    rate = speed / frequency
    c, s = np.cos(0.5 * frequency * left), np.sin(0.5 * frequency * left)
    half = _first(2.0 * depth - gap, rate, gap)
    if half > s / c:
        rise, turn = 2.0 * s * s, 2.0 * s * c  # 1 - cos and sin of the phase, exact for small phases
        ahead = depth - gap
        return gap + ahead * rise + rate * turn, speed - speed * rise + frequency * ahead * turn, 0.0
    c = 1.0 / (1.0 + half * half)
    rise, turn = 2.0 * half * half * c, 2.0 * half * c
    lifting = speed - speed * rise + frequency * (depth - gap) * turn
    return 0.0, min(lifting, 0.0), left - 2.0 * np.arctan(half) / frequency


@compiled
def _in_flight(gap, speed, left, push):
    """Fly to the end or to the next touch."""
    time = _first(-0.5 * push, -0.5 * speed, -gap)
    if time > left:
        return gap + left * (speed + 0.5 * push * left), speed + push * left, 0.0
    return 0.0, max(speed + push * time, 0.0), left - time
