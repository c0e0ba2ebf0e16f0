"""Plan of a problem without scatter: nothing is interpolated."""

from dataclasses import replace
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
        plain = sdp.plan(sdp_problem(problem, NODES, levels=LEVELS))
        table = cls(plain.problem, plain.layout, replace(plain.table, changes=None, search_error=0.0), 0.0)
        seconds = [move.duration * problem.stage for move in plain.layout.moves]
        table.knapsack = Knapsack.of(problem, seconds, plain.layout.count)
        table.status = "exact"
        row, mode, node = (x.ravel() for x in np.indices(plain.table.value.shape))
        found = table._found(table.grid.coordinates[0][node], row, mode)
        value = table.interpolated(row, mode, node[None].astype(float))
        shape = plain.table.value.shape
        best: Any
        best, control, gap = (x.reshape(shape) for x in found)
        move = np.where(best < 0, plain.table.move, best).astype(np.int16)
        table.table = replace(
            table.table, value=value.reshape(shape), best=best, move=move, control=control, gap=gap
        )
        return table

    def interpolated(self, row: Any, mode: Any, index: Floats) -> Floats:
        """Return the value ($) at positions `index` (cells), [axis, state], of slices (row, mode)."""
        return self.knapsack.value(self.grid.coordinate(0, index[0]), row, mode)

    def act(self, place: Any) -> tuple[Any, Any, Floats, Floats]:
        """Return move (stops < 0), entry of the lists, force (N) and gap ($) at located states."""
        best, force, gap = self._found(place.points[0], place.row, place.mode)
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

    def _found(self, height: Floats, row: Any, mode: Any) -> tuple[Any, Floats, Floats]:
        """Best move, force (N) and gap ($) of many states, some at a time."""
        some = [slice(k, k + TOGETHER) for k in range(0, max(1, height.size), TOGETHER)]
        parts = [self._some(height[part], row[part], mode[part]) for part in some]
        best, force, gap = (np.concatenate(column) for column in zip(*parts, strict=True))
        return best, force, gap

    def _some(self, height: Floats, row: Any, mode: Any) -> tuple[Any, Floats, Floats]:
        choice = self.knapsack.choose(height, row, mode)
        others = choice.costs.copy()
        others[np.arange(height.size), choice.move + 1] = np.inf
        gap = np.maximum(0.0, others.min(axis=1) - choice.costs[np.arange(height.size), choice.move + 1])
        return choice.move.astype(np.int16), self._force(choice.move, choice.cut), gap

    def _force(self, move: Any, cut: Floats) -> Floats:
        """Normal force, N, of mean cuts, mm; NaN: stop."""
        known, going = self.knapsack, move >= 0
        which, force = move[going], np.full(move.size, np.nan)
        asked = known.problem._mean_model.normal_force(cut[going], known.feed_rate[which])
        force[going] = np.clip(asked, known.force[0, which], known.force[1, which])
        return force
