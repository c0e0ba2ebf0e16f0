"""A solved problem and what it says at a state: the moves of the table, and between two nodes that differ the better one."""

from functools import cached_property
from typing import Any, NamedTuple

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

JUMP = 0.1
"""Share of a control's range that it may change over one cell without counting as a jump."""


class Kinks(NamedTuple):
    """Cells [row, mode, cell] in which the action changes: where in the cell, and what each node's action costs too much.

    `switch` is a part of the cell (NaN: no change); `left` ($) is how much more than the best the left node's action costs
    at the right node, `right` the other way round. Beside a node where one stops, `start` is the control with which the
    other node's move would begin there (else NaN).
    """

    switch: Floats
    left: Floats
    right: Floats
    start: Floats


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
        if self.kinks.switch.size:
            _lookup.below_kinks(self.table.value, *self.kinks[:3], place.row, place.mode, place.index, out)
        return self.locator.with_exits(place, out + place.late)

    def act(self, place: Place) -> tuple[Any, Any, Floats, Floats]:
        """Return move (stops are negative), entry of the lists, continuous control and gap at located states."""
        n = place.row.size
        best, entry, control, gap = np.empty(n, np.int16), np.empty(n, np.int32), np.empty(n), np.empty(n)
        t = self.table
        table, out = (t.best, t.entry, t.control, t.gap), (best, entry, control, gap)
        _lookup.act(table, self.kinks.switch, self.kinks.start, place.row, place.mode, self.shape, place.index, out)
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
        """On one axis: where the actions of two nodes change places; empty on more axes."""
        return find_kinks(self) if len(self.grid.axes) == 1 else Kinks(*[np.empty((0, 0, 0))] * 4)


def find_kinks(solution: Solution) -> Kinks:
    """Compare what each of two differing nodes does at the other node too.

    The costs of the two, taken as linear over the cell, cross at the switch. Without the problem (a loaded policy of
    functions) the middle of the cell is taken, and nothing is known of the costs.
    """
    t = solution.table
    change = (t.best[:, :, 1:] != t.best[:, :, :-1]) | (t.entry[:, :, 1:] != t.entry[:, :, :-1]) | _jumps(t)
    none = np.full(change.shape, np.nan)
    found = Kinks(np.where(change, 0.5, np.nan), np.zeros(change.shape), np.zeros(change.shape), none)
    if solution.problem is None:
        return found
    for row in np.unique(np.nonzero(change)[0]):
        mode, cell = np.nonzero(change[row])
        left, at_right = _elsewhere(solution, int(row), mode, cell, cell + 1)
        right, at_left = _elsewhere(solution, int(row), mode, cell + 1, cell)
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.where(np.isinf(left), np.where(np.isinf(right), 0.5, 0.0), right / (left + right))
        found.switch[row, mode, cell] = np.where(np.isfinite(part), part, np.where(np.isinf(right), 1.0, 0.5))
        left = _least_excess(solution, int(row), mode, cell, cell + 1, left)
        right = _least_excess(solution, int(row), mode, cell + 1, cell, right)
        both = np.isfinite(left) & np.isfinite(right)
        found.left[row, mode, cell], found.right[row, mode, cell] = np.where(both, left, 0.0), np.where(both, right, 0.0)
        found.start[row, mode, cell] = np.where(np.isnan(at_left), at_right, at_left)
    return found


def _jumps(table: Table) -> Any:
    """Cells in which one move goes on, but its control jumps from one minimum to another."""
    jump = np.zeros((*table.best.shape[:2], table.best.shape[2] - 1), dtype=bool)
    for k in np.unique(table.best[table.best >= 0]):
        control = np.where(table.best == k, table.control, np.nan)
        if np.any(np.isfinite(control)):
            span = np.nanmax(control) - np.nanmin(control)
            with np.errstate(invalid="ignore"):
                jump |= np.abs(np.diff(control, axis=2)) > JUMP * span
    return jump


def _least_excess(solution: Solution, row: int, mode: Any, of: Any, at: Any, tried: Floats) -> Floats:
    """What the move of nodes `of` costs too much at nodes `at` with the control that is best there.

    It lies between the gap and what was `tried`. At an end of its interval a control stays what it is, and a stop has none:
    what was tried is right. Elsewhere the gap is, unless a third move is nearer.
    """
    t, moves = solution.table, solution.need_problem("kinks").moves
    best, control = t.best[row, mode, of], t.control[row, mode, of]
    ends = np.array([[m.levels.low, m.levels.high] if m.levels else [0.0, 0.0] for m in moves])[np.maximum(best, 0)]
    inside = (best >= 0) & (np.min(np.abs(control[:, None] - ends), axis=1) > 1e-9 * np.abs(ends).max(axis=1))
    other = best != t.best[row, mode, at]
    return np.where(inside & other, np.minimum(t.gap[row, mode, at], tried), tried)


def _elsewhere(solution: Solution, row: int, mode: Any, of: Any, at: Any) -> tuple[Floats, Floats]:
    """How much more than the best the actions of nodes `of` cost at nodes `at`, $.

    Where `at` is to stop, the move is tried there with what `at` itself would do and with its least and greatest control too;
    the cheapest is the second answer (NaN elsewhere).
    """
    problem, t = solution.need_problem("kinks"), solution.table
    best, entry = t.best[row, mode, of], t.entry[row, mode, of]
    tried = [t.control[row, mode, of]]
    cost = _cost_at(solution, row, mode, at, best, entry, tried[0])
    stopping = (t.best[row, mode, at] < 0) & (best >= 0)
    if np.any(stopping):
        levels = [move.levels for move in problem.moves]
        ends = np.array([[np.nan, np.nan] if v is None else [v.low, v.high] for v in levels])[np.maximum(best, 0)]
        own = np.where(t.move[row, mode, at] == best, t.control[row, mode, at], tried[0])
        tried += [own, ends[:, 0], ends[:, 1]]
        costs = np.array([cost, *(_cost_at(solution, row, mode, at, np.where(stopping, best, -1), entry, u) for u in tried[1:])])
        which = np.argmin(np.where(stopping & ~np.isnan(np.array(tried)), costs, np.inf), axis=0)
        cost = np.where(stopping, np.min(np.where(np.isnan(np.array(tried)), np.inf, costs), axis=0), cost)
        start = np.where(stopping, np.array(tried)[which, np.arange(cost.size)], np.nan)
    else:
        start = np.full(cost.shape, np.nan)
    return np.maximum(cost - t.value[row, mode, at], 0.0), start


def _cost_at(solution: Solution, row: int, mode: Any, at: Any, best: Any, entry: Any, control: Floats) -> Floats:
    """Cost of given actions at given nodes of one slice."""
    problem, grid = solution.need_problem("kinks"), solution.grid
    cost = np.empty(mode.size)
    stage = row + solution.first
    late = float(solution.layout.late_charge(-stage * solution.layout.step)) if not (solution.has_base and row == 0) else 0.0
    for k in np.unique(best):
        here = best == k
        there = tuple(x[at][here] for x in grid.points)
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
