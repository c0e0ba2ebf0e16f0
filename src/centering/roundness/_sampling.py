"""How the samples of a profile lie: turns, points of a turn, the widest gap, and what harmonics they can tell."""

from math import ceil, cos, inf, pi

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_EVEN = 1e-9  # of a step
_WRAPPED = 2.02 * pi  # that angles span which start again at each turn, rad
_ROUND = 3 * pi  # a turn and a half: readings of one turn that are put on end cannot go so far
_SMALL = pi / 4  # steps of readings in order; of shuffled ones half are larger
_NET = 0.5  # of the way: shuffled readings go to and fro
_ROUNDING = 1e-6  # of the points of a turn, which samples that a step has moved tell no better


def even_turn(size: int) -> Floats:
    """One turn on an even grid from 0 on, rad."""
    return np.asarray(np.linspace(0.0, 2 * pi, size, endpoint=False), dtype=float)


def going_on(angle: Floats) -> Floats:
    """Angles put on end where they start again at each turn while the spindle turns one way; else as they are."""
    unwrapped = np.unwrap(angle)
    if _one_way(angle):
        return angle
    return (
        unwrapped
        if _one_way(unwrapped) or (_mostly_one_way(unwrapped) and np.ptp(angle) <= _WRAPPED)
        else angle
    )


def _one_way(angle: Floats) -> bool:
    step = np.diff(angle)
    return bool(np.all(step >= 0) or np.all(step <= 0))


def _mostly_one_way(angle: Floats) -> bool:
    """Whether small steps, some of them backwards as of an encoder that trembles, go round more than once."""
    step = np.diff(angle)
    small = np.median(np.abs(step)) < _SMALL
    return bool(small and np.abs(step.sum()) > max(_ROUND, _NET * np.abs(step).sum()))


def turns_of(angle: Floats) -> float:
    """Turns that angles cover, the last step included."""
    step = np.diff(np.sort(angle))
    return float((np.sum(step) + np.median(step)) / (2 * pi))


def widest_gap(part_angle: Floats) -> float:
    """Widest angle without a sample, of all turns together, rad."""
    place = np.sort(np.mod(part_angle, 2 * pi))
    return float(max(np.diff(place).max(initial=0.0), place[0] + 2 * pi - place[-1]))


def supported(gap: float) -> int:
    """Highest harmonic that samples with that widest gap tell surely: less than one half for each gap."""
    return max(ceil(pi / gap * (1 - 1e-9)) - 1, 0)


def rise(upr: float, gap: float) -> float:
    """How much larger than at the samples a wave of that degree can be between them: it is a cosine at least near its peak."""
    half = upr * gap / 2
    return 1 / cos(half) if half < pi / 2 * (1 - 1e-12) else inf


def is_even(part_angle: Floats) -> bool:
    """Whether the samples are one turn on an even grid that starts at 0, in order."""
    grid = even_turn(part_angle.size)
    return bool(np.abs(part_angle - grid).max() <= _EVEN * grid[1])


def highest_degree(points: float) -> int:
    """Highest harmonic below half of the points of a turn."""
    return max(ceil(points / 2 * (1 - _ROUNDING)) - 1, 0)


def checked_degree(name: str, upr_max: object, points: float) -> int:
    """A harmonic that was asked for, which the points of a turn must allow."""
    degree = checks.count(name, upr_max)
    if degree > points / 2 * (1 + _ROUNDING):
        raise checks.refuse(
            name,
            f"<= {points / 2:.6g}, half of the points of one turn: beyond, waves look like others",
            degree,
        )
    return degree
