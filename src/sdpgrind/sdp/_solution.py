"""A solved problem and what it says at a state: the moves of the table, and between two nodes that differ the better one."""

from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp import _lookup
from sdpgrind.sdp._grid import Ints
from sdpgrind.sdp._layout import Layout
from sdpgrind.sdp._locate import ROUNDING, Locator, Place
from sdpgrind.sdp._menu import Menu
from sdpgrind.sdp._problem import Problem
from sdpgrind.sdp._rows import Rows
from sdpgrind.sdp._stages import Table
from sdpgrind.sdp._stops import charge_of, stop_state


class Solution:
    """Table, layout and, unless it was loaded from a file that cannot hold it, the problem."""

    def __init__(self, problem: Problem | None, layout: Layout, table: Table) -> None:
        self.problem, self.layout, self.table = problem, layout, table
        self.grid, self.first, self.has_base = layout.grid, table.first, layout.has_base
        self.locator = Locator(layout, table.first, layout.has_base)

    def locate(self, state: dict[str, Any]) -> Place:
        """Find states in the table, or refuse them."""
        return self.locator.locate(state)

    def begin(self, place: Place) -> tuple[int, float]:
        """Return the stage at which a located state begins, and how much time it has beyond it (0 unless late in the base)."""
        if self.layout.endless:
            return 0, 0.0
        row = int(place.row[0])
        if not (self.has_base and row == 0):
            return row + self.first, 0.0
        stage = int(np.floor(place.time[0] / self.layout.step + ROUNDING))
        return stage, float(max(0.0, place.time[0] - stage * self.layout.step))

    def value_at(self, place: Place) -> Floats:
        """Return the value-to-go ($) at located states."""
        out = np.empty(place.row.size)
        _lookup.interpolate(self.table.value, place.row, place.mode, self.shape, place.index, out)
        return self.locator.with_exits(place, out + place.late)

    def act(self, place: Place) -> tuple[Any, Any, Floats, Floats]:
        """Return move (stops are negative), entry of the lists, continuous control and gap at located states."""
        n = place.row.size
        best, entry, control, gap = np.empty(n, np.int16), np.empty(n, np.int32), np.empty(n), np.empty(n)
        t = self.table
        table, out = (t.best, t.move, t.entry, t.control, t.gap), (best, entry, control, gap)
        _lookup.act(table, self.switches, place.row, place.mode, self.shape, place.index, out)
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
    def switches(self) -> Floats:
        """On one axis: the part of each cell [row, mode, cell] at which the actions of its two nodes change places."""
        return switches(self) if len(self.grid.axes) == 1 else np.empty((0, 0, 0))


def switches(solution: Solution) -> Floats:
    """Return, for one axis, the part [row, mode, cell] of each cell at which its two nodes' actions change places.

    Each node's action is evaluated one step ahead at the other node too; the costs of the two, taken as linear over the
    cell, cross there. Without the problem (a loaded policy of functions) the middle of the cell is taken.
    """
    t = solution.table
    change = (t.best[:, :, 1:] != t.best[:, :, :-1]) | (t.entry[:, :, 1:] != t.entry[:, :, :-1])
    out = np.where(change, 0.5, np.nan)
    if solution.problem is None:
        return out
    for row in np.unique(np.nonzero(change)[0]):
        mode, cell = np.nonzero(change[row])
        left = (
            _other_cost(solution, int(row), mode, cell, cell + 1) - t.value[row, mode, cell + 1]
        )  # left's action at the right node
        right = _other_cost(solution, int(row), mode, cell + 1, cell) - t.value[row, mode, cell]
        left, right = np.maximum(left, 0.0), np.maximum(right, 0.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.where(np.isinf(left), np.where(np.isinf(right), 0.5, 0.0), right / (left + right))
        out[row, mode, cell] = np.where(np.isfinite(part), part, np.where(np.isinf(right), 1.0, 0.5))
    return out


def _other_cost(solution: Solution, row: int, mode: Any, of: Any, at: Any) -> Floats:
    """Cost at nodes `at` of the actions that the table has at nodes `of`; a move's control is the node's own where it has one."""
    problem = solution.need_problem("switches")
    t, grid = solution.table, solution.grid
    cost = np.empty(mode.size)
    best, entry, control = t.best[row, mode, of], t.entry[row, mode, of], t.control[row, mode, of]
    own = (t.move[row, mode, at] == best) & (t.entry[row, mode, at] == entry)
    control = np.where(own, t.control[row, mode, at], control)
    stage = row + solution.first
    late = float(solution.layout.late_charge(-stage * solution.layout.step)) if not (solution.has_base and row == 0) else 0.0
    start = tuple(x[at] for x in grid.points)
    for k in np.unique(best):
        here = best == k
        there = tuple(x[here] for x in start)
        if k < 0:
            s = stop_state(problem, there, mode[here], stage)
            cost[here] = charge_of(problem, problem.stops[-1 - k], s) + late
        else:
            told = mode[here] if len(problem.modes) > 1 else None
            cost[here] = step_cost(solution, Menu(problem, grid, int(k)), row, there, told, entry[here], control[here])
    return cost


def step_cost(
    solution: Solution, menu: Menu, row: int, points: tuple[Floats, ...], mode: Any, entry: Any, control: Floats
) -> Floats:
    """Cost of one move from arbitrary points in a slice of the table, and of the policy from then on."""
    layout, t = solution.layout, solution.table
    stage = row + solution.first
    rows: Rows = menu.move.to.rows(
        menu,
        points,
        mode,
        np.full(points[0].shape if points else (1,), stage * layout.step),
        np.asarray(entry, dtype=np.int64),
        control,
    )
    extra = np.asarray(layout.edge_extra) if layout.edge_extra else np.zeros(len(layout.modes))
    if layout.endless:
        return rows.expect(t.value[0], extra)
    in_base = solution.has_base and row == 0
    arrival = row - menu.move.duration
    if in_base or arrival < (1 if solution.has_base else 0):
        # Before the table: the base, later by what is missing. In the base itself time is counted from its own stage.
        if not solution.has_base:
            return np.full(rows.mode.shape, np.inf)
        begin = -(solution.first + 1) * layout.step
        after = (
            layout.late_charge(begin + menu.move.duration * layout.step) - layout.late_charge(begin)
            if in_base
            else layout.late_charge(-(stage - menu.move.duration) * layout.step)
        )
        return rows.expect(t.value[0], extra) + float(after)
    return rows.expect(t.value[arrival], extra + layout.late_charge(-(arrival + solution.first) * layout.step))
