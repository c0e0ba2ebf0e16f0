"""Joints as cubics over time, as controllers move them by places and speeds; speed of the contact."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.turns import shifted

_PART = 1e-4  # rad, mm, chosen: way of the fastest joint between two places whose difference is a speed


class JointCubics:
    """Cubics between rows of times (m,), joints (m, n) and speeds (m, n); at rest before and behind them."""

    def __init__(self, time: Floats, joints: Floats, speeds: Floats) -> None:
        self._ends = time[0], time[-1]
        self._joints = CubicHermiteSpline(time, joints, speeds)
        self._speeds = self._joints.derivative()

    def at(self, time: Floats) -> Floats:
        """Return joints (k, n) at times (k,), rad or mm."""
        return np.asarray(self._joints(np.clip(time, *self._ends)))

    def speed(self, time: Floats) -> Floats:
        """Return speeds of the joints (k, n) at times (k,), rad/s or mm/s."""
        there = (time >= self._ends[0]) & (time <= self._ends[1])
        return np.asarray(self._speeds(np.clip(time, *self._ends)) * there[:, None])

    def contact_speed(self, robot: Any, lever: float, time: Floats) -> Floats:
        """Return the speed (k,) of the contact over the work at times (k,), mm/s, by central differences.

        With the way of the fastest joint they err by its square over 6, 2e-9 of the speed.
        """
        joints, speed = self.at(time), self.speed(time)
        fastest = np.maximum(np.abs(speed).max(axis=1), np.finfo(float).tiny)
        step = _PART / fastest / 2
        ends = (
            robot.forward_work(joints + side * step[:, None] * speed) @ shifted(lever) for side in (1.0, -1.0)
        )
        ahead, behind = (each[:, :3, 3] for each in ends)
        return np.asarray(np.linalg.norm(ahead - behind, axis=1) / (2 * step))
