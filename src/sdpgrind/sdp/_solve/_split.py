"""Lines of cost of a move that does another thing at each end of a cell: two, each with what is done at one end.

Where only the control differs it may go over from one end to the other, or jump to another minimum. Then half of the way costs
more than the line says, and the least of two lines may be nearer to what the best of both ends costs in the middle.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._solve.kernels import TIE_REL
from sdpgrind.sdp._solve.kinks import Lines, Spans
from sdpgrind.sdp._solve.steps import Steps
from sdpgrind.sdp._transitions.menu import levels_of


class Try(NamedTuple):
    """A choice, for each of some lines, somewhere in its cell (0: left node, 1: right node)."""

    part: float
    entry: Ints
    control: Floats


def split(lines: Lines, steps: Steps) -> Lines:
    """Replace those lines."""
    two = _doubtful(lines, steps)
    if not np.any(two):
        return lines
    some = lines.select(two)
    left, right = _choices(some, 0, steps), _choices(some, 1, steps)
    middles = [_half_way(some, steps), left[0]._replace(part=0.5), right[0]._replace(part=0.5)]
    costs = _costs(some, [*left, *right, *middles], steps)
    pair = [_carried(some, 0, left, costs[:2]), _carried(some, 1, right, costs[2:4])]
    apart = two[two] = _nearer(some, pair, np.min(costs[4:], axis=0))
    kept = [lines.select(~two), *(line.select(apart & np.isfinite(line.cost).all(axis=1)) for line in pair)]
    return Lines(*(np.concatenate(columns) for columns in zip(*kept, strict=True)))


def _doubtful(lines: Lines, steps: Steps) -> Any:
    """Lines with another entry at each end, and those that half of the way between the controls of both ends would belie."""
    apart = lines.entry[:, 0] != lines.entry[:, 1]
    differ = lines.differ & ~apart
    some = lines.select(differ)
    chord = some.cost.mean(axis=1)
    half = _costs(some, [_half_way(some, steps)], steps)[0]
    apart[differ] = half > chord + TIE_REL * np.abs(chord)
    return apart


def _half_way(lines: Lines, steps: Steps) -> Try:
    """The control half-way between those of both ends, or the level next to it where only the levels count."""
    control = lines.control.mean(axis=1)
    for k, move in enumerate(steps.problem.moves):
        here = lines.act == k
        if move.levels and not move.levels.search and np.any(here):
            levels = levels_of(move.levels)[0]
            middles = (levels[1:] + levels[:-1]) / 2
            control[here] = levels[np.searchsorted(middles, control[here])]
    return Try(0.5, lines.entry[:, 0], control)


def _nearer(lines: Lines, pair: list[Lines], middle: Floats) -> Any:
    """Whether the least of two lines is nearer than one to the best that is known in the middle."""
    one, *each = (line.cost.mean(axis=1) for line in (lines, *pair))
    return (lines.entry[:, 0] != lines.entry[:, 1]) | (np.abs(np.minimum(*each) - middle) < np.abs(one - middle))


def _choices(lines: Lines, end: int, steps: Steps) -> list[Try]:
    """What is done at one end, tried at the other: with the same control, and with that which goes on as it came."""
    far, entry, held = 1 - end, lines.entry[:, end], lines.control[:, end]
    return [Try(far, entry, held), Try(far, entry, _within(lines.act, held, lines.onward[:, far], steps))]


def _carried(lines: Lines, end: int, choices: list[Try], costs: Floats) -> Lines:
    """Lines of what is done at one end, the other end being the better of two choices."""
    cost, control, onward = lines.cost.copy(), lines.control.copy(), costs[1] < costs[0]
    cost[:, 1 - end] = np.minimum(*costs)
    control[:, 1 - end] = np.where(onward, choices[1].control, choices[0].control)
    return lines._replace(cost=cost, control=control, entry=np.stack([choices[0].entry] * 2, axis=1))


def _within(act: Ints, held: Floats, onward: Floats, steps: Steps) -> Floats:
    """Controls of moves that go on from `held`, kept inside its regime."""
    levels = [move.levels for move in steps.problem.moves]
    ends = np.array([[one.low, one.high] if one else [0.0, 0.0] for one in levels])[act]
    spans = Spans.of(steps.problem).select(act)
    low, high = spans.around(held)
    return np.where(spans.search, np.clip(onward, np.maximum(low, ends[:, 0]), np.minimum(high, ends[:, 1])), held)


def _costs(lines: Lines, tries: Sequence[Try], steps: Steps) -> Floats:
    """Cost of the moves of `lines` for each of several choices, [choice, line]; all choices of a move in one go."""
    x = np.asarray([steps.grid.coordinate(0, lines.cell + one.part) for one in tries])
    entry, control = np.array([one.entry for one in tries]), np.array([one.control for one in tries])
    row, mode = (np.broadcast_to(column, x.shape) for column in (lines.row, lines.mode))
    cost = np.empty(x.shape)
    for k in np.unique(lines.act):
        here = np.broadcast_to(lines.act == k, x.shape)
        cost[here] = steps.cost(int(k), row[here], mode[here], (x[here],), entry[here], control[here])
    return cost
