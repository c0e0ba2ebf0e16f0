"""The loop around a point of the locus, as a linear map from sample to sample."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from sdpgrind.base.checks import Floats


class Pid(NamedTuple):
    """Gains of the incremental form: integral, proportional, derivative; Koren (36) and Fig. 3."""

    ki: float
    kp: float = 0.0
    kd: float = 0.0

    def row(self) -> Floats:
        """What errors now, one and two samples ago change in the coordinate."""
        return np.array([self.ki + self.kp + self.kd, -self.kp - 2 * self.kd, self.kd])


class Lag(NamedTuple):
    """What stands between a command and its reading: time constants of the coordinate and of the sensor, and the period, s."""

    coordinate: float = 0.0
    sensor: float = 0.0
    period: float = 0.0


def radius(slope: Floats, pid: Pid) -> Floats:
    """Largest modulus of the poles where the error falls by `slope` > 0 per unit of the coordinate; plants without lag."""
    now, once, twice = pid.row()
    slope = np.asarray(slope, dtype=float)
    companion = np.zeros((*slope.shape, 3, 3))
    companion[..., 0, 0] = 1 - now * slope
    companion[..., 0, 1], companion[..., 0, 2] = -once * slope, -twice * slope
    companion[..., 1, 0] = companion[..., 2, 1] = 1.0
    return np.asarray(np.abs(np.linalg.eigvals(companion)).max(axis=-1))


def lagged_map(limit: tuple[float, float], response: tuple[float, float], pid: Pid, lag: Lag) -> Floats:
    """Map (5, 5) of the loop from sample to sample, by its state: actual coordinate, reading, command, last two errors.

    Slopes of limit and response are given as pairs: by the actual coordinate, which lags, and by what follows at once. A limit
    that is taken at the command has no slope of the first kind.
    """
    A = np.zeros((3, 3))  # actual, reading, and the held command
    A[0] = np.array([-1.0, 0.0, 1.0]) / lag.coordinate
    A[1] = np.array([response[0], -1.0, response[1]]) / lag.sensor
    step = expm(A * lag.period)
    error = np.array([limit[0], -1.0, limit[1]]) @ step  # of the sample after the hold
    now, once, twice = pid.row()
    out = np.zeros((5, 5))
    out[:3, :3] = step
    out[2, :3] += now * error
    out[2, 3:] = once, twice
    out[3, :3] = error
    out[4, 3] = 1.0
    return out
