"""Rows (duration s, velocity mm/s, acceleration mm/s^2) of a push: the way forward, what is left of it, the last part of it."""

import numpy as np

from centering.push._profile.row_kernels import ROWS, last_rows, trapezoid_rows
from sdpgrind.base.checks import Floats

_SLIVER = 1e-9  # s: what rounding leaves of a row


def trapezoid(distance: float, speed: float, acceleration: float) -> Floats:
    """The rows of `TipProfile.move`, without its checks."""
    out = np.empty((ROWS, 3))
    return lasting_rows(out[: trapezoid_rows(distance, speed, acceleration, out)])


def forward(rows: Floats) -> Floats:
    """The rows of a profile up to its farthest place, where it begins to withdraw."""
    back = np.flatnonzero((rows[:, 1] < 0.0) | ((rows[:, 1] == 0.0) & (rows[:, 2] < 0.0)))
    return rows[: back[0]] if back.size else rows


def remaining(rows: Floats, time: float) -> float:
    """Travel that forward rows still have before them at a time, mm."""
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
    """The rows of a profile from where its way forward has `travel` left, with what follows its farthest place."""
    rows = forward(segments).copy()
    kept = rows[: last_rows(rows, len(rows), travel)]
    return lasting_rows(np.vstack((kept, segments[len(rows) :])))


def lasting_rows(rows: Floats) -> Floats:
    """Those that have a length."""
    return rows[rows[:, 0] > _SLIVER]
