"""Cells of one axis in which the best action changes, with the cost of each relevant action at both ends.

Between two nodes the value-to-go is the least cost of several actions. Each cost is smooth, linear to second
order; their minimum has a kink, where linear interpolation is of first order only. Cells in which the action
changes keep one line of cost for each action; a look-up takes the least.

A move may differ at the ends of a cell. A control may vary from one end to the other, or jump to another
minimum: then the cost half-way is above the line. Such a line is replaced by two, each with the action of one
end (`split`), if their least is nearer to the best cost in the middle.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._solve.kernels import TIE_REL
from sdpgrind.sdp._solve.steps import Steps
from sdpgrind.sdp._transitions.menu import levels_of

# chosen: a control jumps inside a cell if its change exceeds LARGE of its interval, or the first number of a
# pair in JUMPS and the second times its change in the adjoining cells; smaller shares split smooth lines
LARGE, JUMPS = 0.1, ((1e-4, 1.1), (1e-5, 4.0))


class Kinks(NamedTuple):
    """Lines of cost in cells where the action changes.

    `at[row, mode, cell]` is the number of such a cell (-1: none), ``start[number]:start[number + 1]`` its
    lines; `cost[line, end]` ($), `control[line, end]` at the left and right node; `act[line]` (stops -1, -2,
    ..., moves 0, 1, ...); `entry[line]` of the lists.
    """

    at: npt.NDArray[np.int32]
    start: npt.NDArray[np.int32]
    cost: Floats
    control: Floats
    act: npt.NDArray[np.int32]
    entry: npt.NDArray[np.int32]

    @classmethod
    def none(cls, shape: tuple[int, int, int]) -> "Kinks":
        """Return empty kinks for `shape` = (rows, modes, cells)."""
        empty = np.zeros(0, dtype=np.int32)
        return cls(
            np.full(shape, -1, np.int32),
            np.zeros(1, np.int32),
            np.zeros((0, 2)),
            np.zeros((0, 2)),
            empty,
            empty,
        )


class Lines(NamedTuple):
    """Lines of cost in the order found: (row, mode, cell), action (stops -1, -2, ...), and both ends."""

    row: Ints
    mode: Ints
    cell: Ints
    act: Ints
    entry: Ints  # [line, end]
    control: Floats  # [line, end]
    cost: Floats  # [line, end]
    differ: Any  # whether the move differs at the ends
    onward: Floats  # [line, end]: control of the other end, extrapolated to this one from the adjoining cell

    def select(self, kept: Any) -> "Lines":
        """Return some of the lines."""
        return Lines(*(column[kept] for column in self))


class Spans(NamedTuple):
    """Continuous control of each move: length of its interval (inf without), breaks [move, k], search."""

    length: Floats
    breaks: Floats  # padded with inf
    search: Any

    @classmethod
    def of(cls, problem: Problem) -> "Spans":
        """Read a problem."""
        levels = [move.levels for move in problem.moves]
        breaks = [sorted(one.breaks) if one else [] for one in levels]
        most = max(map(len, breaks))
        filled = [[*some, *[np.inf] * (most - len(some))] for some in breaks]
        length = np.array([one.high - one.low if one else np.inf for one in levels])
        return cls(length, np.array(filled), np.array([one is None or one.search for one in levels]))

    def select(self, move: Any) -> "Spans":
        """Return those of an array of moves."""
        return Spans(*(column[move] for column in self))

    def jumps(self, four: tuple[Floats, ...]) -> Any:
        """Whether a control jumps, or meets a break, between the middle two of four nodes (NaN: unknown)."""
        left, right = four[1][..., None], four[2][..., None]
        low, high = np.minimum(left, right), np.maximum(left, right)
        met = ((low < self.breaks) & (high >= self.breaks)) | ((low <= self.breaks) & (high > self.breaks))
        return _jumps(four, self.length) | met.any(axis=-1)

    def around(self, control: Floats) -> tuple[Floats, Floats]:
        """Return the nearest breaks below and above a control of each move (inf without)."""
        below, above = self.breaks < control[:, None], self.breaks > control[:, None]
        low = np.where(below, self.breaks, -np.inf).max(axis=1, initial=-np.inf)
        return low, np.where(above, self.breaks, np.inf).min(axis=1, initial=np.inf)


@dataclass
class Changes:
    """Collects lines during the solve of stages, when the costs of single moves are known.

    `shared`: moves evaluated for mode 0 only. `history`: costs [row, move, mode, node] of a small problem,
    not yet evaluated.
    """

    spans: "Spans"
    shared: Any
    found: list[Lines] = field(default_factory=list)
    history: tuple[Any, ...] | None = None

    @classmethod
    def of(cls, problem: Problem, shared: Any) -> "Changes":
        """Begin for a problem."""
        return cls(Spans.of(problem), np.asarray(shared))

    def add(
        self,
        row: int,
        stop_q: Floats,
        moves: tuple[Floats, Floats, Any],
        best: Any,
        entry: Any,
        control: Floats,
    ) -> None:
        """Collect the lines of one row: costs of stops [stop, mode, node] and moves [move, mode, node]."""
        mode, cell = np.nonzero(_changes(best, entry, control, self.spans))
        if cell.size:
            own = np.where(self.shared[:, None], 0, mode)
            self.found.append(_lines(Cells(np.full(cell.size, row), mode, cell), (mode, own), stop_q, moves))

    def all(self) -> Lines | None:
        """Return all lines, without those that are nowhere the least."""
        if self.history is not None:
            self._look_through(*self.history)
            self.history = None
        if not self.found:
            return None
        return Lines(*(np.concatenate(columns) for columns in zip(*self.found, strict=True)))

    def shifted(self, other: "Changes | None") -> "Changes":
        """Return these lines shifted by one row, after those of the base."""
        later = [lines._replace(row=lines.row + 1) for lines in _listed(self)]
        return Changes(self.spans, self.shared, (_listed(other) if other else []) + later)

    def _look_through(
        self, stop_q: Floats, moves: tuple[Floats, Floats, Any], best: Any, entry: Any, control: Floats
    ) -> None:
        """Collect the lines of all rows of a problem of one mode: rows take the place of modes."""
        row, cell = np.nonzero(_changes(best, entry, control, self.spans))
        if cell.size:
            own = np.broadcast_to(row, (self.spans.length.size, row.size))
            self.found.append(_lines(Cells(row, np.zeros_like(row), cell), (row, own), stop_q, moves))


class Cells(NamedTuple):
    """Cells in which the action changes."""

    row: Ints
    mode: Ints
    cell: Ints


def _lines(cells: Cells, at: tuple[Ints, Ints], stop_q: Floats, moves: tuple[Floats, Floats, Any]) -> Lines:
    """Lines of all actions in these cells; `at` are the indices of the costs of stops and of each move."""
    ends = np.stack([cells.cell, cells.cell + 1], axis=1)
    stop, move = np.arange(stop_q.shape[0])[:, None, None], np.arange(moves[0].shape[0])[:, None, None]
    stops = stop_q[stop, at[0][:, None], ends]
    found, control, entry = (array[move, at[1][:, :, None], ends] for array in moves)
    # At an end the node itself: no change.
    beside = np.clip(ends + np.array([-1, 1]), 0, moves[0].shape[2] - 1)
    outer = moves[1][move, at[1][:, :, None], beside]
    # NaN: no continuous control.
    differ = (np.abs(np.diff(control)[..., 0]) > 0) | (entry[..., 0] != entry[..., 1])
    split = np.concatenate([np.zeros(stops.shape[:2], bool), differ])
    onward = np.concatenate([np.zeros(stops.shape), 2 * control[..., ::-1] - outer[..., ::-1]])
    cost, nothing = np.concatenate([stops, found]), np.zeros(stops.shape)
    control, entry = np.concatenate([nothing, control]), np.concatenate([nothing.astype(np.int32), entry])
    lower = _lower(cost)
    split &= lower == 0
    kept = (lower >= 0) & (lower < 2)  # least or second
    line, number = np.nonzero(kept)
    act = np.where(line < stop.size, -1 - line, line - stop.size)
    row, mode, cell = (column[number] for column in cells)
    return Lines(row, mode, cell, act, entry[kept], control[kept], cost[kept], split[kept], onward[kept])


def _listed(changes: Changes) -> list[Lines]:
    lines = changes.all()
    return [] if lines is None else [lines]


def _changes(best: Any, entry: Any, control: Floats, spans: Spans) -> Any:
    """Mask [mode, cell] of cells whose nodes differ in move or entry, or by a jump or break of control."""
    same = best[:, 1:] == best[:, :-1]
    going = same & (best[:, 1:] >= 0)
    around = np.pad(np.where(best < 0, np.nan, control), ((0, 0), (1, 1)), constant_values=np.nan)
    four = tuple(around[:, k : around.shape[1] - 3 + k] for k in range(4))
    jump = spans.select(np.maximum(best[:, 1:], 0)).jumps(four)
    return ~same | (going & ((entry[:, 1:] != entry[:, :-1]) | jump))


def _jumps(four: tuple[Floats, ...], span: Floats) -> Any:
    """Whether a control jumps between the middle two of four nodes (NaN: unknown)."""
    with np.errstate(invalid="ignore"):
        before, here, after = (np.abs(b - a) for a, b in itertools.pairwise(four))
        beside = np.fmax(before, after)
        steep = [(here > share * span) & (here > times * beside) for share, times in JUMPS]
        return (here > LARGE * span) | np.any(steep, axis=0)


def _lower(cost: Floats) -> Any:
    """Number of lines that are lower at both ends (ties: the first), [line, number]; -1: unknown cost."""
    finite = np.asarray(np.isfinite(cost).all(axis=2))
    one, other = cost[:, None], cost[None]
    earlier = np.tri(cost.shape[0], k=-1, dtype=bool).T[:, :, None]
    lower = np.all(one <= other, axis=3) & (np.any(one < other, axis=3) | earlier)
    return np.where(finite, np.sum(finite[:, None] & lower, axis=0), -1)


def sorted_kinks(lines: Lines, shape: tuple[int, int, int]) -> Kinks:
    """Number the cells and sort their lines: stops first, then moves in their order."""
    flat = np.ravel_multi_index((lines.row, lines.mode, lines.cell), shape)
    rank = np.where(lines.act < 0, -1 - lines.act - 2**15, lines.act)
    order = np.lexsort((lines.entry[:, 0], rank, flat))
    cells, start = np.unique(flat[order], return_index=True)
    kinks = Kinks.none(shape)
    kinks.at.ravel()[cells] = np.arange(cells.size)
    return Kinks(
        kinks.at,
        np.append(start, flat.size).astype(np.int32),
        np.ascontiguousarray(lines.cost[order]),
        np.ascontiguousarray(lines.control[order]),
        lines.act[order].astype(np.int32),
        lines.entry[order, 0].astype(np.int32),
    )


class Try(NamedTuple):
    """Trial action of some lines, at a position in the cell (0: left node, 1: right node)."""

    part: float
    entry: Ints
    control: Floats


def split(lines: Lines, steps: Steps) -> Lines:
    """Replace lines of moves that differ at the ends by two, where these are nearer to the best cost."""
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
    """Lines with different entries at the ends, and those below the cost of the control half-way."""
    apart = lines.entry[:, 0] != lines.entry[:, 1]
    differ = lines.differ & ~apart
    some = lines.select(differ)
    chord = some.cost.mean(axis=1)
    half = _costs(some, [_half_way(some, steps)], steps)[0]
    apart[differ] = half > chord + TIE_REL * np.abs(chord)
    return apart


def _half_way(lines: Lines, steps: Steps) -> Try:
    """Control half-way between those of both ends; the nearest level without search."""
    control = lines.control.mean(axis=1)
    for k, move in enumerate(steps.problem.moves):
        here = lines.act == k
        if move.levels and not move.levels.search and np.any(here):
            levels = levels_of(move.levels)[0]
            middles = (levels[1:] + levels[:-1]) / 2
            control[here] = levels[np.searchsorted(middles, control[here])]
    return Try(0.5, lines.entry[:, 0], control)


def _nearer(lines: Lines, pair: list[Lines], middle: Floats) -> Any:
    """Whether the least of two lines is nearer than one line to the best known cost in the middle."""
    one, *each = (line.cost.mean(axis=1) for line in (lines, *pair))
    return (lines.entry[:, 0] != lines.entry[:, 1]) | (
        np.abs(np.minimum(*each) - middle) < np.abs(one - middle)
    )


def _choices(lines: Lines, end: int, steps: Steps) -> list[Try]:
    """Action of one end tried at the other: with the same control, and with the extrapolated one."""
    far, entry, held = 1 - end, lines.entry[:, end], lines.control[:, end]
    return [Try(far, entry, held), Try(far, entry, _within(lines.act, held, lines.onward[:, far], steps))]


def _carried(lines: Lines, end: int, choices: list[Try], costs: Floats) -> Lines:
    """Lines of the action of one end; at the other end the better of two choices."""
    cost, control, onward = lines.cost.copy(), lines.control.copy(), costs[1] < costs[0]
    cost[:, 1 - end] = np.minimum(*costs)
    control[:, 1 - end] = np.where(onward, choices[1].control, choices[0].control)
    return lines._replace(cost=cost, control=control, entry=np.stack([choices[0].entry] * 2, axis=1))


def _within(act: Ints, held: Floats, onward: Floats, steps: Steps) -> Floats:
    """Controls `onward`, clamped to the regime of `held`."""
    levels = [move.levels for move in steps.problem.moves]
    ends = np.array([[one.low, one.high] if one else [0.0, 0.0] for one in levels])[act]
    spans = Spans.of(steps.problem).select(act)
    low, high = spans.around(held)
    return np.where(
        spans.search, np.clip(onward, np.maximum(low, ends[:, 0]), np.minimum(high, ends[:, 1])), held
    )


def _costs(lines: Lines, tries: Sequence[Try], steps: Steps) -> Floats:
    """Cost of the moves of `lines` for several choices, [choice, line]; all choices of a move at once."""
    x = np.asarray([steps.grid.coordinate(0, lines.cell + one.part) for one in tries])
    entry, control = np.array([one.entry for one in tries]), np.array([one.control for one in tries])
    row, mode = (np.broadcast_to(column, x.shape) for column in (lines.row, lines.mode))
    cost = np.empty(x.shape)
    for k in np.unique(lines.act):
        here = np.broadcast_to(lines.act == k, x.shape)
        cost[here] = steps.cost(int(k), row[here], mode[here], (x[here],), entry[here], control[here])
    return cost
