"""Fastest law of a run within limits of jerk.

The law without limits of jerk, averaged over the time that its jumps of acceleration need, places the points
between which jerk is constant. A short run is one program. A long one is solved in windows: each starts with
the state reached and ends at rest, and its first half is kept, so that there is always a way on; only a brake
longer than half a window is not foreseen.
"""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.timing import _jerk_program as jerk_program
from sdpgrind.finishing.timing._jerk_program import Data
from sdpgrind.finishing.timing._limits import LimitedRun
from sdpgrind.finishing.timing._min_time import fastest_law
from sdpgrind.finishing.timing._time_law import TimeLaw, advanced, integrated
from sdpgrind.finishing.timing._violations import closest, shares, slowing

SIZES = (32, 64, 128, 256)  # chosen: intervals of the programs; longer runs take windows of the last
# chosen: interval over the time in which a joint's acceleration goes from its greatest to its least
SHARE = 0.25
# of the duration, chosen: loss to limits exceeded between points, before they are narrowed there
SLOWER = 3e-3
# chosen: limit of the rounds; the first `FINER` add points where a limit is exceeded by more than `FAR`
ROUNDS, FINER, FAR = 8, 3, 1.03
CHECKS = 8  # chosen: places in an interval for limits between rounds
# of the duration, chosen: gain of a finer grid for the first law, which only places points
COARSE = 5e-3
BRAKE = 64  # chosen: most initial intervals in the longest brake; half a window holds twice as many
MANY = 2048  # chosen: most initial intervals on a run of few samples
EASY = 1.4  # chosen: slowing of the first guess; from within the limits the programs take fewer steps
# chosen: narrowing of limits behind the first points of a window, so that the next starts within them
MARGIN, FIRST = 1e-4, 4
AVERAGED = 64  # chosen: places for the average of the first law


class LawError(ValueError):
    """No law was found."""


class Points(NamedTuple):
    """Points of a first guess: times (s), places (mm), feeds (mm/s), accelerations (mm/s^2)."""

    time: Floats
    length: Floats
    feed: Floats
    acceleration: Floats


def jerk_limited_law(given: LimitedRun) -> TimeLaw:
    """Return the fastest law of a run within limits of jerk, too."""
    run, limits, feed_rate, _ = given
    first = fastest_law(given, gain=COARSE)
    turn = 2 * float(np.max(limits.table[1] / limits.table[2]))
    many = max(MANY, 4 * run.pieces.breaks.size)  # a slow cruise needs no more
    step = max(SHARE * turn, _brake(first) / BRAKE, first.duration / many)
    points = _points(first, min(turn, first.duration), step)
    tight = np.ones(points.length.size)
    for number in range(ROUNDS):
        law = _law(given, points, tight)
        used = shares(run, law, limits, feed_rate, CHECKS)[:, :, 0]
        if slowing(used.max(axis=0)) <= 1 + SLOWER:
            break
        beyond = used[:, :3].max(axis=1)
        if number < FINER and beyond.max() > FAR:
            points = _finer(law, beyond > FAR)
            tight = np.ones(points.length.size)
        else:
            tight = _tighter(tight, beyond)
    return law.slower(slowing(closest(run, law, limits, feed_rate, 20)[:, 0]))


def _finer(law: TimeLaw, beyond: Bools) -> Points:
    """Points of a law, more where limits are exceeded between them and in its longest pieces."""
    wide = beyond | np.append(beyond[1:], False) | np.insert(beyond[:-1], 0, False)
    spare = _count(beyond.size + int(wide.sum())) - beyond.size - int(wide.sum())
    longest = np.argsort(np.where(wide, 0.0, -np.diff(law.knots)), kind="stable")
    wide[longest[:spare]] = True
    time = np.sort(np.concatenate([law.knots, (law.knots[:-1] + law.knots[1:])[wide] / 2]))
    course = law.at(time)
    return Points(time, course.length, course.feed, course.acceleration)


def _brake(first: TimeLaw) -> float:
    """Longest time (s) of uninterrupted slowing down of a law."""
    falls = np.concatenate([[0.0], np.cumsum(np.where(first.acceleration < 0, np.diff(first.knots), 0.0))])
    pauses = np.flatnonzero(np.concatenate([[True], first.acceleration >= 0, [True]]))
    return float(np.max(np.diff(falls[np.minimum(pauses, falls.size - 1)]), initial=0.0))


def _tighter(tight: Floats, used: Floats) -> Floats:
    """Narrow the limits at both ends of the pieces that exceed them, by the same factor."""
    beyond = np.maximum(used, 1.0)
    wider: Floats = tight * np.maximum(np.append(beyond, 1.0), np.insert(beyond, 0, 1.0))
    return wider


def _points(first: TimeLaw, turn: float, step: float) -> Points:
    """Points at equal times of a law averaged over `turn` (s), as many as a program takes."""
    whole = first.duration + turn
    count = _count(whole / step)
    time = whole * np.arange(count + 1) / count
    places = time[:, None] - turn * (np.arange(AVERAGED) + 0.5) / AVERAGED
    length = first.at(np.clip(places, 0.0, first.duration)).length.mean(axis=1)
    length[0], length[-1] = first.length[0], first.end
    (now, feed_now), (then, feed_then) = (_clipped(first, time), _clipped(first, time - turn))
    return Points(time, length, (now - then) / turn, (feed_now - feed_then) / turn)


def _clipped(law: TimeLaw, time: Floats) -> tuple[Floats, Floats]:
    """Length and feed of a law at rest before its start and after its end."""
    course = law.at(np.clip(time, 0.0, law.duration))
    return course.length, np.where((time > 0) & (time < law.duration), course.feed, 0.0)


def _count(least: float) -> int:
    """Number of intervals: a size of the programs, or windows of the largest that overlap by halves."""
    for size in SIZES:
        if least <= size:
            return size
    half = SIZES[-1] // 2
    return half * (1 + int(np.ceil(least / half - 1)))


def _law(given: LimitedRun, points: Points, tight: Floats) -> TimeLaw:
    """Law over all points, window by window; the way to rest of the one before replaces a failed window."""
    count = points.length.size - 1
    begin, state, margin = 0, np.array([points.length[0], 0.0, 0.0]), MARGIN if count > SIZES[-1] else 0.0
    pieces: list[tuple[Floats, Floats]] = []
    to_rest: tuple[Floats, Floats] | None = None
    while begin < count:
        size = min(count - begin, SIZES[-1])
        window = Points(*(row[begin : begin + size + 1].copy() for row in points))
        try:
            t, j = _window(given, window, state, tight[begin : begin + size + 1], margin)
            kept = size if begin + size == count else size // 2
            pieces.append((t[:kept], j[:kept]))
            state, to_rest = _after(state, *pieces[-1]), (t[kept:], j[kept:])
        except LawError:
            if to_rest is None:
                raise
            pieces.append(to_rest)
            kept, to_rest = to_rest[0].size, None
            state = np.array([points.length[begin + kept], 0.0, 0.0])
        begin += kept
    t, j = (np.concatenate(column) for column in zip(*pieces, strict=True))
    return integrated(float(points.length[0]), t, np.concatenate([[0.0], np.cumsum(t * j)[:-1]]), j)


def _window(
    given: LimitedRun, points: Points, state: Floats, tight: Floats, margin: float
) -> tuple[Floats, Floats]:
    """Durations (s) and jerks (mm/s^3) over one window, from a state (place, feed, acceleration) to rest."""
    run, limits, feed_rate, acceleration = given
    points.length[0] = state[0]
    long, time = float(np.diff(points.length).mean()), float(np.diff(points.time).mean())
    held = np.where(np.arange(tight.size) < FIRST, 1.0, 1 + margin) * tight
    rates = run.derivatives(points.length)[:, 1:] * held[:, None, None]
    speed, most, jerk = limits.table
    scale = np.array([long, long**2, long**3])[:, None] / (jerk * time**3)
    cap = (
        np.minimum(feed_rate / held, 1 / np.maximum(np.abs(rates[:, 0] / speed).max(axis=1), 1e-9))
        * time
        / long
    )
    start = (float(state[1]) * time / long, float(state[2]) * time**2 / long)
    cap[0] = max(cap[0], start[0])
    weight, along = jerk * time / most, (acceleration or np.inf) * time**2 / long
    guess = _guess(points, cap, (long, time), rates * scale, weight)
    found = jerk_program.solve(
        Data(rates * scale, weight, np.diff(points.length) / long, cap, along, start, guess)
    )
    if not found.solved:
        where = f"between {points.length[0]:.4g} and {points.length[-1]:.4g} mm"
        raise LawError(
            f"no jerk-limited law was found {where} ({found.message}); method='trapezoid' gives a slower one"
        )
    t, j = found.durations, found.jerks
    exact = _exact(np.array([0.0, *start]), t, j, float(points.length[-1] - state[0]) / long)
    return t * time, exact * long / time**3


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
    slow = max(EASY if points.feed[0] == 0.0 else 1.0, np.sqrt(push), np.cbrt(snatch))
    return np.column_stack([feed / slow, bend / slow**2, np.append(steps, 1.0) * slow, jerk / slow**3])


def _after(state: Floats, durations: Floats, jerks: Floats) -> Floats:
    """State (place, feed, acceleration) after pieces of constant jerk."""
    s, v, a = state
    for t, j in zip(durations, jerks, strict=True):
        s, v, a = advanced(t, s, v, a, j)
    return np.array([s, v, a])


def _exact(state: Floats, durations: Floats, jerks: Floats, way: float) -> Floats:
    """Jerks with the least change that ends at rest at the exact place (the solver leaves some 1e-9)."""
    left = durations.sum() - np.cumsum(durations)  # from the end of each piece to the last
    t = durations
    effect = np.stack([t**3 / 6 + t**2 / 2 * left + t * left**2 / 2, t**2 / 2 + t * left, t])
    for _ in range(2):
        missed = np.array([way, 0.0, 0.0]) - _after(state, durations, jerks)
        jerks = jerks + np.linalg.lstsq(effect, missed, rcond=None)[0]
    return jerks
