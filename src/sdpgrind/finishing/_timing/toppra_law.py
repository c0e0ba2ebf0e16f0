"""The fastest law by `toppra` (Pham & Pham 2018), where the acceleration may jump."""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.extras import need
from sdpgrind.finishing._timing.joint_path import JointPath
from sdpgrind.finishing._timing.limits import JointLimits
from sdpgrind.finishing._timing.min_time import grid_of, law_of, slowed_to_limits
from sdpgrind.finishing._timing.time_law import TimeLaw

INTERVALS = 200
"""Least number of intervals on a run."""
FREE = 1e12
"""Acceleration along the path that is no limit, mm/s^2."""


class ToppraError(ValueError):
    """A run for which `toppra` found no law."""


@dataclass(frozen=True)
class _WithLength:
    """A run as `toppra` wants it, the arc length itself as one joint more: its speed is the feed."""

    run: JointPath

    @property
    def dof(self) -> int:
        """Joints, and the length."""
        return int(self.run.joints.shape[1]) + 1

    @property
    def path_interval(self) -> Floats:
        """Where the run begins and ends, mm."""
        return self.run.length[[0, -1]]

    def __call__(self, length: Floats, order: int = 0) -> Floats:
        """Joints and length, or a derivative of them."""
        own = [length, np.ones_like(length), np.zeros_like(length)][order]
        return np.column_stack([self.run.derivatives(length)[:, order], own])


def toppra_law(run: JointPath, limits: JointLimits, feed_rate: float, acceleration: float | None) -> TimeLaw:
    """Fastest law of a run by `toppra`, on the breaks of the path cut alike; slower for what is exceeded between."""
    grid = grid_of(run, -(-INTERVALS // (run.pieces.breaks.size - 1)))
    feed = _swept(run, limits, feed_rate, acceleration or FREE, grid)
    return slowed_to_limits(run, law_of(grid, feed**2), limits, feed_rate)


def _swept(run: JointPath, limits: JointLimits, feed_rate: float, acceleration: float, grid: Floats) -> Floats:
    """Feed at the points of a grid, mm/s."""
    need("toppra", "toppra")
    constraint, algorithm = need("toppra.constraint", "toppra"), need("toppra.algorithm", "toppra")
    speed, most = np.append(limits.speed_max, feed_rate), np.append(limits.acceleration_max, acceleration)
    ends = constraint.DiscretizationType.Interpolation  # at both ends of every interval
    rules = [
        constraint.JointVelocityConstraint(np.column_stack([-speed, speed])),
        constraint.JointAccelerationConstraint(np.column_stack([-most, most]), discretization_scheme=ends),
    ]
    with _quiet():
        feed: Any = algorithm.TOPPRA(rules, _WithLength(run), gridpoints=grid).compute_parameterization(0.0, 0.0)[1]
    if feed is None or not np.all(np.isfinite(feed)) or np.any(np.asarray(feed)[1:-1] <= 0):
        begin, end = run.length[[0, -1]]
        raise ToppraError(f"toppra found no law between {begin:.4g} and {end:.4g} mm; method='min_time' may")
    return np.asarray(feed, dtype=float)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep what `toppra` tells its log and its warnings away from the user; what matters is raised."""
    log = logging.getLogger("toppra")
    before = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.setLevel(before)
