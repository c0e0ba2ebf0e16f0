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
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._limits import JointLimits
from sdpgrind.finishing.timing._min_time import LimitRows, grid_of, kept_on, law_of, rows_of, swept
from sdpgrind.finishing.timing._narrowing import slowed_to_limits
from sdpgrind.finishing.timing._time_law import TimeLaw

INTERVALS, MOST = 200, 1 << 16
"""Least number of intervals on a run, and the greatest that are halved."""
GAIN = 5e-3
"""Share of the duration that half the step must save to be taken; the rest of such a series is about as much again."""
NOTHING = 1e-9
"""Share of a limit that a joint may use unseen: what rounding leaves of a joint at rest would mislead the solver."""
NEAR = 0.1
"""Points of the grid give way to a corner of the law that is nearer than this share of the mean interval."""
SHORTEST = 1e-6
"""Share of a run that a corner of the law is from its end at least."""
STALLED = 1.01
"""A law that takes so many times as long as our own sweep of the same grid is none: the solver lost it."""
SCALE = 100.0
"""Feed squared and acceleration as `toppra` sees them, at most about: it has fixed tolerances of 1e-8."""


class ToppraError(ValueError):
    """A run for which `toppra` found no law."""


@dataclass(frozen=True)
class _AsPath:
    """Rows ``|p u + c x|`` <= 1 as `toppra` wants them: derivatives of a path whose joints all have the acceleration limit 1."""

    grid: Floats
    p: Floats
    c: Floats

    @property
    def dof(self) -> int:
        """Number of rows."""
        return int(self.p.shape[1])

    @property
    def path_interval(self) -> Floats:
        """Where the run begins and ends."""
        return self.grid[[0, -1]]

    def __call__(self, length: Floats, order: int = 0) -> Floats:
        """First or second derivatives at the points of the grid, the only lengths that are asked for."""
        return self.c if order == 2 else self.p


def toppra_law(run: JointPath, limits: JointLimits, feed_rate: float, acceleration: float | None) -> TimeLaw:
    """Fastest law of a run by `toppra`; our own sweep of the same grid tells where limits have to be narrower at its points."""
    need("toppra", "toppra")
    given = run, limits, feed_rate, acceleration
    parts = _parts(*given)
    for tried in (parts, 2 * parts, 3 * parts):  # what is ill-posed on one grid may not be on another
        grid = _with_corners(grid_of(run, tried), rows_of(*given, run.length[[0, -1]]))
        ours = kept_on(*given, grid)
        feed = _solved(grid, rows_of(*given, grid, ours.factors))
        law = None if feed is None else slowed_to_limits(run, law_of(grid, feed**2), limits, feed_rate)
        if law is not None and law.duration <= STALLED * ours.law.duration:
            return law
    begin, end = run.length[[0, -1]]
    raise ToppraError(
        f"toppra found no law between {begin:.4g} and {end:.4g} mm; take method='min_time' or 'trapezoid'"
    )


def _parts(run: JointPath, limits: JointLimits, feed_rate: float, acceleration: float | None) -> int:
    """Into how many parts each piece of the path is cut, so that more would save little; told by our own sweep."""

    def lasting(parts: int) -> float:
        grid = grid_of(run, parts)
        return law_of(grid, swept(run, limits, feed_rate, acceleration, grid)).duration

    pieces = run.pieces.breaks.size - 1
    parts = -(-INTERVALS // pieces)
    while 2 * parts * pieces <= MOST and lasting(2 * parts) < (1 - GAIN) * lasting(parts):
        parts *= 2
    return parts


def _with_corners(grid: Floats, ends: LimitRows) -> Floats:
    """Grid with the corners of the law that a straight run has: how far it takes to the greatest feed, and from it to rest."""
    span, last = grid[-1] - grid[0], grid.size - 1
    way = np.minimum(ends.cap / (2 * _bound(ends)), span / 2)
    near = NEAR * np.minimum(way, span / last)
    corners = np.array([grid[0] + way[0], grid[-1] - way[1]])
    new = way > SHORTEST * span
    new[1] &= not (new[0] and np.ptp(corners) <= near.max())  # one where the greatest feed is not reached
    kept = np.all(np.abs(grid[:, None] - corners[new]) > near[new], axis=1)
    kept[[0, -1]] = True
    return np.unique(np.concatenate([grid[kept], corners[new]]))


def _bound(rows: LimitRows) -> Floats:
    """Acceleration along the path that no law exceeds, mm/s^2, at each point."""
    free = (1 + np.abs(rows.c) * rows.cap[:, None]) / np.maximum(np.abs(rows.p), 1e-12)
    return np.asarray(free.min(axis=1))


def _solved(grid: Floats, rows: LimitRows) -> Floats | None:
    """Feed at the points of a grid, mm/s, or None.

    Feed and acceleration get units in which they are about `SCALE`; what only rounding has left is 0.
    """
    most = _bound(rows)
    u = float(np.median(most)) / SCALE
    x = min(float(rows.cap.max()) / SCALE, u * float(np.ptp(grid)))
    p = np.where(np.abs(rows.p) * most[:, None] > NOTHING, rows.p * u, 0.0)
    c = np.where(np.abs(rows.c) * rows.cap[:, None] > NOTHING, rows.c * x, 0.0)
    moves = np.any(p, axis=0) | np.any(c, axis=0)
    moves[0] |= not moves.any()  # `toppra` wants a joint
    feed = _by_toppra(_AsPath((grid - grid[0]) * u / x, p[:, moves], c[:, moves]), rows.cap / x)
    if feed is None or not np.all(np.isfinite(feed)) or np.any(feed[1:-1] <= 0):
        return None
    return np.asarray(feed * x**0.5)


def _by_toppra(path: _AsPath, cap: Floats) -> Floats | None:
    """Feed at the points of a grid, or None; `cap` is the greatest squared feed."""
    constraint, algorithm = need("toppra.constraint", "toppra"), need("toppra.algorithm", "toppra")
    ends = constraint.DiscretizationType.Interpolation  # at both ends of every interval
    one, span = np.ones((path.dof, 1)), np.column_stack([np.zeros_like(cap), cap])
    limits = np.hstack([-one, one])
    speed: Any = constraint.JointVelocityConstraint(limits)
    speed.compute_constraint_params = lambda *_: (
        (None,) * 6 + (span,)
    )  # the bound itself, no row: a row would need a joint
    rules = [speed, constraint.JointAccelerationConstraint(limits, discretization_scheme=ends)]
    with _quiet():
        feed: Any = algorithm.TOPPRA(rules, path, gridpoints=path.grid).compute_parameterization(0.0, 0.0)[1]
    return None if feed is None else np.asarray(feed, dtype=float)


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
