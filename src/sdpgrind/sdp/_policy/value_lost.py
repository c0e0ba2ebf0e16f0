"""Value lost by following other controls than those of a plan: one backward sweep of its own problem.

With Q(s, a) the cost of the one action a in the state s, followed by the plan, and V the plan's value-to-go,
following the actions a from s on costs G >= V. It is found as the plan's V is, by the same expectation
without a minimum. Then G - V is exact for the chain on the nodes that the table describes, and in stage n

    max (G_n - V_n) <= max [Q_n(s, a) - V_n(s)] + the largest max (G - V) of the stages before,

so that the sum over stages of the first term is a bound that needs no G.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.stops import StopCharges
from sdpgrind.sdp._solve import forever
from sdpgrind.sdp._solve.steps import Steps


@dataclass(frozen=True)
class ValueLost:
    """What other controls at the nodes lose, $.

    Attributes
    ----------
    cost : array [row, mode, node]
        G: expected penalty-to-go, $.
    all_stages, first_stage : float
        Largest G - V over all nodes of all stages, and of the stage of the whole horizon, $.
    bound : float
        Sum over stages of the largest loss of one action, $; of a slice that is its own successor its G - V.
    """

    cost: Floats
    all_stages: float
    first_stage: float
    bound: float


def value_lost(
    solution: Solution, control: Floats, tell: Callable[[float], None] = lambda share: None
) -> ValueLost:
    """Return what a policy loses with other controls [row, mode, node]; moves and entries are its own.

    `tell` is called with the share that is done.
    """
    found = value_lost_within(solution, control, np.inf, tell)
    assert found is not None  # nothing is more than infinite
    return found


def value_lost_within(
    solution: Solution, control: Floats, most: float, tell: Callable[[float], None]
) -> ValueLost | None:
    """Return the `value_lost`; None: it is more than `most` ($), which mostly shows after a few stages."""
    follow = _Following(solution, control)
    lost = np.empty(len(solution.table.value))
    once = np.empty(lost.size)
    for row in range(lost.size):
        value = solution.table.value[row]
        first = follow.advance(row)
        lost[row] = np.max(follow.cost[row] - value)
        if lost[row] > most:
            return None
        once[row] = max(0.0, float(np.max(first - value)))
        tell((row + 1) / lost.size)
    return ValueLost(follow.cost, float(lost.max()), float(lost[-1]), float(once.sum()))


class _Following:
    """Cost of following actions, filled stage by stage."""

    def __init__(self, solution: Solution, control: Floats) -> None:
        self.solution, self.control = solution, control
        self.problem = solution.need_problem("the value lost")
        self.stops = StopCharges(self.problem, solution.grid)
        self.cost = np.full(solution.table.value.shape, np.inf)

    def advance(self, row: int) -> Floats:
        """Fill the cost of a row; return that of its actions, followed by the plan, [mode, node]."""
        known, count = self.solution, self.solution.countdown
        stationary = known.layout.endless or bool(count.in_base(row))
        plan = known.table.value
        values = (np.zeros_like(plan),) if stationary else (self.cost, plan)
        found = [self._stopped(row) for _ in values]
        for move in range(len(self.problem.moves)):
            mode, node = np.nonzero(known.table.best[row] == move)
            if node.size:
                costs = self._moved(values, move, row, mode, node)
                for one, cost in zip(found, costs, strict=True):
                    one[mode, node] = cost
        self.cost[row] = self._settled(row, found[0]) if stationary else found[0]
        return self.cost[row] if stationary else found[1]

    def _moved(self, values: Any, move: int, row: int, mode: Any, node: Any) -> Floats:
        t, known = self.solution.table, self.solution
        steps = Steps(self.problem, known.layout, known.countdown, values[0])
        points = tuple(x[node] for x in known.grid.points)
        at = t.entry[row, mode, node], self.control[row, mode, node]
        return steps.costs(values, move, np.full(node.size, row), mode, points, *at)

    def _stopped(self, row: int) -> Floats:
        """Charges of the stops of a row, [mode, node]; infinite where it moves on."""
        best, count = self.solution.table.best[row], self.solution.countdown
        late = 0.0 if count.in_base(row) else float(count.late(count.time(row)))
        out = np.full(best.shape, np.inf)
        charges = self.stops.at(row + count.first, late) if self.problem.stops else ()
        for k, charge in enumerate(charges):
            out[best == -1 - k] = charge[best == -1 - k]
        return out

    def _settled(self, row: int, rest: Floats) -> Floats:
        """Cost of a slice that is its own successor: cost = rest + P cost."""
        t, grid = self.solution.table, self.solution.grid
        if not np.any(t.best[row] >= 0):
            return rest
        rows = forever.policy_rows(self.problem, grid, t.best[row], self.control[row], t.entry[row])
        step = forever.transitions(rows, grid, rest.size)
        found = forever.settled(step, rest.ravel(), t.value[row].ravel())
        # singular: the actions never end
        return np.where(np.isfinite(found), found, np.inf).reshape(rest.shape)
