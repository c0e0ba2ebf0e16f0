"""Runs of readings beside a robust form: which of them are asperities, and which edges of a slot or lands."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.lib.stride_tricks import sliding_window_view

from sdpgrind.base.checks import Bools, Floats

Indices = npt.NDArray[np.int64]

FOOT = 2.0  # chosen: sd; an asperity ends where the residual falls below it
_SIDE = 5  # chosen: readings whose median is the level beside a run; a level to half an sd
# derived: an asperity rises over both of its sides by its height above the form, 1. Past an edge the robust
# form is wrong by that height, and the readings go on level on one side, 0. measured: edges of slots of
# 20 µm, 2 to 20 degrees, without and with noise of 0.1 and 0.3 µm have at most 0.2
_RISE = 0.5
# chosen: of the least height of an asperity. Beside a small step, as of drift over a turn, the form is wrong
# by half of it and noise does the rest. measured: of 480 turns of 720 and 3600 readings with steps of 5, 10
# and 20 sd 40 had an asperity without this bound and without the slope of the form beside it, 4 with both
_RISE_LEAST = 0.85
_FEW = 3  # chosen: readings that are all high or low at the edge of a slot; a land has as many at least
_SLOT = np.radians(30.0)  # chosen: widest slot beside a land; between wider ones a land is form by itself
_LEVEL = 0.1  # chosen: height of a land beside what is beyond its slots, over that above them


class Outstanding(NamedTuple):
    """What counts as an asperity: sd above the form, pits too, widest (rad; None: any)."""

    sigmas: float
    both: bool
    width: float | None


class AsperityRuns(NamedTuple):
    """Asperities: which points in order are theirs, their number, widths (rad)."""

    out: Bools
    number: int
    widths: Floats


def runs_of(height: Floats, level: Floats, angle: Floats, asked: Outstanding) -> AsperityRuns:
    """Asperities on the closed turn: heights above the form and readings in sd, angles in order (rad)."""
    side = np.where(height >= FOOT, 1, np.where((height <= -FOOT) & asked.both, -1, 0))
    number = _numbered(side)
    tall = np.unique(number[(side != 0) & (np.abs(height) > asked.sigmas)])
    reach = max(round(_SLOT / (2 * np.pi) * height.size), 3 * _SIDE)
    found = [
        points
        for points in (_in_order(number == run) for run in tall)
        if _stands_out(points, side, height, level, _RISE_LEAST * asked.sigmas)
        and not _is_land(points, side[points[0]], height, level, reach)
    ]
    widths = np.array([_width(points, angle) for points in found])
    kept = widths <= (np.inf if asked.width is None else asked.width)
    out = np.zeros(height.size, dtype=bool)
    for points in (each for each, narrow in zip(found, kept, strict=True) if narrow):
        out[points] = True
    return AsperityRuns(out, int(kept.sum()), widths[kept])


def _numbered(side: Floats) -> Floats:
    """Number of the run of each point: neighbours on one side of the form, over the end of the turn too."""
    starts = side != np.roll(side, 1)
    number = np.cumsum(starts)
    return np.where(number == 0, number[-1], number)


def _in_order(member: Bools) -> Indices:
    """Indices of the points of a run along the turn, though it may go over its end."""
    points = np.flatnonzero(member)
    if points.size == member.size or not (member[0] and member[-1]):
        return points
    breaks = int(np.flatnonzero(np.diff(points) > 1)[0]) + 1
    return np.roll(points, -breaks)


def _stands_out(points: Indices, side: Floats, height: Floats, level: Floats, least: float) -> bool:
    """Whether a run rises over both of its sides, not over one as the edge of a slot does."""
    sign = side[points[0]]
    free = np.flatnonzero(side == 0)
    if free.size < 4 * _SIDE:
        return True
    after = np.searchsorted(free, points[-1], side="right")
    before = np.searchsorted(free, points[0])
    sides = [np.arange(before - 2 * _SIDE, before), np.arange(after + 2 * _SIDE - 1, after - 1, -1)]
    top = int(points[np.argmax(sign * level[points])])
    places = [np.take(free, which, mode="wrap") for which in sides]
    away = [np.mod(place - top + level.size // 2, level.size) - level.size // 2 for place in places]
    beside = _beside(away, [sign * level[place] for place in places])
    return float(sign * level[top]) - beside >= max(_RISE * float(np.max(sign * height[points])), least)


def _beside(away: list[Indices], level: list[Floats]) -> float:
    """Higher of the levels of both sides, inwards to the end, at a place so many readings away from them.

    Both sides have one slope, that of the form; an edge between them has none.
    """
    slopes = [(y[_SIDE:] - y[:_SIDE]) / (x[_SIDE:] - x[:_SIDE]) for x, y in zip(away, level, strict=True)]
    slope = float(np.median(slopes))
    return max(float(np.median(y[_SIDE:] - slope * x[_SIDE:])) for x, y in zip(away, level, strict=True))


def _is_land(points: Indices, sign: float, height: Floats, level: Floats, reach: int) -> bool:
    """Whether a run is what is left between two slots: beyond both the readings are level with it again."""
    own, top = float(np.median(sign * level[points])), float(np.max(sign * height[points]))
    found = []
    for end, way in ((points[0], -1), (points[-1], 1)):
        outward = sign * np.take(level, end + way * np.arange(1, reach + 1), mode="wrap")
        found.append(_beyond_slot(outward, own, _RISE * top))
    (near, one), (far, other) = found
    between = (one * far + other * near) / (near + far)
    return bool(abs(own - between) <= max(_LEVEL * top, FOOT))


def _beyond_slot(level: Floats, own: float, rise: float) -> tuple[int, float]:
    """Distance and level of the first readings an edge above those that fell; infinite for none."""
    few = sliding_window_view(level, _FEW)
    lowest, highest, typical = few.min(axis=1), few.max(axis=1), np.median(few, axis=1)
    fallen = int(np.argmax(highest <= own - rise))  # 0 where none did, and there the run ends
    edge = lowest[fallen + _SIDE :] - highest[fallen:-_SIDE] >= rise
    if not np.any(edge):
        return 1, np.inf
    first = fallen + int(np.argmax(edge)) + _SIDE
    behind = first + int(np.argmax(typical[first : first + _SIDE]))
    return behind, float(typical[behind])


def _width(points: Indices, angle: Floats) -> float:
    """Angle from the first to the last point of a run, rad; of several turns as the readings lie."""
    turn = 2 * np.pi * np.ceil((angle[-1] - angle[0]) / (2 * np.pi) - 1e-9)
    place = angle[points]
    return float(np.ptp(np.where(points < points[0], place + turn, place)))
