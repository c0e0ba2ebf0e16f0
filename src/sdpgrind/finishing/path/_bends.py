"""Bends: parts of passes that follow a trimming which runs nearly along them.

Where a trimming cuts a pass off, the strip between it and the neighbouring pass is up to a pitch and the
distance kept wide. A bend follows the trimming there, as long as the neighbour is more than half a pitch away
from it: between two parts of the pass, from the end of one, or alone.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from sdpgrind.base.checks import Bools, Floats

PARTS = 8  # chosen: places a pitch on the way along a trimming
SIDE = 8  # chosen: steps across; parts of a patch that are narrower may be missed
HALVINGS = 24  # derived: 2^-24 of a step of 0.2 pitches is below 1e-8 pitches
LEAST = 0.25  # of the pitch, chosen: beside a pass or another one so much less is left
KEPT = 0.05  # of the pitch, chosen: a bend is so much farther away, so that its legs may be long


class PassRegion(Protocol):
    """Part of a square with lines at constant c, in which passes keep a distance from a trimming."""

    def holds(self, s: Floats, c: Floats, more: float) -> Bools:
        """Return which places are inside, with `more` (mm) than the distance kept."""

    def clear(self, start: Floats, end: Floats) -> bool:
        """Return whether a straight move stays inside."""

    def speed(self, s: Floats, c: Floats) -> Floats:
        """Return the length a unit of s along lines, mm."""

    def speed_across(self, s: Floats, c: Floats) -> Floats:
        """Return the distance from lines a unit of c, mm."""


class LineStretch(NamedTuple):
    """Part of the line at c outside, from `low` to `high`, and whether parts of the pass end there."""

    c: float
    low: float
    high: float
    after: bool
    before: bool


class PassBend(NamedTuple):
    """Nodes (n, 2) of (s, c), s rising, and whether it goes on from and to parts of the pass."""

    nodes: Floats
    after: bool
    before: bool


def bends(
    region: PassRegion, stretches: Sequence[LineStretch], pitch: float, away: float
) -> list[list[PassBend]]:
    """Return the bends beside each stretch of a line; passes are `pitch` (mm) apart.

    One between two parts goes first, then the longest; beside it there is no other one. Others are at least
    `LEAST` pitches long, and no longer across than along. All stretches are asked at once.
    """
    if not stretches:
        return []
    c, low, high = np.array([each[:3] for each in stretches]).T
    pace, wide = region.speed((low + high) / 2, c), region.speed_across(low, c)
    counts = np.ceil((high - low) * pace / pitch * PARTS).astype(int)
    rows = [np.linspace(a, b, n + 1)[1:-1] for a, b, n in zip(low, high, counts, strict=True)]
    s, ends = np.concatenate(rows), np.cumsum([row.size for row in rows])[:-1]
    across = np.repeat(c, [row.size for row in rows])
    found: list[list[PassBend]] = [[] for _ in stretches]
    for side in (1.0, -1.0):
        place, held = _beside(region, s, across, side * (0.5 * pitch + away), KEPT * pitch)
        places = np.split(np.stack([s, place], axis=1), ends)
        for k, (nodes, inside) in enumerate(zip(places, np.split(held, ends), strict=True)):
            found[k] += _along(region, stretches[k], nodes, inside, pitch / PARTS / pace[k])
    return [
        _taken([each for each in beside if _worth(each, along, width, LEAST * pitch)])
        for beside, along, width in zip(found, pace.tolist(), wide.tolist(), strict=True)
    ]


def _taken(worth: list[PassBend]) -> list[PassBend]:
    """Those that are laid, in their order along the line."""
    worth.sort(key=lambda each: (not (each.after and each.before), -_reach(each)))
    taken: list[PassBend] = []
    for each in worth:
        if not any(_meet(each, other) for other in taken):
            taken.append(each)
    return sorted(taken, key=lambda each: float(each.nodes[0, 0]))


def _worth(bend: PassBend, pace: float, wide: float, least: float) -> bool:
    if bend.after and bend.before:
        return True
    return _reach(bend) * pace > max(least, float(np.ptp(bend.nodes[:, 1])) * wide)


def _reach(bend: PassBend) -> float:
    return float(bend.nodes[-1, 0] - bend.nodes[0, 0])


def _meet(one: PassBend, other: PassBend) -> bool:
    return bool(one.nodes[0, 0] <= other.nodes[-1, 0] and other.nodes[0, 0] <= one.nodes[-1, 0])


def _beside(region: PassRegion, s: Floats, c: Floats, most: float, more: float) -> tuple[Floats, Bools]:
    """Places nearest to lines inside, on one side and within `most` (mm), and where there are any."""
    across = most / region.speed_across(s, c)
    share = np.linspace(0.0, 1.0, SIDE + 1)
    places = np.repeat(s, SIDE + 1), (c[:, None] + across[:, None] * share).ravel()
    near = region.holds(*places, more).reshape(-1, SIDE + 1)
    held: Bools = np.asarray(near.any(axis=1))
    at = near.argmax(axis=1)
    low, high = share[np.maximum(at - 1, 0)], share[at]
    for _ in range(HALVINGS):
        middle = (low[held] + high[held]) / 2
        inside = region.holds(s[held], c[held] + across[held] * middle, more)
        low[held], high[held] = np.where(inside, low[held], middle), np.where(inside, middle, high[held])
    return c + across * high, held


def _along(
    region: PassRegion, stretch: LineStretch, places: Floats, held: Bools, step: float
) -> list[PassBend]:
    """Bends through places (n, 2), each as far as straight legs can be laid."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], held, [False]]).astype(int)))
    found = []
    for first, last in ends.reshape(-1, 2):
        nodes = places[first:last]
        after, before = stretch.after and first == 0, stretch.before and last == len(places)
        if after:
            nodes = np.concatenate([[[stretch.low - step, stretch.c]], nodes])
        if before:
            nodes = np.concatenate([nodes, [[stretch.high + step, stretch.c]]])
        begin = 0
        while begin < len(nodes) - 1:
            chosen = _legs(region, nodes, begin)
            bend = PassBend(nodes[chosen], after and begin == 0, before and chosen[-1] == len(nodes) - 1)
            if len(chosen) > 1:
                found.append(bend)
            begin = chosen[-1] + 1
    return found


def _legs(region: PassRegion, places: Floats, begin: int) -> list[int]:
    """As few places from `begin` on as straight legs inside need, as far as they can be joined."""
    found = [begin]
    while (following := _next(region, places, found[-1])) > found[-1]:
        found.append(following)
    return found


def _next(region: PassRegion, places: Floats, k: int) -> int:
    """A far place that a leg from place k joins, by doubling and halving; k: none."""
    low, step = k, 1
    while low + step < len(places) and region.clear(places[k], places[low + step]):
        low, step = low + step, 2 * step
    high = min(len(places), low + step)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if region.clear(places[k], places[middle]) else (low, middle)
    return low
