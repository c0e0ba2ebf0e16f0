"""Places in the arrays of the torque axis and of its controllers, as compiled code sees them."""

INERTIA, STIFFNESS, TORQUE_CONSTANT, TICK, AXIS = range(5)
"""Axis: J (kg m^2), k_e (N m/rad), k_t (N m/A), length of a tick (s); and how many they are."""
ANGLE, SPEED, MEAN_TORQUE, STATES = range(4)
"""State of the axis: motor angle (rad), speed (rad/s), mean contact torque of the last tick (N m); and how many they are."""

CONSTANT, PIDFF, DAMPED, LQG = range(4)
"""Kinds of controllers."""
IDEAL, PID_OBSERVER, STATE_OBSERVER = range(3)
"""Where PIDFF has its contact torque from."""

(
    KIND, OBSERVER, SAMPLE_TIME, MOTOR_CONSTANT, CURRENT_MAX, CURRENT_STEP, SETTLE_STEPS, LAW_INERTIA, LAW_STIFFNESS,
    KP, KI, KD, OBS_KP, OBS_KI, OBS_KD, PREFILTER, SPEED_GAIN, SPEED_POLE,
    LQG_TORQUE, LQG_SPEED, LQG_GAIN, LQG_INPUT, LQG_MATRIX,
) = (*range(20), 20, 24, 28)  # fmt: skip
LAW = LQG_MATRIX + 16
"""Parameters of a controller: the last three begin a gain (4), an input (4) and a matrix (4, 4); and how many they are."""

(
    COUNT, CURRENT, READING, MOTION_SPEED, ESTIMATE, INTEGRAL, OBS_ANGLE, OBS_SPEED, OBS_TORQUE, OBS_RATE, FILTERED, SLOW_SPEED,
    INDEX, PATH_TIME, REFERENCE, SEEN, CONTROL,
) = range(17)  # fmt: skip
"""State of a controller: samples taken, current (A), last reading (rad), its speed (rad/s), estimated torque (N m), integral of
the torque error (N m s), the observer's angle, speed, torque and its rate, filtered reference (N m), low-passed speed (rad/s),
leg and time (s) of the reference, torque reference (N m), whether there was a reading; and how many they are."""
