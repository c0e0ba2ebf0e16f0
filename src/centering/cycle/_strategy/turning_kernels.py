"""Time in which a table turns while its speed changes, and from push to push."""

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

RESTING = 0.35  # measured: share of the contact after the alignment; 0.1 of short pushes, 0.5 of long ones
_TURN = 2.0 * np.pi


@compiled(error_model="numpy")
def turn_time(angle, before, speed, rate, held, steady):
    """Time (s) to turn by an angle (rad): `held` s at `before`, then to `speed`, and `steady` s at the end.

    Speeds in rad/s, the rate of their change in rad/s^2, > 0. A table that slows is not steady.
    """
    slope = rate if speed >= before else -rate
    late = steady if speed >= before else 0.0
    ramp = abs(speed - before) / rate
    full = before * held + 0.5 * (before + speed) * ramp + speed * late
    if angle >= full:
        return held + ramp + late + (angle - full) / speed
    left = angle - before * (held + late)
    if left <= 0.0:  # there before the speed changes
        return angle / before
    start = before + slope * late
    return held + late + 2.0 * left / (start + np.sqrt(max(start * start + 2.0 * slope * left, 0.0)))


@compiled(error_model="numpy")
def speed_after(time, before, speed, rate, held, steady):
    """Speed (rad/s) of a table at the end of a `turn_time` (s)."""
    if speed >= before:
        return min(before + rate * max(time - held - steady, 0.0), speed)
    return max(before - rate * max(time - held, 0.0), speed)


@compiled(error_model="numpy")
def measured_at(pressed, tip, before, speed, rate, arc):
    """Time (s) from the alignment of a push until the place of the part is known well enough.

    `pressed`: until the tip turns back, s; `tip`: from there until the table changes its speed, until the
    first reading of a part at rest, until the first decision, and time of the fewest readings, s; `arc`:
    rotation of the table during the measurement, rad.
    """
    first, held = pressed + tip[1], pressed + tip[0]
    begun = speed_after(first, before, speed, rate, held, 0.0)
    turned = turn_time(arc, begun, speed, rate, max(held - first, 0.0), 0.0)
    return max(first + max(turned, tip[3]), pressed + tip[2])


@compiled(error_model="numpy")
def push_to_push(phase, pressed, tip, before, speed, rate, arc, launch, lead):
    """Time (s) between the alignments of two pushes, and the speed (rad/s) at the second.

    The table turns by `phase` (rad), and by full turns until the part is measured; other arguments as of
    `measured_at`. `launch`: time from the last reading to the alignment, s; `lead`: its end, from the start
    of the push on, in which the table keeps its speed.
    """
    soonest, held = measured_at(pressed, tip, before, speed, rate, arc) + launch, pressed + tip[0]
    time = turn_time(phase, before, speed, rate, held, lead)
    while time < soonest:
        phase += _TURN
        time = turn_time(phase, before, speed, rate, held, lead)
    return time, speed_after(time, before, speed, rate, held, lead)
