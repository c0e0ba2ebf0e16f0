"""Sequence and directions of pieces for the least travel between them, on a table of costs.

A piece k is 2 k where it goes forward, 2 k + 1 backwards: its state. The table tells what it costs to go from
the end of one state to the start of another; both ends of the sequence are free.
"""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._samples import Ints

EXACT = 12  # source: specification; up to so many pieces the sequence is exact
STARTS = 64  # chosen: sequences by the nearest neighbour that are tried
# chosen: of them, the shortest that are improved; fewer of many pieces, so that 400 take seconds. measured:
# of 60 times 12 short pieces in a square 88 % are exact, 0.2 % longer in the mean, 2.8 % at most
IMPROVED, WORK = 8, 800
SEGMENT = 3  # source: Or (1976); pieces that are moved together
LESS = 1e-9  # of the cost, chosen: less is rounding


class Order(NamedTuple):
    """States in sequence, (n,), and whether no sequence costs less."""

    states: Ints
    exact: bool

    @property
    def pieces(self) -> tuple[int, ...]:
        """Number of each piece, in sequence."""
        return tuple((self.states // 2).tolist())

    @property
    def backwards(self) -> tuple[bool, ...]:
        """Whether each of them goes backwards."""
        return tuple((self.states % 2 == 1).tolist())


def as_given(count: int) -> Ints:
    """Return the states of `count` pieces in their own sequence, all forward."""
    return np.arange(0, 2 * count, 2)


def best_order(cost: Floats) -> Order:
    """Return the order of n pieces by a table (2 n, 2 n): exact for up to `EXACT` pieces, else improved.

    The order as given and up to eight by the nearest neighbour are improved by 2-opt and Or-opt until no
    reversal of a part and no part of up to three pieces elsewhere makes them cheaper; never dearer than as
    given. Of orders that cost the same the first is that as given, then the one with more pieces forward.
    """
    count = len(cost) // 2
    exact = count <= EXACT
    given = as_given(count)
    found = [least(cost)] if exact else [improved(cost, each) for each in (given, *_nearest(cost))]
    both = [given, *(each for one in found for each in (one, one[::-1] ^ 1))]
    total = np.array([cost_of(cost, each) for each in both])
    cheap = total <= total.min() + LESS * total[0]
    backwards = np.where(cheap, np.sum(np.array(both) % 2, axis=1), np.inf)
    return Order(given if cheap[0] else both[int(np.argmin(backwards))], exact)


def cost_of(cost: Floats, states: Ints) -> float:
    """Return the cost of a sequence of states."""
    return float(cost[states[:-1], states[1:]].sum())


def least(cost: Floats) -> Ints:
    """Return the states of the cheapest sequence, by dynamic programming over subsets (Held and Karp).

    Of several the one with the least first state. A value is the cost from a state through all others of a
    subset to the end.
    """
    count = len(cost) // 2
    whole = 2**count - 1
    value = np.full((whole + 1, 2 * count), np.inf)
    after = np.zeros((whole + 1, 2 * count), dtype=np.int64)
    piece = np.repeat(np.arange(count), 2)
    value[2**piece, np.arange(2 * count)] = 0.0
    for subset in range(1, whole):
        other = np.flatnonzero(~(subset >> piece) & 1)
        through = cost[other].T + value[subset][:, None]
        larger = subset | 2 ** piece[other]
        after[larger, other] = through.argmin(axis=0)
        value[larger, other] = through.min(axis=0)
    cheap = value[whole] <= value[whole].min() * (1 + LESS)
    states, subset = [int(cheap.argmax())], whole
    for _ in range(count - 1):
        states.append(int(after[subset, states[-1]]))
        subset ^= 2 ** int(piece[states[-2]])
    return np.array(states)


def _nearest(cost: Floats) -> list[Ints]:
    """The cheapest sequences in which the nearest state follows, from starts spread over all states."""
    starts = np.unique(np.linspace(0, len(cost) - 1, min(len(cost), STARTS)).astype(int))
    row, left = np.arange(len(starts)), np.ones((len(starts), len(cost)), dtype=bool)
    states = [starts]
    for _ in range(len(cost) // 2 - 1):
        left[row, states[-1]] = left[row, states[-1] ^ 1] = False
        states.append(np.where(left, cost[states[-1]], np.inf).argmin(axis=1))
    found = np.stack(states, axis=1)
    shortest = np.argsort([cost_of(cost, each) for each in found], kind="stable")
    return list(found[shortest[: max(1, min(IMPROVED, 2 * WORK // len(cost)))]])


def improved(cost: Floats, states: Ints) -> Ints:
    """Return a sequence that neither a reversal of a part nor a part moved elsewhere makes cheaper."""
    enough = LESS * cost_of(cost, states)
    while True:
        costs = OrderCosts(cost, states)
        moves = [
            costs.reversed(),
            *(costs.moved(size) for size in range(1, min(SEGMENT, len(states) - 1) + 1)),
        ]
        saved, other = max(moves, key=lambda each: each[0])
        if saved <= enough:
            return states
        states = other


class OrderCosts:
    """Costs from every place i of a sequence to every other place j; places are 1 to n, 0 and n + 1 cost 0.

    ``there[i, j]``: both pieces in their directions; ``turned[i, j]``: j in the other direction;
    ``back[i, j]``: i in the other direction. ``link[i]``: from i to i + 1. ``inside[k]``: what the first k
    links cost more in the other direction.
    """

    def __init__(self, cost: Floats, states: Ints) -> None:
        self._states, count = states, len(states)
        self.there, self.turned, self.back = np.zeros((3, count + 2, count + 2))
        inner = slice(1, -1), slice(1, -1)
        self.there[inner] = cost[np.ix_(states, states)]
        self.turned[inner] = cost[np.ix_(states, states ^ 1)]
        self.back[inner] = cost[np.ix_(states ^ 1, states)]
        self.link = np.diag(self.there, 1)
        own, other = self.link[1:-1], cost[states[1:] ^ 1, states[:-1] ^ 1]
        self.inside = np.append(0.0, np.cumsum(other - own))

    def reversed(self) -> tuple[float, Ints]:
        """Return what the best reversal of a part saves, and the sequence with it."""
        apart = self.link[:-1, None] + self.link[1:]
        joined = self.turned[:-2, 1:-1] + self.back[1:-1, 2:] + self.inside - self.inside[:, None]
        saved = np.triu(apart - joined)  # below: no part, nothing is saved
        i, j = np.unravel_index(int(saved.argmax()), saved.shape)
        other = self._states.copy()
        other[i : j + 1] = other[i : j + 1][::-1] ^ 1
        return float(saved[i, j]), other

    def moved(self, size: int) -> tuple[float, Ints]:
        """Return what the best move of `size` pieces elsewhere saves, turned or not, and that sequence."""
        count = len(self._states)
        first, gap = np.arange(1, count - size + 2), np.arange(count + 1)
        last = first + size - 1
        out = self.link[first - 1] + self.link[last] - self.there[first - 1, last + 1]
        straight = self.there[:-1, first].T + self.there[last, 1:]
        turn = self.inside[last - 1] - self.inside[first - 1]
        turned = self.turned[:-1, last].T + self.back[first, 1:] + turn[:, None]
        saved = out[:, None] + self.link - np.minimum(straight, turned)
        saved[(gap >= first[:, None] - 1) & (gap <= last[:, None])] = -np.inf
        k, place = np.unravel_index(int(saved.argmax()), saved.shape)
        part = self._states[k : k + size]
        if turned[k, place] < straight[k, place]:
            part = part[::-1] ^ 1
        rest = np.delete(self._states, np.arange(k, k + size))
        return float(saved[k, place]), np.insert(rest, place - size * (place > k), part)
