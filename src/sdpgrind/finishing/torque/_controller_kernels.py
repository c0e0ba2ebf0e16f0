"""One sample of each kind of torque controller: reading in, current out."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.finishing.torque import _states as at


@compiled(error_model="numpy")
def controller_step(law, state, motor_angle, path_time, time, torque, true_torque, true_speed):
    """Return the current (A) of a sample with the reference along a motion.

    Parameters
    ----------
    law, state : array
        Parameters and state from `TorqueController.law`; the state is updated.
    motor_angle : float
        Reading of the encoder, rad; NaN: none.
    path_time : float
        Time of the motion played so far, s.
    time, torque : array, (m,)
        Reference along the motion: s, rising, and N m, with the known load torque.
    true_torque, true_speed : float
        True contact torque (N m) and speed (rad/s), for the "ideal" observer only.
    """
    known, s = law.view(at.LAW)[0], state.view(at.CONTROLLER)[0]
    return _controller_step(known, s, motor_angle, path_time, time, torque, true_torque, true_speed)


@compiled(error_model="numpy")
def command_step(law, state, motor_angle, path_time, time, torque):
    """Return all that a controller commands in a sample: current (A), feed override, start of the motion.

    Arguments are those of `controller_step`. Override and start are 0 or 1; the motion starts with the first
    sample, and waits there until the override is 1.
    """
    known, s = law.view(at.LAW)[0], state.view(at.CONTROLLER)[0]
    current = _controller_step(known, s, motor_angle, path_time, time, torque, 0.0, 0.0)
    return current, _feed_override(known, s), 1.0 if s.count == 1.0 else 0.0


@compiled(error_model="numpy")
def _controller_step(law, s, motor_angle, path_time, time, torque, true_torque, true_speed):
    """`controller_step` on records; loops view law and state once and call this."""
    return _sample(law, s, motor_angle, _torque_at(time, torque, path_time, s), true_torque, true_speed)


@compiled(error_model="numpy")
def feed_override(law, state):
    """Return 1.0 once the contact has settled, else 0.0."""
    return _feed_override(law.view(at.LAW)[0], state.view(at.CONTROLLER)[0])


@compiled(error_model="numpy")
def _feed_override(law, s):
    return 1.0 if s.count > law.settle_steps else 0.0


@compiled(error_model="numpy")
def torque_at(time, torque, path_time, state):
    """Return the torque reference (N m) at a time of the motion (s): linear inside it, constant beyond.

    Parameters
    ----------
    time, torque : array, (m,)
        s, rising (of a time given twice the later value counts from there on), and N m.
    path_time : float
        s; NaN: that of the last sample.
    state : array
        State of a controller, with the current place.
    """
    return _torque_at(time, torque, path_time, state.view(at.CONTROLLER)[0])


@compiled(error_model="numpy")
def _torque_at(time, torque, path_time, s):
    if np.isnan(path_time):
        path_time = s.path_time
    s.path_time = path_time
    k, last = int(s.index), time.size - 1
    while k > 0 and time[k] > path_time:  # at most time.size
        k -= 1
    while k < last and time[k + 1] <= path_time:  # at most time.size
        k += 1
    s.index = k
    if k == last or path_time <= time[k]:
        return torque[k]
    return torque[k] + (torque[k + 1] - torque[k]) * ((path_time - time[k]) / (time[k + 1] - time[k]))


@compiled(error_model="numpy")
def controller_sample(law, state, motor_angle, torque_ref, true_torque, true_speed):
    """Return the current (A), quantised and clipped, of a sample with a torque reference.

    Parameters
    ----------
    law, state : array
        Parameters and state from `TorqueController.law`; the state is updated.
    motor_angle : float
        Reading of the encoder, rad; NaN: none, the motor is extrapolated.
    torque_ref : float
        Torque reference T*, with the known load torque, N m.
    true_torque, true_speed : float
        True contact torque (N m) and speed (rad/s), for the "ideal" observer only.
    """
    return _sample(
        law.view(at.LAW)[0], state.view(at.CONTROLLER)[0], motor_angle, torque_ref, true_torque, true_speed
    )


@compiled(error_model="numpy")
def _sample(law, s, motor_angle, torque_ref, true_torque, true_speed):
    """`controller_sample` on records."""
    step = law.sample_time
    s.count += 1.0
    s.reference = torque_ref
    if s.seen == 0.0:
        _begin(law, s, motor_angle)
    if not np.isfinite(motor_angle):
        motor_angle = s.reading + step * s.motion_speed
    s.motion_speed = (motor_angle - s.reading) / step
    s.reading = motor_angle
    if s.seen == 0.0:  # what is not known cannot be fed back
        current = _limited(law, torque_ref)
    elif law.kind == at.PIDFF:
        current = _pidff(law, s, true_torque, true_speed)
    elif law.kind == at.LQG:
        current = _lqg(law, s)
    elif law.kind == at.DAMPED:
        current = _damped(law, s)
    else:
        current = _limited(law, torque_ref)
        s.estimate = law.motor_constant * current
    s.current = current
    return current


@compiled(error_model="numpy")
def _begin(law, s, motor_angle):
    """Start the observer at the first reading, whatever the zero of the encoder, without contact."""
    if np.isfinite(motor_angle):
        s.seen = 1.0
        s.reading = s.obs_angle = motor_angle
        if law.kind == at.LQG:
            s.obs_torque = -law.stiffness * motor_angle


@compiled(error_model="numpy")
def _limited(law, torque):
    """Current (A) of a torque (N m), in steps of the converter and within the limit."""
    current = torque / law.motor_constant
    most = law.current_max
    if law.current_step > 0.0:
        current = law.current_step * np.floor(current / law.current_step + 0.5)
        most = law.current_step * np.floor(most / law.current_step + 1e-9)
    return min(max(current, -most), most)


@compiled(error_model="numpy")
def _pidff(law, s, true_torque, true_speed):
    """PID on the torque error, derivative by k_e omega, feedforward of the reference: Wang (6)."""
    torque, speed = true_torque, true_speed
    pull = 0.0
    if law.observer != at.IDEAL:
        pull = _observed(law, s)
        torque, speed = s.estimate, s.motion_speed
    s.estimate = torque
    wanted = s.reference
    if law.prefilter < 1.0:
        s.filtered += (1.0 - law.prefilter) * (wanted - s.filtered)
        wanted = s.filtered
    error = wanted - torque
    scale = law.inertia / law.stiffness
    integral = s.integral + law.sample_time * error
    feedback = law.kp * error - law.kd * law.stiffness * speed
    asked = scale * (feedback + law.ki * integral) + wanted
    if abs(asked) <= law.motor_constant * law.current_max or asked * error < 0.0:
        s.integral = integral  # else it would wind up against the limit
    current = _limited(law, asked)
    if law.observer != at.IDEAL:
        _foresee(law, s, current, pull)
    return current


@compiled(error_model="numpy")
def _observed(law, s):
    """Estimate the torque, and return the correction of the observer's motor, N m: Wang (9), corrected."""
    error = s.reading - s.obs_angle
    if law.observer == at.PID_OBSERVER:
        s.obs_torque += law.sample_time * law.obs_ki * error
        pull = law.obs_kp * error + s.obs_torque + law.obs_kd * (s.motion_speed - s.obs_speed)
        s.estimate = -pull
        return pull
    s.estimate = s.obs_torque
    return error


@compiled(error_model="numpy")
def _foresee(law, s, current, pull):
    """Advance the observer by the actual current."""
    step, inertia = law.sample_time, law.inertia
    drive = law.motor_constant * current
    if law.observer == at.PID_OBSERVER:
        gain = (drive + pull) / inertia
        s.obs_angle += step * (s.obs_speed + 0.5 * step * gain)
        s.obs_speed += step * gain
        return
    gain = (drive - s.obs_torque + law.obs_kp * pull) / inertia
    s.obs_angle += step * (s.obs_speed + 0.5 * step * gain + law.obs_kd / inertia * pull)
    s.obs_speed += step * gain
    s.obs_torque -= step * law.obs_ki * pull


@compiled(error_model="numpy")
def _damped(law, s):
    """Reference less damping by the high-passed speed."""
    speed = s.motion_speed
    s.slow_speed += (1.0 - law.speed_pole) * (speed - s.slow_speed)
    current = _limited(law, s.reference - law.speed_gain * (speed - s.slow_speed))
    s.estimate = law.motor_constant * current
    return current


@compiled(error_model="numpy")
def _lqg(law, s):
    """Kalman filter over angle, speed, contact torque less k_e theta, and its rate; then state feedback."""
    error = s.reading - s.obs_angle
    angle = s.obs_angle + law.gain[0] * error
    speed = s.obs_speed + law.gain[1] * error
    offset = s.obs_torque + law.gain[2] * error
    rate = s.obs_rate + law.gain[3] * error
    torque = law.stiffness * angle + offset
    s.estimate = torque
    push = law.feedback_torque / law.stiffness * (torque - s.reference)
    current = _limited(law, s.reference - push - law.feedback_speed * (speed + rate / law.stiffness))
    drive = law.motor_constant * current
    s.obs_angle = _ahead(law, 0, angle, speed, offset, rate, drive)
    s.obs_speed = _ahead(law, 1, angle, speed, offset, rate, drive)
    s.obs_torque = _ahead(law, 2, angle, speed, offset, rate, drive)
    s.obs_rate = _ahead(law, 3, angle, speed, offset, rate, drive)
    return current


@compiled(error_model="numpy")
def _ahead(law, i, angle, speed, offset, rate, drive):
    """Prediction of one state of the filter over a sample."""
    row = 4 * i
    free = (
        law.matrix[row] * angle
        + law.matrix[row + 1] * speed
        + law.matrix[row + 2] * offset
        + law.matrix[row + 3] * rate
    )
    return free + law.input[i] * drive


@compiled(error_model="numpy")
def exported_hold(state, law, time, torque, motor_angle, out):
    """Take one sample without a motion; `out`: current (A)."""
    out[0] = controller_step(law, state, motor_angle, np.nan, time, torque, 0.0, 0.0)
    return 0


@compiled(error_model="numpy")
def exported_step(state, law, time, torque, motor_angle, path_time, out):
    """Take one sample along a motion; `out`: current (A), feed override, whether the motion is to begin."""
    out[0] = controller_step(law, state, motor_angle, path_time, time, torque, 0.0, 0.0)
    out[1] = feed_override(law, state)
    out[2] = 1.0 if state.view(at.CONTROLLER)[0].count == 1.0 else 0.0
    return 0
