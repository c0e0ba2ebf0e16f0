"""A solved problem and what it says at a state: the moves of the table, and between two nodes that differ the better one."""

from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp import _lookup
from sdpgrind.sdp._grid import Ints
from sdpgrind.sdp._kinks import Kinks, Lines, Spans, sorted_kinks
from sdpgrind.sdp._layout import Layout
from sdpgrind.sdp._locate import Locator, Place
from sdpgrind.sdp._menu import Menu
from sdpgrind.sdp._problem import Problem
from sdpgrind.sdp._rows import Rows
from sdpgrind.sdp._stages import Table


class Solution:
    """Table, layout and, unless it was loaded from a file that cannot hold it, the problem."""

    def __init__(self, problem: Problem | None, layout: Layout, table: Table) -> None:
        self.problem, self.layout, self.table = problem, layout, table
        self.grid, self.countdown = layout.grid, layout.countdown(table.first)
        self.locator = Locator(layout, self.countdown)

    def locate(self, state: dict[str, Any]) -> Place:
        """Find states in the table, or refuse them."""
        return self.locator.locate(state)

    def begin(self, place: Place) -> tuple[int, float]:
        """Return the stage at which a located state begins, and how much time it has beyond it (0 unless late in the base)."""
        return self.countdown.begin(int(place.row[0]), float(place.time[0]))

    def value_at(self, place: Place) -> Floats:
        """Return the value-to-go ($) at located states."""
        out = self.interpolated(place.row, place.mode, place.index)
        return self.locator.with_exits(place, out + place.late)

    def interpolated(self, row: Ints, mode: Ints, index: Floats) -> Floats:
        """Return the table's value ($) at positions `index` (cells), [axis, state], of slices (row, mode)."""
        out = np.empty(row.size)
        _lookup.interpolate(self.table.value, row, mode, self.shape, index, out)
        if self.kinks.start.size > 1:
            _lookup.least_line(*self.kinks[:3], row, mode, index, out)
        return out

    def act(self, place: Place) -> tuple[Any, Any, Floats, Floats]:
        """Return move (stops are negative), entry of the lists, continuous control and gap at located states."""
        n = place.row.size
        best, entry, control, gap = np.empty(n, np.int16), np.empty(n, np.int32), np.empty(n), np.empty(n)
        t = self.table
        table, out = (t.best, t.entry, t.control, t.gap), (best, entry, control, gap)
        _lookup.act(table, self.kinks, place.row, place.mode, self.shape, place.index, out)
        outside = self.locator.outside(place)
        if np.any(outside):
            best[outside], gap[outside], control[outside] = -1, 0.0, np.nan
        return best, entry, control, gap

    def controls(self, best: Any, entry: Any, control: Floats) -> dict[str, Floats]:
        """Return the value of every control of every move, NaN where that move is not the chosen one."""
        out: dict[str, Floats] = {}
        for k, move in enumerate(self.layout.moves):
            chosen = best == k
            for name, values in [*move.lists, *([(move.level, None)] if move.level else [])]:
                column = out.setdefault(name, np.full(best.shape, np.nan))
                column[chosen] = control[chosen] if values is None else np.asarray(values)[entry[chosen]]
        return out

    def need_problem(self, purpose: str) -> Problem:
        """Return the problem, or say that a loaded policy has none."""
        if self.problem is None:
            raise ValueError(f"{purpose} needs the problem, whose functions no file can hold: plan it again, or pass problem=")
        return self.problem

    @cached_property
    def shape(self) -> Ints:
        """Nodes of each axis."""
        return np.array(self.grid.shape, dtype=np.int64)

    @cached_property
    def kinks(self) -> Kinks:
        """On one axis: what the actions cost in the cells where they change; empty on more axes."""
        rows, modes, nodes = self.table.value.shape
        lines = self.table.changes.all() if self.table.changes else None
        if lines is None:
            return Kinks.none((rows, modes, nodes - 1 if len(self.grid.axes) == 1 else 0))
        return sorted_kinks(_split(self, lines), (rows, modes, nodes - 1))


def _split(solution: Solution, lines: Lines) -> Lines:
    """Replace lines of one move that does another thing at each end by two, each with what is done at one end."""
    split = lines.split
    if not np.any(split):
        return lines
    two, pair = lines.select(split), [lines.select(~split)]
    for end in (0, 1):
        far, entry = 1 - end, two.entry[:, end]
        # The other end is tried with the same control, and with that which goes on as it came.
        held = two.control[:, end]
        onward = _within(solution, two.act, held, two.onward[:, far])
        tried = [_cost_at(solution, two, two.cell + far, entry, control) for control in (held, onward)]
        cost, control = two.cost.copy(), two.control.copy()
        cost[:, far], control[:, far] = np.minimum(*tried), np.where(tried[1] < tried[0], onward, held)
        line = two._replace(cost=cost, control=control, entry=np.stack([entry] * 2, axis=1))
        pair.append(line.select(np.isfinite(cost).all(axis=1)))
    return Lines(*(np.concatenate(columns) for columns in zip(*pair, strict=True)))


def _within(solution: Solution, act: Ints, held: Floats, onward: Floats) -> Floats:
    """Controls of moves that go on from `held`, kept inside its regime."""
    problem = solution.need_problem("kinks")
    ends = np.array([[m.levels.low, m.levels.high] if m.levels else [0.0, 0.0] for m in problem.moves])[act]
    low, high = Spans.of(problem).select(act).around(held)
    return np.clip(onward, np.maximum(low, ends[:, 0]), np.minimum(high, ends[:, 1]))


def _cost_at(solution: Solution, lines: Lines, at: Ints, entry: Ints, control: Floats) -> Floats:
    """Cost of the moves of `lines` with given controls at given nodes."""
    problem, grid = solution.need_problem("kinks"), solution.grid
    cost = np.empty(at.size)
    for row, k in sorted({(int(r), int(m)) for r, m in zip(lines.row, lines.act, strict=True)}):
        here = (lines.row == row) & (lines.act == k)
        mode = lines.mode[here] if len(problem.modes) > 1 else None
        points = tuple(x[at[here]] for x in grid.points)
        cost[here] = step_cost(solution, Menu(problem, grid, k), row, points, mode, entry[here], control[here])
    return cost


def step_cost(
    solution: Solution, menu: Menu, row: int, points: tuple[Floats, ...], mode: Any, entry: Any, control: Floats
) -> Floats:
    """Cost of one move from arbitrary points in a slice of the table, and of the policy from then on."""
    layout, count, value = solution.layout, solution.countdown, solution.table.value
    time = np.full(points[0].shape if points else (1,), count.time(row))
    rows: Rows = menu.move.to.rows(menu, points, mode, time, np.asarray(entry, dtype=np.int64), control)
    end = count.arrival(row, menu.move.duration)
    if end is None:
        return np.full(rows.mode.shape, np.inf)
    extra = np.asarray(layout.edge_extra) if layout.edge_extra else np.zeros(len(layout.modes))
    # The base lacks the late charge of the time at which it is used.
    used = float(count.late(count.lowest * count.step)) if count.in_base(row) else 0.0
    return rows.expect(value[end.row] + end.lacks, extra + end.late) - used
