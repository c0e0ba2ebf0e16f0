"""Fastest law by `toppra` (Pham & Pham 2018), with jumps of the acceleration."""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.extras import need
from sdpgrind.finishing.timing._limits import LimitedRun
from sdpgrind.finishing.timing._min_time import LimitRows, duration, grid_of, kept_on, law_of, rows_of
from sdpgrind.finishing.timing._narrowing import slowed_to_limits
from sdpgrind.finishing.timing._time_law import TimeLaw

INTERVALS, MOST = 200, 1 << 16  # chosen: least number of intervals on a run, and the greatest that is halved
# of the duration, chosen: saving by half the step that is taken; further halvings save about as much again
GAIN = 5e-3
# of a limit, chosen: share that rounding leaves of a joint at rest, which would mislead the solver
NOTHING = 1e-9
NEAR = 0.1  # of the mean interval, chosen: points of the grid nearer to a corner of the law are dropped
SHORTEST = 1e-6  # of a run, chosen: least distance of a corner of the law from its end
# chosen: duration over that of our own sweep of the same grid from which on the solver has failed
STALLED = 1.01
# chosen: magnitude of squared feed and acceleration for `toppra`, with its fixed tolerances of 1e-8
SCALE = 100.0


class ToppraError(ValueError):
    """`toppra` found no law."""


@dataclass(frozen=True)
class _AsPath:
    """Rows ``|p u + c x|`` <= 1 for `toppra`: derivatives of a path of joints with acceleration limit 1."""

    grid: Floats
    p: Floats
    c: Floats

    @property
    def dof(self) -> int:
        """Number of rows."""
        return int(self.p.shape[1])

    @property
    def path_interval(self) -> Floats:
        """Start and end of the run."""
        return self.grid[[0, -1]]

    def __call__(self, length: Floats, order: int = 0) -> Floats:
        """First or second derivatives at the points of the grid, the only lengths that `toppra` uses."""
        return self.c if order == 2 else self.p


def toppra_law(given: LimitedRun) -> TimeLaw:
    """Return the fastest law of a run by `toppra`, with limits narrowed as in our own sweep of its grid."""
    need("toppra", "toppra")
    parts, ends = _parts(given), given.run.length[[0, -1]]
    for tried in (parts, 2 * parts, 3 * parts):  # ill-posed on one grid, but perhaps not on another
        grid = _with_corners(grid_of(given.run, tried), rows_of(given, ends))
        ours = kept_on(given, grid)
        feed = _solved(grid, rows_of(given, grid, ours.factors))
        law = None if feed is None else slowed_to_limits(given, law_of(grid, feed**2))
        if law is not None and law.duration <= STALLED * ours.law.duration:
            return law
    where = f"between {ends[0]:.4g} and {ends[1]:.4g} mm"
    raise ToppraError(f"toppra found no law {where}; take method='min_time' or 'trapezoid'")


def _parts(given: LimitedRun) -> int:
    """Parts of each piece of the path beyond which more would save little, by our own sweep."""
    pieces = given.run.pieces.breaks.size - 1
    parts = -(-INTERVALS // pieces)
    while 2 * parts * pieces <= MOST and duration(given, 2 * parts) < (1 - GAIN) * duration(given, parts):
        parts *= 2
    return parts


def _with_corners(grid: Floats, ends: LimitRows) -> Floats:
    """Grid with the corners of the law of a straight run: ends of its ways to and from the greatest feed."""
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
    """Greatest acceleration along the path of any law, mm/s^2, at each point."""
    free = (1 + np.abs(rows.c) * rows.cap[:, None]) / np.maximum(np.abs(rows.p), 1e-12)
    return np.asarray(free.min(axis=1))


def _solved(grid: Floats, rows: LimitRows) -> Floats | None:
    """Feed at the points of a grid, mm/s, or None.

    Feed and acceleration are scaled to about `SCALE`; values from rounding are set to 0.
    """
    most = _bound(rows)
    u = float(np.median(most)) / SCALE
    x = min(float(rows.cap.max()) / SCALE, u * float(np.ptp(grid)))
    p = np.where(np.abs(rows.p) * most[:, None] > NOTHING, rows.p * u, 0.0)
    c = np.where(np.abs(rows.c) * rows.cap[:, None] > NOTHING, rows.c * x, 0.0)
    moves = np.any(p, axis=0) | np.any(c, axis=0)
    moves[0] |= not moves.any()  # `toppra` needs a joint
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
    # The bound itself, no row: a row would need a joint.
    speed.compute_constraint_params = lambda *_: (*(None,) * 6, span)
    rules = [speed, constraint.JointAccelerationConstraint(limits, discretization_scheme=ends)]
    with _quiet():
        feed: Any = algorithm.TOPPRA(rules, path, gridpoints=path.grid).compute_parameterization(0.0, 0.0)[1]
    return None if feed is None else np.asarray(feed, dtype=float)


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress log and warnings of `toppra`; its failures are raised here."""
    log = logging.getLogger("toppra")
    before = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.setLevel(before)
