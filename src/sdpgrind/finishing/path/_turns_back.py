"""Turns right back on the way of a path, which no blend rounds: the path goes aside by a part of a pitch."""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._square import Square

ASIDE = 0.25  # pitches, chosen: a way that would turn right back goes aside by that first
LEAST = 1e-300  # chosen: a leg of no length divides by that
BACK = 0.2  # chosen: half of the sum of unit tangents that turn right back, 157 degrees or more


def move_between(
    square: Square, before: Floats, here: Floats, goal: Floats, after: Floats, pitch: float
) -> Floats:
    """Places (n, 2) between two passes: aside where the move would turn right back at an end of it."""
    out = beside(square, before, here, goal, pitch)
    start = out[-1] if len(out) else here
    if _turns_back(square, start, goal, after):
        out = np.append(out, [_aside(square, goal, after, pitch)], axis=0)
    return out


def beside(square: Square, before: Floats, here: Floats, after: Floats, pitch: float) -> Floats:
    """Place (1, 2) to go aside to from `here` where a way would turn right back there; else none."""
    if not _turns_back(square, before, here, after):
        return np.empty((0, 2))
    return _aside(square, here, before, pitch)[None]


def _turns_back(square: Square, before: Floats, here: Floats, after: Floats) -> bool:
    by_s, by_c = square.tangents(here[:1], here[1:])
    legs = [(step[0] * by_s + step[1] * by_c)[0] for step in (here - before, after - here)]
    one, other = (leg / max(float(np.linalg.norm(leg)), LEAST) for leg in legs)
    return bool(np.linalg.norm(one + other) < 2 * BACK)


def _aside(square: Square, here: Floats, other: Floats, pitch: float) -> Floats:
    """Place beside `here`, at a right angle to the way from `other`, towards the middle of the square."""
    by_s, by_c = (each[0] for each in square.tangents(here[:1], here[1:]))
    E, F, G = by_s @ by_s, by_s @ by_c, by_c @ by_c
    a, b = here - other
    way = np.array([-(F * a + G * b), E * a + F * b])  # at a right angle on the surface
    way *= ASIDE * pitch / np.linalg.norm(way[0] * by_s + way[1] * by_c)
    sides = here + way, here - way
    return min(sides, key=lambda each: float(np.hypot(*(each - 0.5))))
