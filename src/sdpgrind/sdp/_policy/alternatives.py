"""Alternatives to the best action at a state."""

from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._problem.stops import charge_of, stop_state
from sdpgrind.sdp._solve.bundles import Bundles


def alternatives(solution: Solution, within: float, state: dict[str, Any]) -> dict[str, float]:
    """Return costs ($) of stops and moves within `within` $ of the best at one state, cheapest first."""
    problem = solution.need_problem("alternatives")
    place = solution.locate(state)
    if place.row.size != 1:
        raise ValueError(f"alternatives must be asked at one state; got {place.row.size}")
    if solution.locator.outside(place)[0]:
        return {problem.stops[0].name: float(solution.value_at(place)[0])} if problem.stops else {}
    row, mode = int(place.row[0]), int(place.mode[0])
    s = stop_state(problem, list(place.points), place.mode, row + solution.countdown.first)
    late = float(solution.locator.late_at(place)[0])
    costs = {stop.name: float(np.ravel(charge_of(problem, stop, s))[0]) + late for stop in problem.stops}
    node, part = (np.ravel(x) for x in solution.grid.corners(place.index))
    node, part = node[part > 0], part[part > 0]  # 0 * inf is no cost
    for k, q in enumerate(_move_costs(solution, problem, row, mode, float(place.time[0]))):
        costs[problem.moves[k].name] = float(part @ q[node])
    best = min(costs.values())
    return {name: q for name, q in sorted(costs.items(), key=lambda item: item[1]) if q <= best + within}


def _move_costs(solution: Solution, problem: Problem, row: int, mode: int, time: float) -> list[Floats]:
    """Cost [node] of the best control of every move in one slice, at the stage coordinate `time`, $."""
    layout, t = solution.layout, solution.table
    bundles = Bundles(problem, solution.grid, keep=False)
    extra = np.asarray(layout.edge_extra) if layout.edge_extra else np.zeros(len(layout.modes))
    out = [np.full(solution.grid.size, np.inf)] * len(problem.moves)
    for duration in sorted({move.duration for move in problem.moves}):
        end = solution.countdown.arrival(row, duration, time)
        if end is None:
            continue
        value, level = t.value[end.row] + end.lacks, extra + end.late
        for moves, found in bundles.best(value, level, end.stage, 10**9):
            for i, k in enumerate(moves):
                if problem.moves[k].duration == duration:
                    out[k] = found.q[i][0 if bundles.shared[k] else mode]
    return out
