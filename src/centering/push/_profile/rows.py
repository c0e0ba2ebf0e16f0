"""Rows (duration s, velocity mm/s, acceleration mm/s^2) of moves of a tip and of pushes."""

from math import sqrt

import numpy as np

from centering.push._profile.row_kernels import CLEAR, ROWS, last_rows, trapezoid_rows
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

STILL = 1e-9  # chosen: share of a profile's greatest speed that counts as a standstill, above rounding
_LEAST = 1e-12  # chosen: share of the whole duration below which a segment is dropped
_JERK_STEPS = 16  # chosen: segments of constant acceleration for one of constant jerk
_SLIVER = 1e-9  # s, chosen: rows left over by rounding are shorter


def trapezoid(distance: float, speed: float, acceleration: float) -> Floats:
    """Rows of `TipProfile.move`, without its checks."""
    out = np.empty((ROWS, 3))
    return lasting_rows(out[: trapezoid_rows(distance, speed, acceleration, out)])


def forward(rows: Floats) -> Floats:
    """Rows of a profile up to its furthest point, where it begins to withdraw."""
    back = np.flatnonzero((rows[:, 1] < 0.0) | ((rows[:, 1] == 0.0) & (rows[:, 2] < 0.0)))
    return rows[: back[0]] if back.size else rows


def remaining(rows: Floats, time: float) -> float:
    """Travel left to forward rows at a time (s), mm."""
    left = 0.0
    for duration, velocity, acceleration in rows[::-1]:
        left += (velocity + acceleration * duration / 2.0) * duration
    for duration, velocity, acceleration in rows:
        t = min(max(time, 0.0), duration)
        left -= (velocity + acceleration * t / 2.0) * t
        time -= duration
        if time <= 0.0:
            break
    return left


def after(segments: Floats, travel: float) -> Floats:
    """Rows of a profile over its last `travel` (mm) forward, and those that follow its furthest point."""
    rows = forward(segments).copy()
    kept = rows[: last_rows(rows, len(rows), travel)]
    return lasting_rows(np.vstack((kept, segments[len(rows) :])))


def lasting_rows(rows: Floats) -> Floats:
    """Rows of positive duration."""
    return rows[rows[:, 0] > _SLIVER]


def retraction(acceleration: float) -> Floats:
    """Rows that draw the tip back from rest to rest."""
    half = sqrt(CLEAR / acceleration)
    return np.array([[half, 0.0, -acceleration], [half, -acceleration * half, acceleration]])


def move_arguments(distance: float, speed: float, acceleration: float) -> tuple[float, float, float]:
    """Check distance, speed and acceleration of a move."""
    d = checks.number("distance", distance, "mm")
    if d == 0.0:
        raise checks.refuse("distance", "other than 0", d, "mm")
    return d, checks.positive("speed", speed, "mm/s"), checks.positive("acceleration", acceleration, "mm/s^2")


def scaled(rows: list[tuple[float, float, float]], direction: float) -> list[tuple[float, float, float]]:
    """Rows of positive duration, toward the axis or away from it."""
    least = _LEAST * sum(t for t, _, _ in rows)
    way = 1.0 if direction > 0.0 else -1.0
    return [(t, way * u, way * b) for t, u, b in rows if t > least]


def jerk_rise(top: float, acceleration: float, jerk: float) -> list[tuple[float, float, float]]:
    """Rows from rest to a speed: the acceleration rises, stays and falls."""
    peak = min(acceleration, sqrt(top * jerk))
    ramp, hold = peak / jerk, top / peak - peak / jerk
    shares = (np.arange(_JERK_STEPS) + 0.5) / _JERK_STEPS
    steps = [ramp / _JERK_STEPS] * _JERK_STEPS
    times = [*steps, hold, *steps]
    levels = [*(peak * shares), peak, *(peak * shares[::-1])]
    speeds = np.concatenate(((0.0,), np.cumsum(np.multiply(times, levels))))
    return list(zip(times, speeds.tolist(), levels, strict=False))
