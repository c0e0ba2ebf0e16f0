"""The cheapest branch at each place; degenerate problems."""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np
from scipy import optimize

from sdpgrind.locus._trace.trace import ROUNDING, Branch, Tracer

# chosen: places between two ends of branches, and their inset; fewer miss two crossings
COMPARED, BESIDE = 33, 1e-6
CLOSE_BY = 0.01  # chosen: scaled distance at which the end of a branch counts as being there
EQUAL = 1e-10  # chosen: scaled difference of equal costs; less is rounding


def cheapest(tracer: Tracer, branches: list[Branch]) -> list[tuple[float, float, int]]:
    """Return the parts of the range (low, high, cheapest branch); gaps where no branch exists."""
    parts: list[tuple[float, float, int]] = []
    for low, high in pairwise(
        _distinct(end for branch in branches for end in (branch[0].low, branch[-1].high))
    ):
        alive = [
            b
            for b, branch in enumerate(branches)
            if branch[0].low <= low + ROUNDING and branch[-1].high >= high - ROUNDING
        ]
        if parts and parts[-1][2] in alive:  # at equal costs the same branch continues
            alive.sort(key=parts[-1][2].__ne__)
        for part in _between(tracer, branches, alive, low, high):
            if parts and parts[-1][2] == part[2] and parts[-1][1] == part[0]:
                parts[-1] = (parts[-1][0], part[1], part[2])
            else:
                parts.append(part)
    return parts


def _between(
    tracer: Tracer, branches: list[Branch], alive: list[int], low: float, high: float
) -> Iterator[tuple[float, float, int]]:
    if len(alive) < 2:
        yield from ((low, high, b) for b in alive)
        return
    places = np.linspace(low, high, COMPARED)
    places[[0, -1]] += (high - low) * np.array([BESIDE, -BESIDE])
    costs = np.array([[tracer.cost(branches[b], place) for b in alive] for place in places])
    sure = np.all(np.isfinite(costs), axis=1)
    best, since = 0, low
    for k, (place, row) in enumerate(zip(places[sure], costs[sure], strict=True)):
        cheapest = int(np.argmin(row))
        if row[cheapest] < row[best] - EQUAL * tracer.system.cost_scale:
            if k:
                jump = _crossing(
                    tracer, branches[alive[best]], branches[alive[cheapest]], places[sure][k - 1], place
                )
                yield since, jump, alive[best]
                since = jump
            best = cheapest
    yield since, high, alive[best]


def _crossing(tracer: Tracer, old: Branch, new: Branch, low: float, high: float) -> float:
    """Return the place between two at which a branch becomes cheaper than another."""

    def gap(place: float) -> float:
        return tracer.cost(old, place) - tracer.cost(new, place)

    return low if gap(low) >= 0 else float(optimize.brentq(gap, low, high, xtol=1e-15))


def is_degenerate(tracer: Tracer, branches: list[Branch]) -> bool:
    """Return whether somewhere several points are optimal and no isolated one is as good nearby."""
    return any(_unmatched(tracer, branches, *flat) for flat in tracer.flat)


def _unmatched(tracer: Tracer, branches: list[Branch], place: float, cost: float) -> bool:
    near = [np.clip(place, branch[0].low, branch[-1].high) for branch in branches]
    costs = [
        tracer.cost(branch, at)
        for branch, at in zip(branches, near, strict=True)
        if abs(at - place) < CLOSE_BY
    ]
    return not min(costs, default=np.inf) <= cost + np.sqrt(EQUAL) * tracer.system.cost_scale


def _distinct(places: Iterable[float]) -> list[float]:
    """Return rising places without duplicates to rounding."""
    found: list[float] = []
    for place in sorted(places):
        if not found or place > found[-1] + ROUNDING:
            found.append(place)
    return found
