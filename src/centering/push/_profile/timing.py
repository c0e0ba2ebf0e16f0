"""Durations of moves from rest to rest; time and distance of stopping."""

from math import inf, sqrt
from typing import NamedTuple

from sdpgrind.base import checks


class StoppingWay(NamedTuple):
    """Time and distance of stopping, Mears (3.5) and (3.6).

    Attributes
    ----------
    time, distance : float
        Of stopping, s, mm.
    """

    time: float
    distance: float


def stopping_way(speed: float, acceleration: float) -> StoppingWay:
    """Return time and distance of stopping from a speed, Mears (3.5) and (3.6).

    Parameters
    ----------
    speed, acceleration : float
        Of the slide, mm/s, mm/s^2.

    Raises
    ------
    ValueError
        When the speed is < 0 or the acceleration is not > 0.

    Examples
    --------
    >>> stop = stopping_way(274.3, 2560.0)
    >>> round(stop.time, 5), round(stop.distance, 4)  # s, mm
    (0.10715, 14.6954)
    """
    v, a = checks.nonnegative("speed", speed, "mm/s"), checks.positive("acceleration", acceleration, "mm/s^2")
    return StoppingWay(v / a, v * v / (2.0 * a))


def move_time(
    distance: float, *, speed: float, acceleration: float, jerk: float = inf, timing: str = "exact"
) -> float:
    """Return the duration of a move from rest to rest, s.

    The speed is a trapezoid, or a triangle where the distance is too short for it; with limited jerk the move
    has seven phases.

    Parameters
    ----------
    distance : float
        Travel, mm.
    speed, acceleration, jerk : float
        Limits, mm/s, mm/s^2 and mm/s^3; infinite jerk: the acceleration jumps.
    timing : {"exact", "printed"}
        ``"printed"``: Mears (5.13) and (5.14) as they stand, too long by speed/acceleration; needs an
        infinite jerk.

    Raises
    ------
    ValueError
        When the distance is < 0 or a limit is not > 0.

    Examples
    --------
    >>> from sdpgrind import units
    >>> round(move_time(7.5, speed=units.mm_per_min(5000), acceleration=2560.0), 6)
    0.122552
    >>> round(move_time(7.5, speed=units.mm_per_min(5000), acceleration=2560.0, timing="printed"), 6)
    0.155104
    """
    d, v = checks.nonnegative("distance", distance, "mm"), checks.positive("speed", speed, "mm/s")
    a, j = checks.positive("acceleration", acceleration, "mm/s^2"), _jerk(jerk)
    if checks.one_of("timing", timing, ("exact", "printed")) == "printed":
        if j < inf:
            raise checks.refuse("jerk", "infinite where timing is printed", j, "mm/s^3")
        return printed_time(d, v, a)
    return rest_to_rest(d, v, a) if j == inf else _seven_phases(d, v, a, j)


def move_peak(distance: float, *, speed: float, acceleration: float, jerk: float = inf) -> float:
    """Return the greatest speed of a move from rest to rest, mm/s.

    Parameters
    ----------
    distance : float
        Travel, mm.
    speed, acceleration, jerk : float
        Limits, mm/s, mm/s^2 and mm/s^3; infinite jerk: the acceleration jumps.

    Raises
    ------
    ValueError
        When the distance is < 0 or a limit is not > 0.

    Examples
    --------
    >>> move_peak(1.0, speed=120.0, acceleration=2500.0)
    50.0
    >>> round(move_peak(1.0, speed=120.0, acceleration=2500.0, jerk=1e5), 4)
    29.2402
    """
    d, v = checks.nonnegative("distance", distance, "mm"), checks.positive("speed", speed, "mm/s")
    a, j = checks.positive("acceleration", acceleration, "mm/s^2"), _jerk(jerk)
    return min(v, sqrt(a * d)) if j == inf else min(v, _jerk_peak(d, a, j))


def rest_to_rest(d: float, v: float, a: float) -> float:
    """Duration of a trapezoid or a triangle, s; arguments are not checked."""
    return d / v + v / a if d * a >= v * v else 2.0 * sqrt(d / a)


def printed_time(d: float, v: float, a: float) -> float:
    """Mears (5.13) and (5.14) as printed, s."""
    return d / v + 2.0 * v / a


def _jerk(jerk: float) -> float:
    return inf if jerk == inf else checks.positive("jerk", jerk, "mm/s^3")


def _ramp(v: float, a: float, j: float) -> float:
    """Time to reach a speed with limited jerk, s."""
    return v / a + a / j if v * j >= a * a else 2.0 * sqrt(v / j)


def _jerk_peak(d: float, a: float, j: float) -> float:
    """Speed whose two ramps alone cover the distance: v ramp(v) = d, mm/s."""
    low = (d * sqrt(j) / 2.0) ** (2.0 / 3.0)
    return low if low * j < a * a else (sqrt((a * a / j) ** 2 + 4.0 * a * d) - a * a / j) / 2.0


def _seven_phases(d: float, v: float, a: float, j: float) -> float:
    peak = _jerk_peak(d, a, j)
    return d / v + _ramp(v, a, j) if v <= peak else 2.0 * _ramp(peak, a, j)
