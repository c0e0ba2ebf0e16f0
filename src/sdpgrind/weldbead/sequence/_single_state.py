"""Look-ups of one state in the table of a plan, in microseconds: numbers of Python, no arrays.

Entries are read through memory views, which give numbers; those of arrays take ten times as long.
"""

from functools import cached_property
from math import inf, nan
from typing import Any

import numpy as np

from sdpgrind import sdp
from sdpgrind.weldbead.sequence._action import SequenceAction
from sdpgrind.weldbead.sequence._problem import SequenceProblem

_NUMBERS = (float, int)
# numbers of cells in which one action holds, and of those for which the table must be read; derived: the
# first is that of `sdp`, whose others are >= 0
_SAME, _UNKNOWN = -1, -2


class SingleStates:
    """Expected penalty and action at single states; None: the table must be read.

    Parameters
    ----------
    problem : SequenceProblem
        Problem of the actions.
    table : sdp.Policy
        Table that interpolates between nodes.
    durations, feeds : list of float
        Of its moves, s and mm/s.
    """

    def __init__(
        self, problem: SequenceProblem, table: sdp.Policy, durations: list[float], feeds: list[float]
    ) -> None:
        self._problem, self._table, self._durations, self._feeds = problem, table, durations, feeds
        axis = table.layout.axes[0]
        self._cells, self._height_max = axis.nodes - 1, axis.high
        self._per_height, self._per_stage = (axis.nodes - 1) / axis.high, 1.0 / table.layout.step
        self._last, self._origin = table.layout.count + 2e-9, -table.countdown.first
        self._values = memoryview(table.table.value)

    def value(self, height: Any, time_left: Any) -> float | None:
        """Expected penalty-to-go, $, at a height (mm) and a time left (s)."""
        place = self._place(height, time_left)
        if place is None:
            return None
        row, k, part = place
        low, high = self._values[row, 0, k], self._values[row, 0, k + 1]
        if part == 0 or part == 1 or not self._changed[row, 0, k]:
            return low + part * (high - low)
        at, start, cost, *_ = self._kinks
        number = at[row, 0, k]
        if number == _SAME:
            return low + part * (high - low)
        if number == _UNKNOWN:
            return None
        lines = range(start[number], start[number + 1])
        least: float = min([cost[i, 0] + part * (cost[i, 1] - cost[i, 0]) for i in lines])
        return least

    def action(self, height: Any, time_left: Any) -> SequenceAction | None:
        """Action at a height (mm) and a time left (s)."""
        place = self._place(height, time_left)
        if place is None:
            return None
        row, k, part = place
        best, force, gap = self._nodes
        if part == 0 or part == 1:
            k += int(part)
            return self._action(best[row, 0, k], force[row, 0, k], gap[row, 0, k])
        between = (1 - part) * gap[row, 0, k] + part * gap[row, 0, k + 1]
        number = self._kinks[0][row, 0, k] if self._changed[row, 0, k] else _SAME
        if number == _SAME:
            at = (1 - part) * force[row, 0, k] + part * force[row, 0, k + 1]
            return self._action(best[row, 0, k], at, between)
        return None if number == _UNKNOWN else self._least(number, part, best[row, 0, k], between)

    def _place(self, height: Any, time_left: Any) -> tuple[int, int, float] | None:
        """Row, cell and part of the cell of a state; None: no number, or outside the table."""
        if not (isinstance(height, _NUMBERS) and isinstance(time_left, _NUMBERS)):
            return None
        stage = time_left * self._per_stage + 1e-9
        if not (0.0 <= height <= self._height_max and 0.0 <= stage <= self._last):
            return None
        cell = height * self._per_height
        k = int(cell)
        if k == self._cells:
            k -= 1
        return int(stage) + self._origin, k, cell - k

    def _least(self, number: int, part: float, chosen: int, gap: float) -> SequenceAction:
        """Action of the least line of a cell in which the action changes; the gap is that to another, $."""
        _, start, cost, force, act, _ = self._kinks
        least = other = inf
        for i in range(start[number], start[number + 1]):
            height = cost[i, 0] + part * (cost[i, 1] - cost[i, 0])
            if height < least:
                other = other if act[i] == chosen else least
                least, line, chosen = height, i, act[i]
            elif height < other and act[i] != chosen:
                other = height
        at = (1 - part) * force[line, 0] + part * force[line, 1]
        return self._action(chosen, at, other - least if other < inf else gap)

    def _action(self, chosen: int, force: float, gap: float) -> SequenceAction:
        if chosen < 0:
            return SequenceAction(True, 0.0, nan, nan, gap, self._problem)
        return SequenceAction(False, self._durations[chosen], self._feeds[chosen], force, gap, self._problem)

    @cached_property
    def _changed(self) -> memoryview:
        """Cells in which the action may change; known without `_kinks`, which take long after a new plan."""
        return memoryview(self._table.changed | self._table.bent)

    @cached_property
    def _kinks(self) -> tuple[Any, ...]:
        """Lines of the cells; `_UNKNOWN` where a stop's charge is bent."""
        kinks, bent = self._table.kinks, self._table.bent
        kinks = kinks._replace(at=np.where(bent, np.int32(_UNKNOWN), kinks.at))
        return tuple(memoryview(np.ascontiguousarray(x)) for x in kinks)

    @cached_property
    def _nodes(self) -> tuple[Any, ...]:
        t = self._table.table
        return tuple(memoryview(np.ascontiguousarray(x)) for x in (t.best, t.control, t.gap))
