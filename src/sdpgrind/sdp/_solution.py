"""A solved problem and what it says at a state: the moves of the table, and between two nodes that differ the better one."""

from functools import cached_property
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp import _lookup
from sdpgrind.sdp._grid import Ints
from sdpgrind.sdp._kinks import Kinks, sorted_kinks
from sdpgrind.sdp._layout import Layout
from sdpgrind.sdp._locate import Locator, Place
from sdpgrind.sdp._problem import Problem
from sdpgrind.sdp._split import split
from sdpgrind.sdp._stages import Table
from sdpgrind.sdp._steps import Steps


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
        return sorted_kinks(split(lines, self.steps), (rows, modes, nodes - 1))

    @property
    def steps(self) -> Steps:
        """Single moves from anywhere, followed by the policy."""
        return Steps(self.need_problem("a step"), self.layout, self.countdown, self.table.value)
