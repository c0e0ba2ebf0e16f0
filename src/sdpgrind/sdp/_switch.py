"""Between two nodes with different actions: where they change places; and what else is nearly as good at a state."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._bundles import Bundles
from sdpgrind.sdp._menu import Menu
from sdpgrind.sdp._problem import Problem
from sdpgrind.sdp._stops import charge_of, stop_state

if TYPE_CHECKING:
    from sdpgrind.sdp._policy import Policy


def switches(policy: "Policy") -> Floats:
    """Return, for one axis, the part [row, mode, cell] of each cell at which its two nodes' actions change places.

    Each node's action is evaluated one step ahead at the other node too; the costs of the two, taken as linear over the
    cell, cross there. Without the problem (a loaded policy of functions) the middle of the cell is taken.
    """
    t = policy.table
    change = (t.best[:, :, 1:] != t.best[:, :, :-1]) | (t.entry[:, :, 1:] != t.entry[:, :, :-1])
    out = np.where(change, 0.5, np.nan)
    if policy.problem is None:
        return out
    for row in np.unique(np.nonzero(change)[0]):
        mode, cell = np.nonzero(change[row])
        left = (
            _other_cost(policy, int(row), mode, cell, cell + 1) - t.value[row, mode, cell + 1]
        )  # left's action at the right node
        right = _other_cost(policy, int(row), mode, cell + 1, cell) - t.value[row, mode, cell]
        left, right = np.maximum(left, 0.0), np.maximum(right, 0.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.where(np.isinf(left), np.where(np.isinf(right), 0.5, 0.0), right / (left + right))
        out[row, mode, cell] = np.where(np.isfinite(part), part, np.where(np.isinf(right), 1.0, 0.5))
    return out


def _other_cost(policy: "Policy", row: int, mode: Any, of: Any, at: Any) -> Floats:
    """Cost at nodes `at` of the actions that the table has at nodes `of`."""
    problem = policy.need_problem("switches")
    t, grid = policy.table, policy.grid
    cost = np.empty(mode.size)
    best, entry, control = t.best[row, mode, of], t.entry[row, mode, of], t.control[row, mode, of]
    stage = row + policy.first
    late = float(policy.layout.late_charge(-stage * policy.layout.step)) if not (policy.has_base and row == 0) else 0.0
    start = tuple(x[at] for x in grid.points)
    for k in np.unique(best):
        here = best == k
        there = tuple(x[here] for x in start)
        if k < 0:
            s = stop_state(problem, there, mode[here], stage)
            cost[here] = charge_of(problem, problem.stops[-1 - k], s) + late
        else:
            told = mode[here] if len(problem.modes) > 1 else None
            cost[here] = one_step(policy, Menu(problem, grid, int(k)), row, there, told, entry[here], control[here])
    return cost


def one_step(
    policy: "Policy", menu: Menu, row: int, points: tuple[Floats, ...], mode: Any, entry: Any, control: Floats
) -> Floats:
    """Cost of one move from arbitrary points in a slice of the table, and of the policy from then on."""
    layout, t = policy.layout, policy.table
    stage = row + policy.first
    rows = menu.move.to.rows(
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
    in_base = policy.has_base and row == 0
    arrival = row - menu.move.duration
    if in_base or arrival < (1 if policy.has_base else 0):
        # Before the table: the base, later by what is missing. In the base itself time is counted from its own stage.
        if not policy.has_base:
            return np.full(rows.mode.shape, np.inf)
        begin = -(policy.first + 1) * layout.step
        after = (
            layout.late_charge(begin + menu.move.duration * layout.step) - layout.late_charge(begin)
            if in_base
            else layout.late_charge(-(stage - menu.move.duration) * layout.step)
        )
        return rows.expect(t.value[0], extra) + float(after)
    return rows.expect(t.value[arrival], extra + layout.late_charge(-(arrival + policy.first) * layout.step))


def alternatives(policy: "Policy", within: float, state: dict[str, Any]) -> dict[str, float]:
    """Return stops and moves within `within` $ of the best at one state, cheapest first."""
    problem = policy.need_problem("alternatives")
    place = policy.locate(state)
    if place.row.size != 1:
        raise ValueError(f"alternatives must be asked at one state; got {place.row.size}")
    if policy.locator.outside(place)[0]:
        return {problem.stops[0].name: float(policy.value(**state))} if problem.stops else {}
    row, mode = int(place.row[0]), int(place.mode[0])
    stage = row + policy.first
    s = stop_state(problem, [p for p in place.points], place.mode, stage)
    late = float(policy.locator.late_at(place)[0])
    costs = {stop.name: float(np.ravel(charge_of(problem, stop, s))[0]) + late for stop in problem.stops}
    node, part = (np.ravel(x) for x in policy.grid.corners(place.index))
    node, part = node[part > 0], part[part > 0]  # infinite costs at a corner without weight do not count
    for k, q in enumerate(_move_costs(policy, problem, row, mode, float(place.time[0]))):
        costs[problem.moves[k].name] = float(part @ q[node])
    best = min(costs.values())
    return {name: q for name, q in sorted(costs.items(), key=lambda item: item[1]) if q <= best + within}


def _move_costs(policy: "Policy", problem: Problem, row: int, mode: int, time: float) -> list[Floats]:
    """Cost [node] of the best control of every move in one slice of the table, which serves the stage coordinate `time`."""
    layout, t = policy.layout, policy.table
    bundles = Bundles(problem, policy.grid, keep=False)
    extra = np.asarray(layout.edge_extra) if layout.edge_extra else np.zeros(len(layout.modes))
    out = [np.full(policy.grid.size, np.inf)] * len(problem.moves)
    base = 1 if policy.has_base else 0
    for duration in sorted({move.duration for move in problem.moves}):
        arrival = row - duration if not layout.endless else 0
        before = not layout.endless and arrival < base
        if before and not policy.has_base:
            continue
        end = time - duration * layout.step if policy.has_base and row == 0 else (arrival + policy.first) * layout.step
        late = float(layout.late_charge(-end)) if not layout.endless else 0.0
        value, level = (t.value[0] + late, extra + late) if before else (t.value[arrival], extra + late)
        stage = arrival + policy.first if not layout.endless else None
        for moves, found in bundles.best(value, level, stage, 10**9):
            for i, k in enumerate(moves):
                if problem.moves[k].duration == duration:
                    out[k] = found.q[i][0 if bundles.shared[k] else mode]
    return out
