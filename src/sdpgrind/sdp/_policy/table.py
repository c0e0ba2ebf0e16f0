"""Solved problem and its look-ups: actions of the table, between two different nodes the better one."""

from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._policy import look_up_kernels as _lookup
from sdpgrind.sdp._policy.locate import Locator, Place
from sdpgrind.sdp._problem.grid import Ints
from sdpgrind.sdp._problem.layout import Layout
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._solve.kernels import TIE_ABS
from sdpgrind.sdp._solve.kinks import Kinks, Lines, sorted_kinks, split
from sdpgrind.sdp._solve.stages import StageTable
from sdpgrind.sdp._solve.steps import Steps
from sdpgrind.sdp._solve.waits import through_waits


class Solution:
    """Table, layout and, unless it was loaded without, the problem."""

    def __init__(self, problem: Problem | None, layout: Layout, table: StageTable) -> None:
        self.problem, self.layout, self.table = problem, layout, table
        self.grid, self.countdown = layout.grid, layout.countdown(table.first)
        self.locator = Locator(layout, self.countdown)

    def locate(self, state: dict[str, Any]) -> Place:
        """Locate states in the table; refuse those outside."""
        return self.locator.locate(state)

    def placed(self, stage: Ints, mode: Ints, points: tuple[Floats, ...]) -> Place:
        """Locate states on given stages, in modes `mode`, unchecked: `points` in the axes' units."""
        index = [np.nan_to_num(self.grid.index(k, p), nan=-1.0, neginf=-1.0) for k, p in enumerate(points)]
        none = np.zeros(mode.size)
        at = np.array(index).reshape(len(points), mode.size)
        return Place(self.countdown.row(stage), none, mode, at, points, (mode.size,), none)

    def begin(self, place: Place) -> tuple[int, float]:
        """Return the stage of a located state, and its time beyond that stage (0 unless late in the base)."""
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
        at, stop = self._bent(row, mode, index)
        if at.size:
            out[at] = np.minimum(stop, self._moves(row[at], mode[at], index[:, at])[1])
        return out

    def act(self, place: Place) -> tuple[Any, Any, Floats, Floats]:
        """Return move (stops < 0), entry of the lists, continuous control and gap at located states."""
        n = place.row.size
        best, entry, control, gap = np.empty(n, np.int16), np.empty(n, np.int32), np.empty(n), np.empty(n)
        t = self.table
        table, out = (t.best, t.entry, t.control, t.gap), (best, entry, control, gap)
        mode = np.ascontiguousarray(place.mode)  # another layout would be compiled apart
        _lookup.act(table, self.kinks, place.row, mode, self.shape, place.index, out)
        at, stop = self._bent(place.row, place.mode, place.index)
        if at.size:
            line, cost = self._moves(place.row[at], place.mode[at], place.index[:, at])
            ends = stop <= cost
            best[at[ends]], entry[at[ends]], k = -1, 0, line[~ends]
            part = place.index[0, at[~ends]] % 1
            best[at[~ends]], entry[at[~ends]] = self.kinks.act[k], self.kinks.entry[k]
            control[at[~ends]] = (1 - part) * self.kinks.control[k, 0] + part * self.kinks.control[k, 1]
            gap[at] = np.where(np.isfinite(cost), np.abs(cost - stop), gap[at])
        outside = self.locator.outside(place)
        if np.any(outside):
            best[outside], gap[outside], control[outside] = -1, 0.0, np.nan
        return best, entry, control, gap

    @cached_property
    def bent(self) -> Any:
        """Mask [row, mode, cell] of cells of the one axis with a stop whose charge ($) is bent."""
        best, charge = self.table.best, self.layout.edge_charge
        if charge is None or len(self.grid.axes) != 1:
            return np.zeros((*best.shape[:2], 0), bool)
        cell = np.arange(best.shape[2] - 1)[:, None]
        part = np.array([[0.0, 1.0, 1e-6, 0.25, 0.5, 0.75, 1 - 1e-6]])
        at = charge(self.grid.coordinate(0, cell + part))
        chord = at[:, :1] + part[:, 2:] * (at[:, 1:2] - at[:, :1])
        curved = np.any(
            np.abs(at[:, 2:] - chord) > TIE_ABS + 2e-6 * np.abs(at).max(axis=1, keepdims=True), axis=1
        )
        return curved & ((best[:, :, 1:] < 0) | (best[:, :, :-1] < 0))

    def _bent(self, row: Ints, mode: Ints, index: Floats) -> tuple[Ints, Floats]:
        """Positions inside those cells, and the exact charge of stopping there, $."""
        bent = self.bent
        if not bent.any():
            return np.empty(0, np.int64), np.empty(0)
        cell = np.clip(np.floor(index[0]).astype(np.int64), 0, bent.shape[2] - 1)
        at = np.flatnonzero(bent[row, mode, cell] & (index[0] > cell) & (index[0] < cell + 1))
        count, charge = self.countdown, self.layout.edge_charge
        assert charge is not None  # else no cell is bent
        late = np.where(count.in_base(row[at]), 0.0, count.late(count.time(row[at])))
        extra = np.asarray(self.layout.edge_extra)[mode[at]]
        return at, charge(self.grid.coordinate(0, index[0, at])) + extra + late

    def _moves(self, row: Ints, mode: Ints, index: Floats) -> tuple[Ints, Floats]:
        """Line and cost of the best move inside cells of one axis; infinite where no move is allowed."""
        line = np.empty(row.size, np.int64)
        _lookup.least_move(self.kinks, row, mode, index, line)
        if not self.kinks.act.size:
            return line, np.full(row.size, np.inf)
        part, cost = index[0] % 1, self.kinks.cost[line]
        return line, np.where(line >= 0, (1 - part) * cost[:, 0] + part * cost[:, 1], np.inf)

    def controls(self, best: Any, entry: Any, control: Floats) -> dict[str, Floats]:
        """Return the value of every control of every move, NaN where that move is not chosen."""
        out: dict[str, Floats] = {}
        for k, move in enumerate(self.layout.moves):
            chosen = best == k
            for name, values in [*move.lists, *([(move.level, None)] if move.level else [])]:
                column = out.setdefault(name, np.full(best.shape, np.nan))
                column[chosen] = control[chosen] if values is None else np.asarray(values)[entry[chosen]]
        return out

    def need_problem(self, purpose: str) -> Problem:
        """Return the problem; refuse a loaded policy without one."""
        if self.problem is None:
            raise ValueError(
                f"{purpose} needs the problem, whose functions no file can hold: "
                "plan it again (`Policy.simulate` also takes problem=)"
            )
        return self.problem

    @cached_property
    def shape(self) -> Ints:
        """Nodes of each axis."""
        return np.array(self.grid.shape, dtype=np.int64)

    @cached_property
    def kinks(self) -> Kinks:
        """Costs of the actions in cells where they change; empty on several axes."""
        rows, modes, nodes = self.table.value.shape
        if self._lines is None:
            return Kinks.none((rows, modes, nodes - 1 if len(self.grid.axes) == 1 else 0))
        return sorted_kinks(
            through_waits(split(self._lines, self.steps), self.steps), (rows, modes, nodes - 1)
        )

    @cached_property
    def changed(self) -> Any:
        """Mask [row, mode, cell] of cells of one axis that `kinks` may list, without costs; unit 1."""
        if self._lines is None:
            return self.kinks.at >= 0
        rows, modes, nodes = self.table.value.shape
        mask = np.zeros((rows, modes, nodes - 1), bool)
        mask[self._lines.row, self._lines.mode, self._lines.cell] = True
        return mask

    @cached_property
    def _lines(self) -> Lines | None:
        return self.table.changes.all() if self.table.changes else None

    @property
    def steps(self) -> Steps:
        """Costs ($) of single moves from any point, followed by the policy."""
        return Steps(self.need_problem("a step"), self.layout, self.countdown, self.table.value)
