"""Sampling of a profile: turns, points of a turn, widest gap, determined harmonics."""

from math import ceil, cos, inf, pi

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_EVEN = 1e-9  # chosen: largest deviation from an even grid, in steps
_WRAPPED = 2.02 * pi  # chosen: rad; largest span of angles that restart at each turn
_ROUND = 3 * pi  # derived: rad; unwrapped readings of a single turn span less
_SMALL = pi / 4  # derived: rad; steps in order are smaller, half of shuffled ones larger
_NET = 0.5  # chosen: net over total rotation; shuffled readings go to and fro
_ROUNDING = 1e-6  # chosen: relative accuracy of the points of a turn of moved samples


def even_turn(size: int) -> Floats:
    """One turn on an even grid from 0 on, rad."""
    return np.asarray(np.linspace(0.0, 2 * pi, size, endpoint=False), dtype=float)


def unwrapped_turns(angle: Floats) -> Floats:
    """Angles unwrapped where they restart at each turn of a spindle in one sense; else unchanged."""
    unwrapped = np.unwrap(angle)
    if _one_way(angle):
        return angle
    return (
        unwrapped
        if _one_way(unwrapped) or (_mostly_one_way(unwrapped) and np.ptp(angle) <= _WRAPPED)
        else angle
    )


def _one_way(angle: Floats) -> bool:
    """Whether all steps have one sense."""
    step = np.diff(angle)
    return bool(np.all(step >= 0) or np.all(step <= 0))


def _mostly_one_way(angle: Floats) -> bool:
    """Whether small steps, some backwards as of a trembling encoder, go round more than once."""
    step = np.diff(angle)
    small = np.median(np.abs(step)) < _SMALL
    return bool(small and np.abs(step.sum()) > max(_ROUND, _NET * np.abs(step).sum()))


def turns_of(angle: Floats) -> float:
    """Turns covered by angles, including the last step."""
    step = np.diff(np.sort(angle))
    return float((np.sum(step) + np.median(step)) / (2 * pi))


def widest_gap(part_angle: Floats) -> float:
    """Widest angle without a sample, over all turns together, rad."""
    place = np.sort(np.mod(part_angle, 2 * pi))
    return float(max(np.diff(place).max(initial=0.0), place[0] + 2 * pi - place[-1]))


def supported(gap: float) -> int:
    """Highest harmonic determined by samples with this widest gap: less than half a wave in it."""
    return max(ceil(pi / gap * (1 - 1e-9)) - 1, 0)


def rise(upr: float, gap: float) -> float:
    """Largest value of a wave between samples over that at samples: at its peak it is at least a cosine."""
    half = upr * gap / 2
    return 1 / cos(half) if half < pi / 2 * (1 - 1e-12) else inf


def is_even(part_angle: Floats, within: float = _EVEN) -> bool:
    """Whether the samples are one turn on an even grid that starts at 0, in order, within so many steps."""
    grid = even_turn(part_angle.size)
    return bool(np.abs(part_angle - grid).max() <= within * grid[1])


def highest_degree(points: float) -> int:
    """Highest harmonic below half of the points of a turn."""
    return max(ceil(points / 2 * (1 - _ROUNDING)) - 1, 0)


def checked_degree(name: str, upr_max: object, points: float) -> int:
    """A requested harmonic, checked against the points of a turn."""
    degree = checks.count(name, upr_max)
    if degree > points / 2 * (1 + _ROUNDING):
        raise checks.refuse(
            name,
            f"<= {points / 2:.6g}, half of the points of one turn: beyond, waves look like others",
            degree,
        )
    return degree
