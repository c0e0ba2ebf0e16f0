"""Named states and parameters of the kernels of the torque axis, with units."""

from sdpgrind.base.states import record

AXIS = record("inertia kg m^2, stiffness N m/rad, torque_constant N m/A, tick s")
"""Parameters of the axis: J, k_e, k_t, length of a tick."""
MOTOR = record("angle rad, speed rad/s, mean_torque N m")
"""State of the axis; the mean contact torque is that of the last tick."""

CONSTANT, PIDFF, DAMPED, LQG = range(4)
"""Kinds of controllers."""
IDEAL, PID_OBSERVER, STATE_OBSERVER = range(3)
"""Sources of the contact torque of PIDFF."""

LAW = record(
    "kind 1, observer 1, sample_time s, motor_constant N m/A, current_max A, current_step A, settle_steps 1, "
    "inertia kg m^2, stiffness N m/rad, kp 1/s^2, ki 1/s^3, kd 1/s, "
    "obs_kp N m/rad, obs_ki N m/(rad s), obs_kd N m s/rad, prefilter 1, "
    "speed_gain N m s/rad, speed_pole 1, feedback_torque N m/rad, feedback_speed N m s/rad, "
    "gain[4] rad s N m, input[4] rad s N m, matrix[16] rad s N m"
)
"""Parameters of a controller; gain, input, matrix (by rows): LQG's filter of angle, speed, offset, rate."""

CONTROLLER = record(
    "count 1, current A, reading rad, motion_speed rad/s, estimate N m, integral N m s, "
    "obs_angle rad, obs_speed rad/s, obs_torque N m, obs_rate N m/s, filtered N m, slow_speed rad/s, "
    "index 1, path_time s, reference N m, seen 1"
)
"""State of a controller: number of samples, current, last reading and its speed, estimated torque, integral
of its error; angle, speed, torque, rate of the observer; filtered reference, low-passed speed; leg and time
of the reference, torque reference, whether there was a reading.
"""
