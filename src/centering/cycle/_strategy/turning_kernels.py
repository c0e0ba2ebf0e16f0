"""Time in which a table turns while its speed changes, and from push to push."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

RESTING = 0.35  # measured: share of the contact after the alignment of a push; 0.1 of short ones to 0.5 of long
_TURN = 2.0 * np.pi


@compiled(error_model="numpy")
def turn_time(angle, before, speed, rate, held, frozen):
    """Time (s) to turn by an angle (rad): at `before` for `held`, to `speed` at a rate, then `frozen` (s) steady.

    Speeds in rad/s, the rate of their change in rad/s^2, > 0. A table that slows is not frozen.
    """
    slope = rate if speed >= before else -rate
    late = frozen if speed >= before else 0.0
    ramp = abs(speed - before) / rate
    full = before * held + 0.5 * (before + speed) * ramp + speed * late
    if angle >= full:
        return held + ramp + late + (angle - full) / speed
    left = angle - before * (held + late)
    if left <= 0.0:  # touched before the speed changes
        return angle / before
    start = before + slope * late
    return held + late + 2.0 * left / (start + np.sqrt(max(start * start + 2.0 * slope * left, 0.0)))


@compiled
def speed_after(time, before, speed, rate, held, frozen):
    """Speed (rad/s) of a table at the end of a `turn_time` (s)."""
    if speed >= before:
        return min(before + rate * max(time - held - frozen, 0.0), speed)
    return max(before - rate * max(time - held, 0.0), speed)


@compiled
def measured_at(pressed, tip, before, speed, rate, arc):
    """Time (s) from the first touch of a push until the place of the part is known well enough.

    `pressed`: time to the turning point of the tip, s; `tip`: then to the end of its motion, to the first reading
    of a part at rest, to the first decision, and for the fewest readings, s; `arc`: of the measurement, rad.
    """
    back, rest, decided, fewest = tip
    held, first = pressed + back, pressed + rest
    begun = speed_after(first, before, speed, rate, held, 0.0)
    turned = turn_time(arc, begun, speed, rate, max(held - first, 0.0), 0.0)
    return max(first + max(turned, fewest), pressed + decided)


@compiled
def touch_to_touch(phase, pressed, tip, before, speed, rate, arc, approach, frozen):
    """Time (s) between the first touches of two pushes, and the speed (rad/s) at the second.

    The table turns by `phase` (rad), and by full turns until the part is measured; other arguments as of
    `measured_at`. `approach`: time from the last reading to the touch, s; `frozen`: within it and before, while
    the table keeps its speed.
    """
    soonest, held = measured_at(pressed, tip, before, speed, rate, arc) + approach, pressed + tip[0]
    time = turn_time(phase, before, speed, rate, held, frozen)
    while time < soonest:
        phase += _TURN
        time = turn_time(phase, before, speed, rate, held, frozen)
    return time, speed_after(time, before, speed, rate, held, frozen)
