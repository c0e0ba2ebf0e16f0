"""One sample of each kind of torque controller: reading in, current out."""

import numpy as np

from sdpgrind.base.compiled import compiled
from sdpgrind.finishing.torque import _slots as at


@compiled
def controller_step(law, state, motor_angle, path_time, time, torque, true_torque, true_speed):
    """Take a sample of a controller whose reference depends on how far the motion has been played; return the current, A.

    Parameters
    ----------
    law, state : array
        Parameters and state, as `TorqueController.law` gives them; the state is changed.
    motor_angle : float
        Reading of the encoder, rad; NaN: none.
    path_time : float
        How far the motion has been played, s.
    time, torque : array, (m,)
        Reference along the motion: s, rising, and N m, with the load torque that is known.
    true_torque, true_speed : float
        True contact torque (N m) and speed (rad/s), for the law that is given both; others do not look.
    """
    return controller_sample(law, state, motor_angle, torque_at(time, torque, path_time, state), true_torque, true_speed)


@compiled
def feed_override(law, state):
    """Return 1.0 when so many samples have been taken that the contact has settled, else 0.0: dimensionless."""
    return 1.0 if state[at.COUNT] > law[at.SETTLE_STEPS] else 0.0


@compiled
def torque_at(time, torque, path_time, state):
    """Return the torque reference (N m) at a time of the motion (s): straight between its times, held beyond.

    Parameters
    ----------
    time, torque : array, (m,)
        s, rising (where one is given twice, the later value counts from there on), and N m.
    path_time : float
        s; NaN: that of the sample before.
    state : array
        State of a controller, which remembers the place.
    """
    if np.isnan(path_time):
        path_time = state[at.PATH_TIME]
    state[at.PATH_TIME] = path_time
    k, last = int(state[at.INDEX]), time.size - 1
    while k > 0 and time[k] > path_time:
        k -= 1
    while k < last and time[k + 1] <= path_time:
        k += 1
    state[at.INDEX] = k
    if k == last or path_time <= time[k]:
        return torque[k]
    return torque[k] + (torque[k + 1] - torque[k]) * ((path_time - time[k]) / (time[k + 1] - time[k]))


@compiled
def controller_sample(law, state, motor_angle, torque_ref, true_torque, true_speed):
    """Take a sample of a controller and return the current that the motor is given from now on, A: quantised and clipped.

    Parameters
    ----------
    law, state : array
        Parameters and state, as `TorqueController.law` gives them; the state is changed.
    motor_angle : float
        Reading of the encoder, rad; NaN: none, and the motor is taken to have gone on as before.
    torque_ref : float
        Torque reference T*, with the load torque that is known, N m.
    true_torque, true_speed : float
        True contact torque (N m) and speed (rad/s), for the law that is given both; others do not look.
    """
    step = law[at.SAMPLE_TIME]
    state[at.COUNT] += 1.0
    state[at.REFERENCE] = torque_ref
    if state[at.SEEN] == 0.0:
        _begin(law, state, motor_angle)
    if not np.isfinite(motor_angle):
        motor_angle = state[at.READING] + step * state[at.MOTION_SPEED]
    state[at.MOTION_SPEED] = (motor_angle - state[at.READING]) / step
    state[at.READING] = motor_angle
    if state[at.SEEN] == 0.0:  # what is not known cannot be fed back
        current = _limited(law, torque_ref)
    elif law[at.KIND] == at.PIDFF:
        current = _pidff(law, state, true_torque, true_speed)
    elif law[at.KIND] == at.LQG:
        current = _lqg(law, state)
    elif law[at.KIND] == at.DAMPED:
        current = _damped(law, state)
    else:
        current = _limited(law, torque_ref)
        state[at.ESTIMATE] = law[at.MOTOR_CONSTANT] * current
    state[at.CURRENT] = current
    return current


@compiled
def _begin(law, state, motor_angle):
    """Begin the observer where the first reading is, wherever the encoder has its zero; nothing is touched there."""
    if np.isfinite(motor_angle):
        state[at.SEEN] = 1.0
        state[at.READING] = state[at.OBS_ANGLE] = motor_angle
        if law[at.KIND] == at.LQG:
            state[at.OBS_TORQUE] = -law[at.LAW_STIFFNESS] * motor_angle


@compiled
def _limited(law, torque):
    """Current (A) for a torque (N m), in the converter's steps and within the limit."""
    current = torque / law[at.MOTOR_CONSTANT]
    most = law[at.CURRENT_MAX]
    if law[at.CURRENT_STEP] > 0.0:
        current = law[at.CURRENT_STEP] * np.floor(current / law[at.CURRENT_STEP] + 0.5)
        most = law[at.CURRENT_STEP] * np.floor(most / law[at.CURRENT_STEP] + 1e-9)
    return min(max(current, -most), most)


@compiled
def _pidff(law, state, true_torque, true_speed):
    """PID on the torque error, derivative by k_e omega, the reference fed forward: Wang (6)."""
    torque, speed = true_torque, true_speed
    pull = 0.0
    if law[at.OBSERVER] != at.IDEAL:
        pull = _observed(law, state)
        torque, speed = state[at.ESTIMATE], state[at.MOTION_SPEED]
    state[at.ESTIMATE] = torque
    wanted = state[at.REFERENCE]
    if law[at.PREFILTER] < 1.0:
        state[at.FILTERED] += (1.0 - law[at.PREFILTER]) * (wanted - state[at.FILTERED])
        wanted = state[at.FILTERED]
    error = wanted - torque
    scale = law[at.LAW_INERTIA] / law[at.LAW_STIFFNESS]
    integral = state[at.INTEGRAL] + law[at.SAMPLE_TIME] * error
    feedback = law[at.KP] * error - law[at.KD] * law[at.LAW_STIFFNESS] * speed
    asked = scale * (feedback + law[at.KI] * integral) + wanted
    if abs(asked) <= law[at.MOTOR_CONSTANT] * law[at.CURRENT_MAX] or asked * error < 0.0:
        state[at.INTEGRAL] = integral  # else it would wind up against the limit
    current = _limited(law, asked)
    if law[at.OBSERVER] != at.IDEAL:
        _foresee(law, state, current, pull)
    return current


@compiled
def _observed(law, state):
    """Estimate the torque, and return what pulls the observer's motor to the true one, N m: Wang (9), corrected."""
    error = state[at.READING] - state[at.OBS_ANGLE]
    if law[at.OBSERVER] == at.PID_OBSERVER:
        state[at.OBS_TORQUE] += law[at.SAMPLE_TIME] * law[at.OBS_KI] * error
        pull = law[at.OBS_KP] * error + state[at.OBS_TORQUE] + law[at.OBS_KD] * (state[at.MOTION_SPEED] - state[at.OBS_SPEED])
        state[at.ESTIMATE] = -pull
        return pull
    state[at.ESTIMATE] = state[at.OBS_TORQUE]
    return error


@compiled
def _foresee(law, state, current, pull):
    """Advance the observer by the current that is really given."""
    step, inertia = law[at.SAMPLE_TIME], law[at.LAW_INERTIA]
    drive = law[at.MOTOR_CONSTANT] * current
    if law[at.OBSERVER] == at.PID_OBSERVER:
        gain = (drive + pull) / inertia
        state[at.OBS_ANGLE] += step * (state[at.OBS_SPEED] + 0.5 * step * gain)
        state[at.OBS_SPEED] += step * gain
        return
    gain = (drive - state[at.OBS_TORQUE] + law[at.OBS_KP] * pull) / inertia
    state[at.OBS_ANGLE] += step * (state[at.OBS_SPEED] + 0.5 * step * gain + law[at.OBS_KD] / inertia * pull)
    state[at.OBS_SPEED] += step * gain
    state[at.OBS_TORQUE] -= step * law[at.OBS_KI] * pull


@compiled
def _damped(law, state):
    """The reference, less damping by the speed without its slow part."""
    speed = state[at.MOTION_SPEED]
    state[at.SLOW_SPEED] += (1.0 - law[at.SPEED_POLE]) * (speed - state[at.SLOW_SPEED])
    current = _limited(law, state[at.REFERENCE] - law[at.SPEED_GAIN] * (speed - state[at.SLOW_SPEED]))
    state[at.ESTIMATE] = law[at.MOTOR_CONSTANT] * current
    return current


@compiled
def _lqg(law, state):
    """Kalman filter over angle, speed, what the contact lacks of k_e theta, and its rate; then state feedback."""
    error = state[at.READING] - state[at.OBS_ANGLE]
    angle = state[at.OBS_ANGLE] + law[at.LQG_GAIN] * error
    speed = state[at.OBS_SPEED] + law[at.LQG_GAIN + 1] * error
    offset = state[at.OBS_TORQUE] + law[at.LQG_GAIN + 2] * error
    rate = state[at.OBS_RATE] + law[at.LQG_GAIN + 3] * error
    torque = law[at.LAW_STIFFNESS] * angle + offset
    state[at.ESTIMATE] = torque
    push = law[at.LQG_TORQUE] / law[at.LAW_STIFFNESS] * (torque - state[at.REFERENCE])
    current = _limited(law, state[at.REFERENCE] - push - law[at.LQG_SPEED] * (speed + rate / law[at.LAW_STIFFNESS]))
    drive = law[at.MOTOR_CONSTANT] * current
    for i in range(4):
        row = at.LQG_MATRIX + 4 * i
        state[at.OBS_ANGLE + i] = (
            law[row] * angle + law[row + 1] * speed + law[row + 2] * offset + law[row + 3] * rate + law[at.LQG_INPUT + i] * drive
        )
    return current
