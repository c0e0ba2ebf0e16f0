"""Closed-form motions of tip against part; the first time at which a linear function of one turns negative.

The gap delta between tip and part surface either swings (contact, a linear spring and damper) or flies (no
contact). Events are zeros of functions linear in delta and its rate: f = A delta + B delta' + C + D t.
Between two zeros of f'', known in closed form, f is convex or concave. Where it is convex, Newton's method
from the left never passes the first zero. Where it is concave and positive at its beginning, it has a zero
only if it is negative at its end, and Newton's method from there never passes it. So no crossing is missed,
however short, and no scan is needed.
"""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# chosen: most Newton steps; a simple zero takes about six, a double one halves its error in each
_NEWTON = 100
_SERIES = 0.3  # chosen: below it the difference in (z - 1 + exp(-z)) / z^2 loses digits


@compiled
def _swing(gap, rate, tip_speed, tip_acceleration, parameters):
    """Motion in contact, Mears (5.27): initial gap (mm), its rate and tip speed (mm/s), tip acceleration."""
    mass, k, b, _, coulomb, viscous = parameters
    damping = b + viscous
    trend = viscous * tip_acceleration / k
    rest = (mass * tip_acceleration + coulomb + viscous * tip_speed - damping * trend) / k
    alpha = 0.5 * damping / mass
    square = alpha * alpha - k / mass
    spread = np.sqrt(abs(square))
    rate_of = spread if square < 0.0 else -spread
    slow = alpha if square <= 0.0 else k / mass / (alpha + spread)
    p, p1 = gap - rest, rate - trend
    q = p1 + alpha * p
    return (1.0, rest, trend, p, q, alpha, square, rate_of, slow)


@compiled
def _flight(gap, rate, speed, tip_acceleration, coulomb_acceleration, drag_rate):
    """Motion without contact, or of a part at rest (`speed` and decelerations 0)."""
    return (0.0, gap, rate, speed, tip_acceleration, coulomb_acceleration, drag_rate, 0.0, 0.0)


@compiled
def _basis(t, alpha, rate, slow):
    """Damped cosine, and damped sine over its rate; hyperbolic where `rate` is negative."""
    if rate > 0.0:
        fade = np.exp(-alpha * t)
        return fade * np.cos(rate * t), fade * np.sin(rate * t) / rate
    fade = np.exp(-slow * t)
    if rate == 0.0:
        return fade, fade * t
    lost = -np.expm1(2.0 * rate * t)
    return fade * (1.0 - 0.5 * lost), fade * lost / (-2.0 * rate)


@compiled
def _fading(z):
    """exp(-z), (1 - exp(-z)) / z and (z - 1 + exp(-z)) / z^2, without loss of digits near z = 0."""
    if z == 0.0:
        return 1.0, 1.0, 0.5
    first = -np.expm1(-z) / z
    if z > _SERIES:
        return np.exp(-z), first, (1.0 - first) / z
    total, term = 0.0, 0.5
    for k in range(3, 15):
        total += term
        term *= -z / k
    return 1.0 - z * first, first, total


@compiled
def _gap_at(t, motion):
    """Gap, its rate and its acceleration (mm, mm/s, mm/s^2) at a time t (s) of a motion."""
    if motion[0] == 1.0:
        _, rest, trend, p, q, alpha, square, rate, slow = motion
        c, s = _basis(t, alpha, rate, slow)
        p1, q1 = q - alpha * p, square * p - alpha * q
        p2, q2 = q1 - alpha * p1, square * p1 - alpha * q1
        return rest + trend * t + p * c + q * s, trend + p1 * c + q1 * s, p2 * c + q2 * s
    _, gap, rate, speed, acceleration, coulomb, drag, _, _ = motion
    if speed == 0.0:
        return gap + (rate + 0.5 * acceleration * t) * t, rate + acceleration * t, acceleration
    whole, first, second = _fading(drag * t)
    lost = drag * speed + coulomb  # deceleration at the start
    slowed = lost * t * first
    return (
        gap + (rate + (0.5 * acceleration + lost * second) * t) * t,
        rate + acceleration * t + slowed,
        acceleration + lost * whole,
    )


@compiled
def _first_turn(motion, gain, rate_gain):
    """Whether f is convex at time 0, when f'' first changes sign (s), and the time between changes (s)."""
    if motion[0] == 0.0:
        return _flight_turn(motion, gain, rate_gain)
    _, _, _, p, q, alpha, square, rate, _ = motion
    for _ in range(2):
        p, q = q - alpha * p, square * p - alpha * q
    p, q = gain * p + rate_gain * (q - alpha * p), gain * q + rate_gain * (square * p - alpha * q)
    convex = p > 0.0 or (p == 0.0 and q > 0.0)
    if rate > 0.0:
        phase = np.arctan2(-p * rate, q) if q > 0.0 else np.arctan2(p * rate, -q)
        return convex, (phase if phase > 0.0 else phase + np.pi) / rate, np.pi / rate
    ratio = -p / q if q != 0.0 else -1.0
    if ratio <= 0.0 or -rate * ratio >= 1.0:
        return convex, np.inf, np.inf
    return convex, (np.arctanh(-rate * ratio) / -rate if rate < 0.0 else ratio), np.inf


@compiled
def _flight_turn(motion, gain, rate_gain):
    """`_first_turn` without contact: f'' is monotonic, as the speed of the part is."""
    _, _, _, speed, acceleration, coulomb, drag, _, _ = motion
    lost = coulomb + drag * speed
    constant, fades = gain * acceleration, (gain - rate_gain * drag) * lost
    convex = constant + fades > 0.0
    if drag * speed == 0.0 or constant * fades >= 0.0 or abs(fades) <= abs(constant):
        return convex, np.inf, np.inf
    return convex, np.log(-fades / constant) / drag, np.inf


@compiled
def _later_swing(motion, t):
    """Swing with its time counted from `t` (s) on."""
    kind, rest, trend, p, q, alpha, square, rate, slow = motion
    c, s = _basis(t, alpha, rate, slow)
    now = p * c + q * s
    closing = (q - alpha * p) * c + (square * p - alpha * q) * s
    return (kind, rest + trend * t, trend, now, closing + alpha * now, alpha, square, rate, slow)


@compiled
def _later_flight(motion, t):
    """Flight with its time counted from `t` (s) on."""
    kind, _, _, speed, acceleration, coulomb, drag, _, _ = motion
    gap, rate, _ = _gap_at(t, motion)
    whole, first, _ = _fading(drag * t)
    return (kind, gap, rate, speed * whole - coulomb * t * first, acceleration, coulomb, drag, 0.0, 0.0)


@compiled
def _swing_change(motion):
    """Rate of a swing, as a swing."""
    kind, _, trend, p, q, alpha, square, rate, slow = motion
    return (kind, trend, 0.0, q - alpha * p, square * p - alpha * q, alpha, square, rate, slow)


@compiled
def _swing_bound(motion, gain, rate_gain, duration):
    """Upper bound of f of a swing over a time (s)."""
    line, lean = _line(motion, gain, rate_gain, 0.0, 0.0)
    return max(line, line + lean * duration) + _swinging(motion, gain, rate_gain)[0]


@compiled
def _swinging(motion, gain, rate_gain):
    """Initial amplitude of the oscillation in f and its decay rate (1/s); infinite without one."""
    _, _, _, p, q, alpha, square, rate, _ = motion
    if motion[0] == 0.0 or rate <= 0.0:
        return np.inf, 0.0
    size = np.hypot(
        gain * p + rate_gain * (q - alpha * p), (gain * q + rate_gain * (square * p - alpha * q)) / rate
    )
    return size, alpha


@compiled
def _line(motion, gain, rate_gain, constant, trend):
    """Initial value and slope of the part of f that does not oscillate."""
    if motion[0] == 0.0:
        return 0.0, 0.0
    return gain * motion[1] + rate_gain * motion[2] + constant, gain * motion[2] + trend


@compiled
def _values(t, motion, gain, rate_gain, constant, trend):
    """Value and slope of f at a time."""
    gap, rate, acceleration = _gap_at(t, motion)
    return (
        gain * gap + rate_gain * rate + constant + trend * t,
        gain * rate + rate_gain * acceleration + trend,
    )


@compiled
def _first_negative(motion, gain, rate_gain, constant, trend, value, slope, end):
    """First time (s) up to `end` at which f turns negative, else infinite.

    f = gain delta + rate_gain delta' + constant + trend t, with `value` >= 0 and `slope` at time 0; a value
    of 0 that rises is no zero.
    """
    convex, turn, period = _first_turn(motion, gain, rate_gain)
    size, fade = _swinging(motion, gain, rate_gain)
    line, lean = _line(motion, gain, rate_gain, constant, trend)
    left = 0.0
    while True:
        if min(line + lean * left, line + lean * end) > size * np.exp(-fade * left):
            return np.inf
        stop = min(turn, end)
        if convex:
            found = _from_left(motion, gain, rate_gain, constant, trend, value, slope, left, stop)
            if found < stop or stop == end:
                return found
        value, slope = _values(stop, motion, gain, rate_gain, constant, trend)
        if not convex and value < 0.0:
            return _from_right(motion, gain, rate_gain, constant, trend, value, slope, left, stop)
        if stop == end:
            return np.inf
        left, turn, convex = stop, turn + period, not convex


@compiled
def _from_left(motion, gain, rate_gain, constant, trend, value, slope, t, stop):
    """First zero between `t` and `stop` of a convex f that is >= 0 at `t`; infinite without one."""
    for _ in range(_NEWTON):
        if slope >= 0.0:
            return np.inf
        ahead = t - value / slope
        if ahead >= stop:
            return np.inf
        if ahead <= t:
            return t
        t = ahead
        value, slope = _values(t, motion, gain, rate_gain, constant, trend)
    return t


@compiled
def _from_right(motion, gain, rate_gain, constant, trend, value, slope, left, t):
    """Zero of a concave f that is negative at `t` and was >= 0 at `left`."""
    for _ in range(_NEWTON):
        back = max(t - value / slope, left) if slope < 0.0 else left
        if back >= t or value >= 0.0:
            return t
        t = back
        value, slope = _values(t, motion, gain, rate_gain, constant, trend)
    return t
