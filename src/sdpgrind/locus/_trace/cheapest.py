"""Which branch is the cheapest, and whether many points are as good."""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np
from scipy import optimize

from sdpgrind.locus._trace.trace import ROUNDING, Branch, Tracer

COMPARED, BESIDE = 33, 1e-6
"""Places at which the costs of two branches are compared, between ends of branches; how far from the ends."""
CLOSE_BY = 0.01
"""Of a place, where an end of a branch is there, too."""
EQUAL = 1e-10
"""Costs, scaled."""


def cheapest(tracer: Tracer, branches: list[Branch]) -> list[tuple[float, float, int]]:
    """Parts of the range, (low, high, which branch is of least cost there); where there is none, none."""
    parts: list[tuple[float, float, int]] = []
    for low, high in pairwise(
        _distinct(end for branch in branches for end in (branch[0].low, branch[-1].high))
    ):
        alive = [
            b
            for b, branch in enumerate(branches)
            if branch[0].low <= low + ROUNDING and branch[-1].high >= high - ROUNDING
        ]
        if parts and parts[-1][2] in alive:  # where costs are equal, the branch goes on
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
    """Where a branch becomes cheaper than another, between two places."""

    def gap(place: float) -> float:
        return tracer.cost(old, place) - tracer.cost(new, place)

    return low if gap(low) >= 0 else float(optimize.brentq(gap, low, high, xtol=1e-15))


def is_degenerate(tracer: Tracer, branches: list[Branch]) -> bool:
    """Whether many points are as good somewhere, and none that is alone is as good, there or close by."""
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
    """By rising place, without those that are the same but for rounding."""
    found: list[float] = []
    for place in sorted(places):
        if not found or place > found[-1] + ROUNDING:
            found.append(place)
    return found
