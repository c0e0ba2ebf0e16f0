"""Rows (duration s, velocity mm/s, acceleration mm/s^2) that moves of a tip are made of."""

from math import sqrt

import numpy as np

from sdpgrind.base import checks

STILL = 1e-9
"""Share of a profile's greatest speed that is rounding of a standstill."""
_LEAST = 1e-12  # share of the whole, below which a segment has no length
_JERK_STEPS = 16  # segments of constant acceleration that stand for one of constant jerk


def move_arguments(distance: float, speed: float, acceleration: float) -> tuple[float, float, float]:
    """Distance, speed and acceleration of a move, checked."""
    d = checks.number("distance", distance, "mm")
    if d == 0.0:
        raise checks.refuse("distance", "other than 0", d, "mm")
    return d, checks.positive("speed", speed, "mm/s"), checks.positive("acceleration", acceleration, "mm/s^2")


def scaled(rows: list[tuple[float, float, float]], direction: float) -> list[tuple[float, float, float]]:
    """Rows that have a length, toward the axis or away from it."""
    least = _LEAST * sum(t for t, _, _ in rows)
    way = 1.0 if direction > 0.0 else -1.0
    return [(t, way * u, way * b) for t, u, b in rows if t > least]


def jerk_rise(top: float, acceleration: float, jerk: float) -> list[tuple[float, float, float]]:
    """Rows that lead from rest to a speed: the acceleration rises, stays and falls."""
    peak = min(acceleration, sqrt(top * jerk))
    ramp, hold = peak / jerk, top / peak - peak / jerk
    shares = (np.arange(_JERK_STEPS) + 0.5) / _JERK_STEPS
    steps = [ramp / _JERK_STEPS] * _JERK_STEPS
    times = [*steps, hold, *steps]
    levels = [*(peak * shares), peak, *(peak * shares[::-1])]
    speeds = np.concatenate(((0.0,), np.cumsum(np.multiply(times, levels))))
    return list(zip(times, speeds.tolist(), levels, strict=False))
