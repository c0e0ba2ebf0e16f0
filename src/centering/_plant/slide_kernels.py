"""Compiled core of the slide and the spindle of a centering machine: motion in pieces with a closed form each.

State and settings are float64 arrays, changed in place; serial. Lengths are mm, times s, angles rad, forces N. ``slide`` counts
away from the axis, speeds of the slide toward it. Between two pieces something changes: a segment of a profile ends, the drive
leaves its greatest acceleration, the spindle has reached its speed, a profile begins.
"""

import numpy as np

from sdpgrind.base.compiled import compiled

# State. SEGMENT: row of the profile that runs, -1: none; GONE: time in it; ARMED: a profile waits for the angle START. RUN_IN: by
# how much the slide is faster than the profile that it has not joined yet.
TIME, ANGLE, SPEED, SPEED_SET = range(4)
REFERENCE, VELOCITY, ACCELERATION, VELOCITY_SET, LAG, SEGMENT, GONE, ARMED, START = range(4, 13)
# The ring on the table (x, y of the table) and how it moves over it, SPIN: of its rim by its turning over the table, mm/s; force
# of the contact now, greatest since the last sample and of all; what happened.
X, Y, SPEED_X, SPEED_Y, MOVING, TOUCHED, TOUCHES = range(13, 20)
FORCE, PEAK, PEAK_EVER, SLIPPED, PUSHES, COLLISIONS, RUN_IN, SPIN, STATES = range(20, 29)

# Settings of slide and spindle, then of the ring and the push under way. RADIUS: of the rim where the tip is, ROUND: the mean.
SPEED_MAX, ACCELERATION_MAX, LOOP, DAMPING, LAG_TIME, SPINDLE_ACCELERATION = range(6)
INERTIA, STIFFNESS, CONTACT_DAMPING, BREAKAWAY, COULOMB, VISCOUS, RADIUS, FRICTION, AIM, STOP, STEP, HELD = (
    range(6, 18)
)
ROUND, SETTINGS = range(18, 20)

_SAME = 1e-12  # mm/s, mm/s^2, chosen: nothing is left of a transient
_ROUNDING = 1e-9  # chosen
_JOINED = 1e-9  # mm/s, chosen: so close to the speed of a profile is at it
_MOST = 80  # chosen


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
    """Whether a drive at its greatest acceleration begins to take it back, and the speed at which it does."""
    turn = target - 2.0 * cell[DAMPING] * acceleration / cell[LOOP]
    return (velocity - turn) * acceleration >= -_ROUNDING * cell[ACCELERATION_MAX] * abs(acceleration), turn


@compiled
def _until_full(cell, velocity, acceleration, target, longest):
    """Time in which the linear loop comes to the greatest acceleration; `longest` where it does not."""
    most, natural, damping = cell[ACCELERATION_MAX], cell[LOOP], cell[DAMPING]
    sigma, damped = natural * damping, natural * np.sqrt(1.0 - damping * damping)
    jerk = -2.0 * sigma * acceleration - natural * natural * (velocity - target)
    if jerk == 0.0:
        return longest
    # a = e^{-sigma t}(p cos + q sin) is stationary where tan(damped t) = (damped q - sigma p)/(damped p + sigma q)
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
    """Whether the drive is at its greatest acceleration and stays there for now."""
    if abs(state[ACCELERATION]) < cell[ACCELERATION_MAX] * (1.0 - _ROUNDING):
        return False
    return not _leaves(cell, state[VELOCITY], state[ACCELERATION], state[VELOCITY_SET])[0]


@compiled
def piece_length(state, cell, profile, longest):
    """How long the motion that is under way has one closed form, s; at most `longest`."""
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
    """Angular acceleration of the spindle now, rad/s^2."""
    if state[SPEED] == state[SPEED_SET]:
        return 0.0
    return cell[SPINDLE_ACCELERATION] if state[SPEED_SET] > state[SPEED] else -cell[SPINDLE_ACCELERATION]


@compiled
def time_to(state, cell, angle):
    """Time until the spindle is at an angle, while it goes on as now; 0 where it is past it, inf where it never is."""
    ahead, speed, rate = angle - state[ANGLE], state[SPEED], spindle_rate(state, cell)
    if ahead <= 0.0:
        return 0.0
    square = speed * speed + 2.0 * rate * ahead
    if square < 0.0 or (speed <= 0.0 and rate <= 0.0):
        return np.inf
    return 2.0 * ahead / (speed + np.sqrt(square))


@compiled
def begin_segment(state, profile, row):
    """A row of the profile runs from now on; the slide has the speed that it has."""
    state[SEGMENT], state[GONE] = float(row), 0.0
    off = state[VELOCITY] - profile[row, 1]
    state[RUN_IN] = off if abs(off) > _JOINED else 0.0


@compiled
def _of_profile(state, cell, profile):
    """Speed and acceleration of the slide now, in a profile; what it is off its speed goes as fast as the drive can."""
    row = int(state[SEGMENT])
    rate = profile[row, 2]
    speed = profile[row, 1] + rate * state[GONE] + state[RUN_IN]
    if state[RUN_IN] != 0.0:
        rate = -np.copysign(cell[ACCELERATION_MAX], state[RUN_IN])
    return speed, rate


@compiled
def tip_at(state, cell, profile, time):
    """Where the pusher tip is (mm from the axis) and its speed toward the axis, within the piece that is under way.

    In a profile that has touched, the loaded slide follows late: e' = v - e/tau of the lag e.
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
    """Let slide and spindle go on by a time within the piece that is under way."""
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
