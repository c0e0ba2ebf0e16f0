"""First guess of a jerk-limited law: the law without limits of jerk, averaged over a time.

The average over `turn` of a law within limits of acceleration has jumps of acceleration spread over `turn`.
"""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.timing._time_law import TimeLaw

AVERAGED = 64  # chosen: places for the average


class Points(NamedTuple):
    """Points at equal times: times (s), places (mm), feeds (mm/s), accelerations (mm/s^2)."""

    time: Floats
    length: Floats
    feed: Floats
    acceleration: Floats


def averaged(first: TimeLaw, turn: float, count: int) -> Points:
    """Points at `count` equal times of a law averaged over `turn` (s)."""
    whole = first.duration + turn
    time = whole * np.arange(count + 1) / count
    places = time[:, None] - turn * (np.arange(AVERAGED) + 0.5) / AVERAGED
    length = first.at(np.clip(places, 0.0, first.duration)).length.mean(axis=1)
    length[0], length[-1] = first.length[0], first.end
    (now, feed_now), (then, feed_then) = (_clipped(first, time), _clipped(first, time - turn))
    return Points(time, length, (now - then) / turn, (feed_now - feed_then) / turn)


def longest_brake(first: TimeLaw) -> float:
    """Longest time (s) of uninterrupted slowing down of a law."""
    falls = np.concatenate([[0.0], np.cumsum(np.where(first.acceleration < 0, np.diff(first.knots), 0.0))])
    pauses = np.flatnonzero(np.concatenate([[True], first.acceleration >= 0, [True]]))
    return float(np.max(np.diff(falls[np.minimum(pauses, falls.size - 1)]), initial=0.0))


def _clipped(law: TimeLaw, time: Floats) -> tuple[Floats, Floats]:
    """Length and feed of a law at rest before its start and after its end."""
    course = law.at(np.clip(time, 0.0, law.duration))
    return course.length, np.where((time > 0) & (time < law.duration), course.feed, 0.0)
