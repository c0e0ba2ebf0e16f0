"""Jerk-limited law of a short run by one nonlinear program, scaled by a length and a time of the run.

Times between the points are free, so that acceleration switches when it is best: on a run with few switches
some points are enough.
"""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.timing import _jerk_program as jerk_program
from sdpgrind.finishing.timing._first_guess import Points
from sdpgrind.finishing.timing._jerk_program import Data
from sdpgrind.finishing.timing._limits import LawError, LimitedRun
from sdpgrind.finishing.timing._time_law import TimeLaw, advanced, integrated

EASY = 1.4  # chosen: slowing of the first guess; from within the limits the program takes fewer steps


def short_run_law(given: LimitedRun, points: Points) -> TimeLaw:
    """Law of a run with limits held at the points of a first guess."""
    run, limits, feed_rate, acceleration = given
    long, time = float(np.diff(points.length).mean()), float(np.diff(points.time).mean())
    rates = run.derivatives(points.length)[:, 1:]
    speed, most, jerk = limits.table
    scale = np.array([long, long**2, long**3])[:, None] / (jerk * time**3)
    fastest = 1 / np.maximum(np.abs(rates[:, 0] / speed).max(axis=1), 1e-9)
    cap = np.minimum(feed_rate, fastest) * time / long
    weight, along = jerk * time / most, (acceleration or np.inf) * time**2 / long
    guess = _guess(points, cap, (long, time), rates * scale, weight)
    found = jerk_program.solve(Data(rates * scale, weight, np.diff(points.length) / long, cap, along, guess))
    if not found.solved:
        raise LawError(found.message)
    t, j = found.durations, found.jerks
    j = _exact(t, j, float(points.length[-1] - points.length[0]) / long)
    t, j = t * time, j * long / time**3
    return integrated(float(points.length[0]), t, np.concatenate([[0.0], np.cumsum(t * j)[:-1]]), j)


def _guess(points: Points, cap: Floats, scale: tuple[float, float], rates: Floats, weight: Floats) -> Floats:
    """First guess of feed, acceleration, duration, jerk at every point, scaled, slowed into the limits."""
    long, time = scale
    steps = np.diff(points.time) / time
    bend = points.acceleration * time**2 / long
    feed = np.minimum(points.feed * time / long, cap)
    jerk = np.append(np.diff(bend) / steps, 0.0)
    v, a, j = feed[:, None], bend[:, None], jerk[:, None]
    snatch = np.max(np.abs(rates[:, 2] * v**3 + 3 * rates[:, 1] * v * a + rates[:, 0] * j))
    push = np.max(np.abs(weight * (rates[:, 0] * a + rates[:, 1] * v**2)))
    slow = max(EASY, np.sqrt(push), np.cbrt(snatch))
    return np.column_stack([feed / slow, bend / slow**2, np.append(steps, 1.0) * slow, jerk / slow**3])


def _exact(durations: Floats, jerks: Floats, way: float) -> Floats:
    """Jerks with the least change that ends at rest at the exact place (the solver leaves some 1e-9)."""
    left = durations.sum() - np.cumsum(durations)  # from the end of each piece to the last
    t = durations
    effect = np.stack([t**3 / 6 + t**2 / 2 * left + t * left**2 / 2, t**2 / 2 + t * left, t])
    for _ in range(2):
        missed = np.array([way, 0.0, 0.0]) - _after(durations, jerks)
        jerks = jerks + np.linalg.lstsq(effect, missed, rcond=None)[0]
    return jerks


def _after(durations: Floats, jerks: Floats) -> Floats:
    """State (place, feed, acceleration) after pieces of constant jerk from rest."""
    s = v = a = 0.0
    for t, j in zip(durations, jerks, strict=True):
        s, v, a = advanced(t, s, v, a, j)
    return np.array([s, v, a])
