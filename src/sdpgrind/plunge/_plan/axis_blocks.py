"""Few straight blocks that stay near a course of the axis: a greedy funnel.

From the end of a block, the slopes that pass all of the next samples within the tolerance are an interval,
which shrinks sample by sample. The next block is the longest for which it holds a slope that a control can
be told: a position and a feed of so many decimals. Each block begins where and when the one before ends as it
is written, so that rounding does not add up.
"""

from collections.abc import Iterator
from math import ceil, floor
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.units import mm_per_min
from sdpgrind.plunge._plan.axis_course import AxisCourse

_ROUNDING = 1e-6  # derived: share of a last decimal that is rounding of a double
_EARLY = 2e-3  # chosen: end of a program before that of the plan, s; a dwell makes up for more


class AxisBlock(NamedTuple):
    """Straight line to a position (mm) at a feed (mm/min) that ends at a time (s); feed 0: a dwell (s)."""

    position: float
    feed: float
    dwell: float
    end: float


class _Cone(NamedTuple):
    """Slopes, mm/s, that pass the next samples within the tolerance; their times since the start, s."""

    since: Floats
    least: Floats
    most: Floats
    left: int  # samples to the end of the course


def blocks_of(course: AxisCourse, tolerance: float, digits: int) -> list[AxisBlock]:
    """Blocks within the tolerance (mm) of the course, with positions, feeds and dwells of so many decimals.

    Raises
    ------
    ValueError
        If so many decimals are too few for the tolerance.
    """
    found, whole = [AxisBlock(0.0, 0.0, 0.0, 0.0)], False
    while not whole or course.time[-1] - found[-1].end > _EARLY:
        cone = _cone(course, tolerance, found[-1])
        passed, block = next(_longest(cone, found[-1], digits), (0, None))
        if block is None:
            raise ValueError(
                f"deviation must be greater for blocks of {digits} decimals (mm); got {tolerance:.3g}"
            )
        found.append(block)
        whole = passed == cone.left
    return found[1:]


def _cone(course: AxisCourse, tolerance: float, last: AxisBlock) -> _Cone:
    later = course.time > last.end
    since, off = course.time[later] - last.end, course.position[later] - last.position
    least = np.maximum.accumulate((off - tolerance) / since)
    most = np.minimum.accumulate((off + tolerance) / since)
    passed = least <= most
    count = since.size if passed.all() else int(np.argmin(passed))
    return _Cone(since[:count], least[:count], most[:count], since.size)


def _longest(cone: _Cone, last: AxisBlock, digits: int) -> Iterator[tuple[int, AxisBlock]]:
    """Number of samples passed and the block, from the longest on."""
    for k in range(cone.since.size - 1, -1, -1):
        since, least, most = float(cone.since[k]), float(cone.least[k]), float(cone.most[k])
        rests = least <= 0.0 <= most
        block = _dwell(last, since, digits) if rests else _feed(last, since, least, most, digits)
        if block is not None:
            yield k + 1, block


def _dwell(last: AxisBlock, since: float, digits: int) -> AxisBlock | None:
    seconds = floor(since * 10**digits + _ROUNDING) / 10**digits
    return AxisBlock(last.position, 0.0, seconds, last.end + seconds) if seconds > 0.0 else None


def _feed(last: AxisBlock, since: float, least: float, most: float, digits: int) -> AxisBlock | None:
    """Block to the least position of so many decimals within reach; its feed is rounded up."""
    unit, minute = 10.0**digits, 1.0 / mm_per_min(1.0)
    ends = (ceil((last.position + least * since) * unit), floor((last.position + most * since) * unit))
    for end in range(ends[0], ends[1] + 1):
        way = end / unit - last.position
        feed = ceil(way / since * minute * unit - _ROUNDING) / unit
        if feed > 0.0 and least <= feed / minute <= most:
            return AxisBlock(end / unit, feed, 0.0, last.end + way / feed * minute)
    return None
