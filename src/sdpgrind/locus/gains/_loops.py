"""The loop linearised at a point of the locus, sample by sample."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from sdpgrind.base.checks import Floats
from sdpgrind.locus._path.stretch import Stretch

SMALL = 1e-6  # chosen: share of the stretch for differences by one control


class Pid(NamedTuple):
    """Gains of the incremental law: integral, proportional, derivative; Koren (36), Fig. 3."""

    ki: float
    kp: float = 0.0
    kd: float = 0.0

    def row(self) -> Floats:
        """Return the coefficients of the present, last and last but one error."""
        return np.array([self.ki + self.kp + self.kd, -self.kp - 2 * self.kd, self.kd])


class Lag(NamedTuple):
    """Time constants of coordinate and sensor, and sampling period, s."""

    coordinate: float = 0.0
    sensor: float = 0.0
    period: float = 0.0


def radius(slope: Floats, pid: Pid) -> Floats:
    """Return the largest pole modulus without lag; the error falls by `slope` > 0 per coordinate."""
    now, once, twice = pid.row()
    slope = np.asarray(slope, dtype=float)
    companion = np.zeros((*slope.shape, 3, 3))
    companion[..., 0, 0] = 1 - now * slope
    companion[..., 0, 1], companion[..., 0, 2] = -once * slope, -twice * slope
    companion[..., 1, 0] = companion[..., 2, 1] = 1.0
    return np.asarray(np.abs(np.linalg.eigvals(companion)).max(axis=-1))


def lagged_map(limit: tuple[float, float], response: tuple[float, float], pid: Pid, lag: Lag) -> Floats:
    """Return the loop map (5, 5) by its state: actual coordinate, reading, command, last two errors.

    Slopes of limit and response are pairs: by the lagging coordinate, and by the other controls. A limit
    taken at the command has no slope of the first kind.
    """
    A = np.zeros((3, 3))  # actual, reading, and the held command
    A[0] = np.array([-1.0, 0.0, 1.0]) / lag.coordinate
    if lag.sensor > 0:
        A[1] = np.array([response[0], -1.0, response[1]]) / lag.sensor
    step = expm(A * lag.period)
    if lag.sensor == 0:
        step[1] = 0.0  # readings have no memory
    seen = [0.0, 1.0, 0.0] if lag.sensor > 0 else [response[0], 0.0, response[1]]
    error = (np.array([limit[0], 0.0, limit[1]]) - seen) @ step  # of the sample after the hold
    now, once, twice = pid.row()
    out = np.zeros((5, 5))
    out[:3, :3] = step
    out[2, :3] += now * error
    out[2, 3:] = once, twice
    out[3, :3] = error
    out[4, 3] = 1.0
    return out


def sampled_radius(stretch: Stretch, s: float, pid: Pid, lag: Lag, at: str) -> float:
    """Return the largest pole modulus where coordinate and reading lag; the other controls follow at once."""
    row, n = stretch.rows(s), len(stretch.names)
    k, x = stretch.names.index(stretch.along), row[n : n + 1]
    small = SMALL * (stretch.high - stretch.low)
    beside = np.array([row[:n], row[:n]])
    beside[:, k] += [-small, small]
    of_response, of_limit = (
        float(np.diff(values)[0]) / (2 * small) for values in stretch.values(beside, np.repeat(x, 2))
    )
    total = float(np.diff(stretch.rows(np.array([s - small, s + small]))[:, n + 1])[0]) / (2 * small)
    fixed = total - float(row[-1])  # slope of the response along the locus
    limit = (of_limit, total - of_limit) if at == "actual" else (0.0, total)
    map_ = lagged_map(limit, (of_response, fixed - of_response), pid, lag)
    return float(np.abs(np.linalg.eigvals(map_)).max())
