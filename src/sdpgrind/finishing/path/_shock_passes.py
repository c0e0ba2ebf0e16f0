"""Passes along shocks: pieces of their own, where geodesic passes leave wider gaps than they are to.

A place more than half a pitch from the pass behind comes, along the geodesic through it, to the next pass
after less than half a pitch, or sooner to a shock, and to the pass along that.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path._nearest import Nearest
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.path._turns_back import move_between

FAR = 0.51  # pitches, chosen: distance from other passes of the places that a pass is laid for
TOO_FAR = 0.515  # pitches, chosen: distance of a place that asks for a pass
APART = 3.0  # pitches, chosen: parts of a shock with less between them are one pass
SMOOTH = 5  # chosen: places of a shock whose mean evens out where kinks are found within a column
CLOSE = 1 / 64  # pitches, chosen: places of a shock that are looked at; distances change by less than that
STEP = 1 / 8  # pitches, chosen: chords for distances from passes; 1/512 off where these bend by a pitch


class PassField(NamedTuple):
    """Part of the square with passes: from `low` to `high` in s, from 0 to `top` in c."""

    low: float
    high: float
    top: float


def shock_passes(
    square: Square, courses: Sequence[Floats], lines: Sequence[Floats], part: PassField, pitch: float
) -> list[Floats]:
    """Return places (n, 2) of passes along shocks, `courses`, where they are far from `lines` (n, 3), mm."""
    found: list[Floats] = []
    near = [Nearest(lines)]
    inside = [each for course in courses for each in _clipped(square, course, part, pitch)]
    for course in sorted(inside, key=len, reverse=True):
        for each in _uncovered(square, course, near, pitch):
            found.append(each)
            near.append(Nearest([square.points(*each.T)]))
    return found


def _clipped(square: Square, course: Floats, part: PassField, pitch: float) -> Iterator[Floats]:
    """Parts of a course in the part with passes, evened out; one that ends below its top goes on to it."""
    held = (course[:, 0] >= part.low) & (course[:, 0] <= part.high) & (course[:, 1] <= part.top)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], held, [False]]).astype(int)))
    for first, last in ends.reshape(-1, 2):
        if last - first > 2:
            beyond = course[last] if last < len(course) else 2 * course[last - 1] - course[last - 3]
            yield _to_top(square, _evened(course[first:last]), beyond, part, pitch)


def _evened(course: Floats) -> Floats:
    """Means of `SMOOTH` places, fewer towards the ends."""
    out = course.copy()
    for k in range(1, len(course) - 1):
        reach = min(SMOOTH // 2, k, len(course) - 1 - k)
        out[k] = course[k - reach : k + reach + 1].mean(axis=0)
    return out


def _to_top(square: Square, course: Floats, beyond: Floats, part: PassField, pitch: float) -> Floats:
    """The course with its end on the top, on the way to a place `beyond`, where that is within a pitch."""
    way = beyond - course[-1]
    if way[1] <= 0.0:
        return course
    end = course[-1] + (part.top - course[-1, 1]) / way[1] * way
    if not part.low <= end[0] <= part.high or _lengths(square, np.stack([course[-1], end]))[-1] > pitch:
        return course
    end[1] = part.top
    return np.concatenate([course, [end]]) if end[1] > course[-1, 1] else course


def _uncovered(square: Square, course: Floats, near: Sequence[Nearest], pitch: float) -> list[Floats]:
    """Nodes of passes along the parts of a course that are far from other passes."""
    course = _closely(square, course, CLOSE * pitch)
    length = _lengths(square, course)
    points = square.points(*course.T)
    distance = np.min([each.distance(points) for each in near], axis=0)
    far = np.flatnonzero(distance > FAR * pitch)
    parts = np.split(far, np.flatnonzero(np.diff(length[far]) > APART * pitch) + 1) if far.size else []
    found = []
    for each in parts:
        first, last = max(each[0] - 1, 0), min(each[-1] + 1, len(course) - 1)
        if distance[each].max() > TOO_FAR * pitch:
            count = int(np.ceil((length[last] - length[first]) / pitch))
            at = np.linspace(length[first], length[last], count + 1)
            found.append(np.stack([np.interp(at, length, side) for side in course.T], axis=1))
    return found


def _closely(square: Square, course: Floats, step: float) -> Floats:
    """The course with places at most a `step` (mm) apart."""
    length = _lengths(square, course)
    at = np.linspace(0.0, length[-1], int(np.ceil(length[-1] / step)) + 1)
    return np.stack([np.interp(at, length, side) for side in course.T], axis=1)


def _lengths(square: Square, places: Floats) -> Floats:
    """Lengths (n,) of a line of chords up to places (n, 2), mm."""
    chords = np.linalg.norm(np.diff(square.points(*places.T), axis=0), axis=1)
    return np.append(0.0, np.cumsum(chords))


def on_the_work(
    square: Square, places: Floats, corners: Bools, passes: Sequence[Floats], pitch: float
) -> tuple[Floats, Bools]:
    """Return a path that goes on to the nearest end of a pass, along it, and so on, straight between."""
    all_places, all_corners, left = [places], [corners.copy()], list(passes)
    before, here = places[-2:]
    while left:
        ends = np.array([[each[0], each[-1]] for each in left]).reshape(-1, 2)
        way = np.linalg.norm(square.points(*ends.T) - square.points(*here[:, None]), axis=1)
        k, backwards = divmod(int(way.argmin()), 2)
        run = left.pop(k)[:: 1 - 2 * backwards]
        move = move_between(square, before, here, run[0], run[1], pitch)
        all_corners[-1][-1] = True
        sharp = np.zeros(len(run), bool)
        sharp[0] = True
        all_places += [move, run]
        all_corners += [np.ones(len(move), bool), sharp]
        before, here = run[-2:]
    return np.concatenate(all_places), np.concatenate(all_corners)
