"""Costs of single moves from any points, followed by the policy."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.countdown import Countdown
from sdpgrind.sdp._problem.grid import Grid, Ints
from sdpgrind.sdp._problem.layout import Layout
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.rows import Rows

TOGETHER = 2_000_000  # chosen: weights of distributions computed together; more cost memory, fewer overhead


@dataclass(frozen=True)
class Steps:
    """A problem with its value-to-go [row, mode, node]."""

    problem: Problem
    layout: Layout
    countdown: Countdown
    value: Floats

    @property
    def grid(self) -> Grid:
        """The grid of the value-to-go."""
        return self.layout.grid

    def cost(
        self, move: int, row: Ints, mode: Ints, points: tuple[Floats, ...], entry: Any, control: Floats
    ) -> Floats:
        """Return the cost ($) of one move from points in slices (row, mode); infinite where not allowed."""
        found: Floats = self.costs((self.value,), move, row, mode, points, entry, control)[0]
        return found

    def costs(
        self,
        values: Sequence[Floats],
        move: int,
        row: Ints,
        mode: Ints,
        points: tuple[Floats, ...],
        entry: Any,
        control: Floats,
    ) -> Floats:
        """Return [value, point]: `cost` ($) with each of several values-to-go [row, mode, node] after it."""
        together = max(1, TOGETHER // max(1, self.grid.size))
        cost = np.empty((len(values), row.size))
        for k in range(0, row.size, together):
            some = slice(k, k + together)
            told = mode[some] if len(self.problem.modes) > 1 else None
            cost[:, some] = self._costs(
                values, move, row[some], told, tuple(x[some] for x in points), entry[some], control[some]
            )
        return cost

    def _costs(
        self,
        values: Sequence[Floats],
        move: int,
        row: Ints,
        mode: Any,
        points: tuple[Floats, ...],
        entry: Any,
        control: Floats,
    ) -> Floats:
        menu, count = Menu(self.problem, self.grid, move), self.countdown
        rows: Rows = menu.move.to.rows(
            menu, points, mode, count.time(row), np.asarray(entry, dtype=np.int64), control
        )
        extra = (
            np.asarray(self.layout.edge_extra) if self.layout.edge_extra else np.zeros(len(self.layout.modes))
        )
        cost = np.full((len(values), *row.shape), np.inf)
        for one in np.unique(row):
            end = count.arrival(int(one), menu.move.duration)
            if end is None:
                continue
            # The base lacks the late charge of the time at which it is used.
            used = float(count.late(count.lowest * count.step)) if count.in_base(one) else 0.0
            here = row == one
            some, level = rows.select(here), extra + end.late
            cost[:, here] = [some.expect(value[end.row] + end.lacks, level) - used for value in values]
        return cost
