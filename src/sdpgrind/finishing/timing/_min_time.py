"""Fastest law of a run within the limits of its joints without jerk, swept over a grid.

The square of the feed is linear over arc length between points of the grid. A backward sweep finds the
greatest feed from which rest can be reached, a forward sweep the fastest course below it. The grid is refined
until that saves no time; limits exceeded between its points (in proportion to the square of its step) are
narrowed.
"""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.timing import _sweep_kernels as sweep_kernels
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._limits import LawError, LimitedRun
from sdpgrind.finishing.timing._narrowing import Narrowed, narrowed
from sdpgrind.finishing.timing._time_law import TimeLaw

LEAST, MOST = 64, 1 << 17  # chosen: bounds of the number of intervals on a run
GAIN = 2e-4  # of the duration, chosen: saving by half the step that is taken; about the error of the duration


def fastest_law(given: LimitedRun, gain: float = GAIN) -> TimeLaw:
    """Return the fastest law of a run without limits of jerk.

    Raises
    ------
    LawError
        When joints would have to rest on the way, on every grid.
    """
    pieces = given.run.pieces.breaks.size - 1
    parts = -(-LEAST // pieces)
    before = after = duration(given, parts)
    while parts * pieces < MOST:
        parts *= 2
        after = duration(given, parts)
        if np.isfinite(after) and after >= (1 - gain) * before:
            break
        before = after
    return kept_on(given, grid_of(given.run, parts)).law


def kept_on(given: LimitedRun, grid: Floats) -> Narrowed:
    """Return the fastest law on a grid that keeps the limits between its points, too."""

    def solve(factors: Floats) -> TimeLaw:
        return law_of(grid, swept(given, grid, factors))

    return narrowed(given, grid.size, solve)


def duration(given: LimitedRun, parts: int) -> float:
    """Duration on a grid of `parts` in each piece of the path, s; inf where joints would rest on the way."""
    grid = grid_of(given.run, parts)
    return float(_knots(grid, np.sqrt(swept(given, grid)))[-1])


class LimitRows(NamedTuple):
    """Limits at m points: greatest squared feed (m,), mm^2/s^2; rows ``|p u + c x|`` <= 1, (m, r)."""

    cap: Floats
    p: Floats
    c: Floats


def rows_of(given: LimitedRun, grid: Floats, factors: Floats | None = None) -> LimitRows:
    """Limits at the points of a grid (mm); those of speed and acceleration narrowed by factors (2, m)."""
    run, limits, feed_rate, acceleration = given
    joints, narrow = run.derivatives(grid), np.ones((2, grid.size)) if factors is None else factors
    speed, most, _ = limits.table
    p, c = (joints[:, order] / most * narrow[1][:, None] for order in (1, 2))
    if acceleration is not None:
        p = np.column_stack([p, np.full(grid.size, 1 / acceleration)])
        c = np.column_stack([c, np.zeros(grid.size)])
    fastest = 1 / np.maximum(np.abs(joints[:, 1] / speed).max(axis=1) * narrow[0], 1e-12)
    return LimitRows(np.minimum(feed_rate, fastest) ** 2, np.ascontiguousarray(p), np.ascontiguousarray(c))


def swept(given: LimitedRun, grid: Floats, factors: Floats | None = None) -> Floats:
    """Square of the feed (mm^2/s^2) at the points of a grid (mm)."""
    rows = rows_of(given, grid, factors)
    x = np.zeros(grid.size)
    sweep_kernels.fastest(np.diff(grid), rows.p, rows.c, rows.cap, x)
    return x


def law_of(grid: Floats, x: Floats) -> TimeLaw:
    """Law with squared feed linear over arc length between points: constant acceleration in each piece."""
    feed, step = np.sqrt(x), np.diff(grid)
    knots = _knots(grid, feed)
    if not np.isfinite(knots[-1]):
        raise LawError(f"on a grid of {step.size} intervals joints would have to rest on the way")
    return TimeLaw(knots, grid[:-1], feed[:-1], np.diff(x) / (2 * step), np.zeros(step.size))


def _knots(grid: Floats, feed: Floats) -> Floats:
    """Time at every point for the feeds there, s; inf behind two points at rest."""
    with np.errstate(divide="ignore"):
        return np.concatenate([[0.0], np.cumsum(2 * np.diff(grid) / (feed[1:] + feed[:-1]))])


def grid_of(run: JointPath, parts: int) -> Floats:
    """Breaks of the path (mm), each piece cut into `parts`."""
    breaks = run.pieces.breaks
    return np.interp(np.arange((breaks.size - 1) * parts + 1) / parts, np.arange(breaks.size), breaks)
