"""Shocks: curves along which fronts of equal distance collide, found by the kinks of many level sets.

Between two passes a pitch apart that have a kink of half turn t there, places on the shock are up to
1/(1 + cos t) pitches from both: more than half a pitch, up to a whole one where fronts meet head-on.
"""

from copy import copy
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path._geodesic import Field, level_sets
from sdpgrind.finishing.path._square import Square

TURN = 0.1  # rad, chosen: at a kink of less, nodes a pitch apart cut off 0.1/4 pitches at most
BESIDE = 3  # columns of a field, chosen: no other kink is so near to one
FINE = 8  # chosen: level sets a pitch for the course of a shock
AHEAD = 2.0  # chosen: greatest way from a kink to that of the next level, of that for its own turn
LOOSE = 4.0  # columns of a field, chosen: error of that way


class LevelKinks(NamedTuple):
    """Kinks of a level set at places s (n,) and c (n,), and their half turns (n,), rad."""

    s: Floats
    c: Floats
    half: Floats

    def between(self, low: float, high: float) -> "LevelKinks":
        """Return those with s between two places."""
        inside = (self.s > low) & (self.s < high)
        return LevelKinks(*(each[inside] for each in self))


NO_KINKS = LevelKinks(*np.empty((3, 0)))


class LevelSets:
    """Places (n, levels) of level sets in the columns of a field.

    Looked at `closely`: their kinks, how far (n, levels) they turn at each column, rad, and how long they are
    from the column before, mm; else none.
    """

    def __init__(self, field: Field, levels: Floats) -> None:
        self.field, self.levels = field, levels
        self.places = level_sets(field, levels)
        self.kinks = [NO_KINKS] * levels.size
        self.bends = self.ways = np.zeros(self.places.shape)
        self.close = False

    def closely(self, square: Square) -> "LevelSets":
        """Return them with kinks, turns and lengths."""
        out = copy(self)
        out.close = True
        legs = _legs(square, self.field.s, self.places)
        out.ways = np.pad(np.nan_to_num(np.linalg.norm(legs, axis=-1), nan=0.0), ((1, 0), (0, 0)))
        turns = _turns(self.field.s, self.places, legs)
        out.kinks, out.bends = _kinks(self.field.s, self.places, turns), np.abs(turns) / 2
        return out


def _kinks(s: Floats, c: Floats, turns: Floats) -> list[LevelKinks]:
    """The kinks of each level set, places c (n, levels) in columns s (n,), that open ahead."""
    return [_of_level(s, row, turn) for row, turn in zip(c.T, turns.T, strict=True)]


def _legs(square: Square, s: Floats, c: Floats) -> Floats:
    """Legs (n - 1, levels, 3) of each level from column to column, mm; NaN where it is not known."""
    at = np.nan_to_num((c[1:] + c[:-1]) / 2, nan=0.0)
    by_s, by_c = square.tangents(np.broadcast_to(((s[1:] + s[:-1]) / 2)[:, None], at.shape), at)
    return np.diff(s)[:, None, None] * by_s + np.diff(c, axis=0)[..., None] * by_c


def _turns(s: Floats, c: Floats, legs: Floats) -> Floats:
    """Turn (n, levels) of each level from the leg before that behind a column to the leg after it, rad.

    Less than 0 where the level turns away from the border, 0 where it is not known.
    """
    way = legs / np.linalg.norm(legs, axis=-1, keepdims=True)
    slope = np.diff(c, axis=0) / np.diff(s)[:, None]
    cosine = np.einsum("ijk,ijk->ij", way[:-2], way[2:])
    turn = np.copysign(np.arccos(np.clip(cosine, -1.0, 1.0)), slope[2:] - slope[:-2])
    out = np.zeros(c.shape)
    out[1:-2] = np.nan_to_num(turn, nan=0.0)
    return out


def _of_level(s: Floats, c: Floats, turn: Floats) -> LevelKinks:
    found = [k for k in np.flatnonzero(_sharpest(turn)).tolist() if np.isfinite(c[k - 2 : k + 4]).sum() == 6]
    places = np.array([_place(s, c, k) for k in found]).reshape(-1, 2)
    return LevelKinks(places[:, 0], places[:, 1], turn[found] / 2)


def _sharpest(turn: Floats) -> Bools:
    """Where a turn is large, and larger than those beside it."""
    padded = np.pad(turn, BESIDE)
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * BESIDE + 1)
    first: Bools = (turn > TURN) & (around.argmax(axis=1) == BESIDE)
    return first


def _place(s: Floats, c: Floats, k: int) -> tuple[float, float]:
    """Where the level before column k and that after the next one meet; they are straight for two columns."""
    before, after = ((c[j + 1] - c[j]) / (s[j + 1] - s[j]) for j in (k - 2, k + 2))
    ahead = (c[k + 2] - after * (s[k + 2] - s[k - 1]) - c[k - 1]) / (before - after)
    at = s[k - 1] + float(np.clip(ahead, 0.0, s[k + 2] - s[k - 1]))
    return at, float(c[k - 1] + before * (at - s[k - 1]))


def shocks(square: Square, field: Field, step: float) -> list[Floats]:
    """Return places (n, 2) of (s, c) along each shock, by levels a `step` (mm) apart, or a column's width.

    One that runs into another ends on it.
    """
    step = max(step, float(field.distance[:, -1].max()) * float(field.c[1]))
    found = LevelSets(field, np.arange(step, float(field.distance[:, -1].max()), step)).closely(square).kinks
    open_ends: list[list[Floats]] = []
    done: list[list[Floats]] = []
    for each in found:
        open_ends, ended = _grown(square, open_ends, each, step, field.s[1])
        done += ended
    return [np.array(each)[:, :2] for each in done + open_ends if len(each) > 2]


def _grown(
    square: Square, courses: list[list[Floats]], found: LevelKinks, step: float, column: float
) -> tuple[list[list[Floats]], list[list[Floats]]]:
    """Courses that go on by the kinks of the next level, or begin there, and those that end.

    Kinks are places (3,) of (s, c, half turn).
    """
    places = np.stack([found.s, found.c, found.half], axis=1)
    wanted = [_following(square, each[-1], places, step, column) for each in courses]
    taken = np.full(len(places), -1)
    for k in sorted(range(len(courses)), key=lambda k: -len(courses[k])):
        if wanted[k] >= 0:
            courses[k].append(places[wanted[k]])
            if taken[wanted[k]] < 0:
                taken[wanted[k]] = k
    going = [courses[k] for k in taken[taken >= 0]]
    ended = [each for k, each in enumerate(courses) if k not in taken]
    return going + [[place] for place, by in zip(places, taken, strict=True) if by < 0], ended


def _following(square: Square, last: Floats, places: Floats, step: float, column: float) -> int:
    """Number of the nearest kink that a shock may have reached; -1: none."""
    if not len(places):
        return -1
    by_s, by_c = square.tangents(last[:1], last[1:2])
    move = places[:, :2] - last[:2]
    way = np.linalg.norm(move[:, :1] * by_s + move[:, 1:] * by_c, axis=1)
    most = AHEAD * step / np.cos(last[2]) + LOOSE * column * np.linalg.norm(by_s)
    nearest = int(way.argmin())
    return nearest if way[nearest] <= most else -1
