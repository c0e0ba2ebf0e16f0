"""Plan of a problem without scatter: nothing is interpolated."""

from typing import Any

import numpy as np

from sdpgrind import sdp
from sdpgrind.base.checks import Floats
from sdpgrind.weldbead.sequence._as_sdp import sdp_problem
from sdpgrind.weldbead.sequence._knapsack import TOGETHER, Knapsack
from sdpgrind.weldbead.sequence._problem import SequenceProblem

NODES, LEVELS = 41, 3  # chosen: of the table that pictures and files show; no look-up reads it


class ExactTable(sdp.Policy):
    """Table of which every look-up is the closed form of `Knapsack`, $, mm, N; its nodes are for files."""

    knapsack: Knapsack

    @classmethod
    def of(cls, problem: SequenceProblem) -> "ExactTable":
        """Solve a problem for which the closed form holds."""
        table = cls._unfilled(sdp_problem(problem, NODES, levels=LEVELS))
        seconds = [move.duration * problem.stage for move in table.layout.moves]
        table.knapsack = Knapsack.of(problem, seconds, table.layout.count)
        table.error, table.status = 0.0, "exact"
        row, mode, node = (x.ravel() for x in np.indices(table.table.value.shape))
        value = table.interpolated(row, mode, node[None].astype(float))
        best, move, force, gap = table._found(table.grid.coordinates[0][node], row, mode)
        found = value, best, move, force, np.zeros(row.size), gap
        for array, each in zip(table.table.arrays, found, strict=True):
            array[...] = each.reshape(array.shape)
        return table

    @property
    def single(self) -> None:
        """No look-ups in the table, $: its nodes are for files."""

    def interpolated(self, row: Any, mode: Any, index: Floats) -> Floats:
        """Return the value ($) at positions `index` (cells), [axis, state], of slices (row, mode)."""
        return self.knapsack.value(self.grid.coordinate(0, index[0]), row, mode)

    def act(self, place: Any) -> tuple[Any, Any, Floats, Floats]:
        """Return move (stops < 0), entry of the lists, force (N) and gap ($) at located states."""
        best, _, force, gap = self._found(place.points[0], place.row, place.mode)
        outside = self.locator.outside(place)
        best[outside], gap[outside], force[outside] = -1, 0.0, np.nan
        return best, np.zeros(best.size, np.int32), force, gap

    def gradient(self, **state: Any) -> Any:
        """Return the derivative of the value-to-go, $/mm."""
        place = self.locate(state)
        slope = self.knapsack.slope(place.points[0], place.row, place.mode)
        slope = self.locator.with_exit_slopes(place, slope)
        return {self.layout.axes[0].name: slope.reshape(place.shape) if place.shape else slope.item()}

    def alternatives(self, within: float, **state: Any) -> dict[str, float]:
        """Return the cost ($) of stopping and of each move within `within` $ of the best at one state."""
        place = self.locate(state)
        if place.row.size != 1 or self.locator.outside(place)[0]:
            return super().alternatives(within, **state)
        costs = self.knapsack.choose(place.points[0], place.row, place.mode).costs[0]
        names = [*self.layout.stops, *(move.name for move in self.layout.moves)]
        order = [k for k in np.argsort(costs, kind="stable") if costs[k] <= costs.min() + within]
        return {names[k]: float(costs[k]) for k in order}

    def _found(self, height: Floats, row: Any, mode: Any) -> tuple[Any, Any, Floats, Floats]:
        """Best, move also where a stop is better, force (N) and gap ($) of many states, some at a time."""
        some = [slice(k, k + TOGETHER) for k in range(0, max(1, height.size), TOGETHER)]
        parts = [self._some(height[part], row[part], mode[part]) for part in some]
        best, move, force, gap = (np.concatenate(column) for column in zip(*parts, strict=True))
        return best, move, force, gap

    def _some(self, height: Floats, row: Any, mode: Any) -> tuple[Any, Any, Floats, Floats]:
        best, cut, costs = self.knapsack.choose(height, row, mode)
        move = np.where(best < 0, _least(costs[:, 1:]), best)
        every = np.arange(height.size)
        least = costs[every, best + 1]
        costs[every, best + 1] = np.inf
        gap = np.maximum(0.0, costs.min(axis=1) - least)
        return best.astype(np.int16), move, self._force(best, cut), gap

    def _force(self, move: Any, cut: Floats) -> Floats:
        """Normal force, N, of mean cuts, mm; NaN: stop."""
        known, going = self.knapsack, move >= 0
        which, force = move[going], np.full(move.size, np.nan)
        asked = known.problem._mean_model.normal_force(cut[going], known.feed_rate[which])
        force[going] = np.clip(asked, known.force[0, which], known.force[1, which])
        return force


def _least(costs: Floats) -> Any:
    """Move of least cost, $, of each state; -1: none ends in time."""
    move = np.argmin(costs, axis=1)
    return np.where(np.isfinite(costs[np.arange(move.size), move]), move, -1)
