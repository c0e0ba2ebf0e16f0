"""Slide and spindle of a centering machine: motion in pieces with a closed form each.

State and settings are float64 arrays, changed in place. Lengths in mm, times in s, angles in rad, forces in
N. Positions of the slide are from the axis outwards, its speeds towards the axis. A piece ends when a segment
of a profile ends, the drive leaves its maximum acceleration, the spindle reaches its speed, or a profile
begins.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# state; SEGMENT: running row of the profile, -1: none; GONE: time in it; ARMED: a profile waits for the angle
# START; RUN_IN: speed of the slide minus that of the profile
TIME, ANGLE, SPEED, SPEED_SET = range(4)
REFERENCE, VELOCITY, ACCELERATION, VELOCITY_SET, LAG, SEGMENT, GONE, ARMED, START = range(4, 13)
# the ring on the table; SPIN: speed of its rim by its spin, mm/s; contact force, PEAK since the last sample
# and PEAK_EVER; events
X, Y, SPEED_X, SPEED_Y, MOVING, TOUCHED, TOUCHES = range(13, 20)
FORCE, PEAK, PEAK_EVER, SLIPPED, PUSHES, COLLISIONS, RUN_IN, SPIN, STATES = range(20, 29)

# settings of slide and spindle, then of ring and push; RADIUS: of the rim at the tip, ROUND: mean
SPEED_MAX, ACCELERATION_MAX, LOOP, DAMPING, LAG_TIME, SPINDLE_ACCELERATION = range(6)
INERTIA, STIFFNESS, CONTACT_DAMPING, BREAKAWAY, COULOMB, VISCOUS, RADIUS, FRICTION, AIM, STOP, STEP, HELD = (
    range(6, 18)
)
ROUND, SETTINGS = range(18, 20)

_SAME = 1e-12  # mm/s, mm/s^2; chosen: the transient has ended
_ROUNDING = 1e-9  # relative; chosen: above the rounding of limits
_JOINED = 1e-9  # mm/s; chosen: above the rounding of speeds
_MOST = 80  # chosen: bisection to rounding


@compiled
def loop_at(cell, velocity, acceleration, target, time):
    """Travel, speed and acceleration of the velocity loop (second order) after a time in its linear range."""
    natural, damping = cell[LOOP], cell[DAMPING]
    sigma = natural * damping
    damped = natural * np.sqrt(1.0 - damping * damping)
    error = velocity - target
    decay = np.exp(-sigma * time)
    cosine, sine = np.cos(damped * time), np.sin(damped * time)
    then = decay * (error * cosine + (acceleration + sigma * error) / damped * sine)
    jerk = -2.0 * sigma * acceleration - natural * natural * error
    there = decay * (acceleration * cosine + (jerk + sigma * acceleration) / damped * sine)
    travel = target * time - ((there - acceleration) + 2.0 * sigma * (then - error)) / (natural * natural)
    return travel, target + then, there


@compiled
def _leaves(cell, velocity, acceleration, target):
    """Whether a drive at its maximum acceleration begins to reduce it, and the speed at which it does."""
    turn = target - 2.0 * cell[DAMPING] * acceleration / cell[LOOP]
    return (velocity - turn) * acceleration >= -_ROUNDING * cell[ACCELERATION_MAX] * abs(acceleration), turn


@compiled
def _until_full(cell, velocity, acceleration, target, longest):
    """Time until the linear loop reaches the maximum acceleration; `longest` where it does not."""
    most, natural, damping = cell[ACCELERATION_MAX], cell[LOOP], cell[DAMPING]
    sigma, damped = natural * damping, natural * np.sqrt(1.0 - damping * damping)
    jerk = -2.0 * sigma * acceleration - natural * natural * (velocity - target)
    if jerk == 0.0:
        return longest
    # a = e^{-sigma t}(p cos + q sin) has extrema at tan(damped t) = (damped q - sigma p)/(damped p + sigma q)
    q = (jerk + sigma * acceleration) / damped
    high = np.arctan2(damped * q - sigma * acceleration, damped * acceleration + sigma * q) / damped
    if high <= 0.0:
        high += np.pi / damped
    high = min(high, longest)
    _, _, there = loop_at(cell, velocity, acceleration, target, high)
    if abs(there) <= most * (1.0 + _ROUNDING):
        return longest
    low = 0.0
    for _ in range(_MOST):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        _, _, there = loop_at(cell, velocity, acceleration, target, middle)
        if abs(there) <= most:
            low = middle
        else:
            high = middle
    return high


@compiled
def is_full(state, cell):
    """Whether the drive is and stays at its maximum acceleration."""
    if abs(state[ACCELERATION]) < cell[ACCELERATION_MAX] * (1.0 - _ROUNDING):
        return False
    return not _leaves(cell, state[VELOCITY], state[ACCELERATION], state[VELOCITY_SET])[0]


@compiled
def piece_length(state, cell, profile, longest):
    """Time during which the current motion has one closed form, s; at most `longest`."""
    if state[SPEED] != state[SPEED_SET]:
        longest = min(longest, abs(state[SPEED_SET] - state[SPEED]) / cell[SPINDLE_ACCELERATION])
    if state[ARMED] != 0.0:
        longest = min(longest, time_to(state, cell, state[START]))
    if state[SEGMENT] >= 0.0:
        longest = min(longest, max(profile[int(state[SEGMENT]), 0] - state[GONE], 0.0))
        if state[RUN_IN] == 0.0:
            return longest
        closing = cell[ACCELERATION_MAX] + np.sign(state[RUN_IN]) * profile[int(state[SEGMENT]), 2]
        return min(longest, abs(state[RUN_IN]) / closing) if closing > 0.0 else longest
    velocity, acceleration, target = state[VELOCITY], state[ACCELERATION], state[VELOCITY_SET]
    if is_full(state, cell):
        return min(longest, (_leaves(cell, velocity, acceleration, target)[1] - velocity) / acceleration)
    return _until_full(cell, velocity, acceleration, target, longest)


@compiled
def spindle_rate(state, cell):
    """Angular acceleration of the spindle, rad/s^2."""
    if state[SPEED] == state[SPEED_SET]:
        return 0.0
    return cell[SPINDLE_ACCELERATION] if state[SPEED_SET] > state[SPEED] else -cell[SPINDLE_ACCELERATION]


@compiled
def time_to(state, cell, angle):
    """Time until the spindle reaches an angle in its current motion; 0: passed, inf: never."""
    ahead, speed, rate = angle - state[ANGLE], state[SPEED], spindle_rate(state, cell)
    if ahead <= 0.0:
        return 0.0
    square = speed * speed + 2.0 * rate * ahead
    if square < 0.0 or (speed <= 0.0 and rate <= 0.0):
        return np.inf
    return 2.0 * ahead / (speed + np.sqrt(square))


@compiled
def begin_segment(state, profile, row):
    """Begin a row of the profile at the present speed of the slide."""
    state[SEGMENT], state[GONE] = float(row), 0.0
    off = state[VELOCITY] - profile[row, 1]
    state[RUN_IN] = off if abs(off) > _JOINED else 0.0


@compiled
def _of_profile(state, cell, profile):
    """Speed and acceleration of the slide in a profile; speed differences go at maximum acceleration."""
    row = int(state[SEGMENT])
    rate = profile[row, 2]
    speed = profile[row, 1] + rate * state[GONE] + state[RUN_IN]
    if state[RUN_IN] != 0.0:
        rate = -np.copysign(cell[ACCELERATION_MAX], state[RUN_IN])
    return speed, rate


@compiled
def tip_at(state, cell, profile, time):
    """Position of the pusher tip (mm from the axis) and its speed towards the axis, within the current piece.

    After the first touch in a profile the loaded slide lags by e: e' = v - e/tau.
    """
    if state[SEGMENT] >= 0.0:
        speed, rate = _of_profile(state, cell, profile)
        travel, velocity = (speed + 0.5 * rate * time) * time, speed + rate * time
    elif is_full(state, cell):
        rate, speed = state[ACCELERATION], state[VELOCITY]
        travel, velocity = (speed + 0.5 * rate * time) * time, speed + rate * time
    else:
        rate, speed = 0.0, 0.0
        travel, velocity, _ = loop_at(cell, state[VELOCITY], state[ACCELERATION], state[VELOCITY_SET], time)
    lag, tau = 0.0, cell[LAG_TIME]
    if tau > 0.0:
        loaded = state[SEGMENT] >= 0.0 and state[TOUCHED] != 0.0
        steady = tau * (speed - rate * tau) if loaded else 0.0
        grows = rate * tau if loaded else 0.0
        left = (state[LAG] - steady) * np.exp(-time / tau)
        lag = steady + grows * time + left
        velocity -= grows - left / tau
    return state[REFERENCE] - travel + lag + cell[STOP], velocity


@compiled
def commit(state, cell, profile, time):
    """Advance slide and spindle by a time within the current piece."""
    place, _ = tip_at(state, cell, profile, time)
    rate, full = spindle_rate(state, cell), is_full(state, cell)
    if state[SEGMENT] >= 0.0:
        speed, along = _of_profile(state, cell, profile)
        travel = (speed + 0.5 * along * time) * time
        state[VELOCITY], state[ACCELERATION] = speed + along * time, along
        state[GONE] += time
        if state[RUN_IN] != 0.0:
            state[RUN_IN] += (along - profile[int(state[SEGMENT]), 2]) * time
            if abs(state[RUN_IN]) <= _JOINED:
                state[RUN_IN] = 0.0
    elif full:
        travel = (state[VELOCITY] + 0.5 * state[ACCELERATION] * time) * time
        state[VELOCITY] += state[ACCELERATION] * time
    else:
        velocity, acceleration, target = state[VELOCITY], state[ACCELERATION], state[VELOCITY_SET]
        travel, state[VELOCITY], state[ACCELERATION] = loop_at(cell, velocity, acceleration, target, time)
        if abs(state[VELOCITY] - target) < _SAME and abs(state[ACCELERATION]) < _SAME:
            state[VELOCITY], state[ACCELERATION] = target, 0.0
    state[REFERENCE] -= travel
    state[LAG] = place - cell[STOP] - state[REFERENCE] if cell[LAG_TIME] > 0.0 else 0.0
    state[ANGLE] += (state[SPEED] + 0.5 * rate * time) * time
    speed = state[SPEED] + rate * time
    arrived = (
        (state[SPEED_SET] - speed) * rate <= _ROUNDING * cell[SPINDLE_ACCELERATION] if rate != 0.0 else False
    )
    state[SPEED] = state[SPEED_SET] if arrived else speed
    state[TIME] += time
