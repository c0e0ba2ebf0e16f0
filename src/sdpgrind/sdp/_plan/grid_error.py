"""Error of a grid from the change between it and a coarser one."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sdpgrind.sdp._policy.policy import Policy
from sdpgrind.sdp._problem.coordinates import Levels
from sdpgrind.sdp._problem.problem import Problem

COARSEST = 5  # derived: least nodes of an axis of which half, three, are an axis


def grid_error(changes: list[float]) -> float:
    """Return the estimated error ($) of the last of several solutions, from largest changes at each halving.

    If a halving divides the error by r, the last change is (r - 1) times the error. Linear interpolation
    gives r = 4 on average; kinks of the value-to-go fall unevenly into cells, so r is the ratio of the last
    two changes, within [1.25, 3] (many passes of laws narrower than a cell converge slower than at first
    order). A change may be small by chance: the one before it, with second order assumed, bounds the error
    from below.
    """
    if len(changes) < 2:
        return changes[-1]
    rate = changes[-2] / changes[-1] if changes[-1] > 0 else 2.0
    return max(changes[-1] / (min(3.0, max(1.25, rate)) - 1), changes[-2] / 12)


def changes_between(coarse: Policy, fine: Policy) -> tuple[float, float]:
    """Return the largest change at the nodes of the finer grid, and at the nodes that both share, $."""
    shape = fine.grid.shape
    row, mode, *node = (x.ravel() for x in np.indices((*fine.table.value.shape[:2], *shape)))
    ratio = [(m - 1) / (n - 1) for m, n in zip(coarse.grid.shape, shape, strict=True)]
    index = np.array(ratio)[:, None] * np.array(node).reshape(len(shape), row.size)
    change = np.abs(coarse.interpolated(row, mode, index) - fine.table.value.ravel())
    return float(np.max(change)), float(np.max(change, where=np.all(index % 1 == 0, axis=0), initial=0.0))


def estimated(policy: Policy, solve: Callable[[Problem, int], Policy]) -> float:
    """Return the estimated error of a grid, $, by a second one: of half the cells, or twice where few.

    First order is assumed: the change to the coarser grid is the error of the finer.
    """
    problem = policy.need_problem("an error")
    few = any(axis.nodes < COARSEST for axis in problem.axes)
    other = solve(problem if few else _halved(problem), 2 if few else 1)
    coarse, fine = (policy, other) if few else (other, policy)
    return float((2.0 if few else 1.0) * changes_between(coarse, fine)[0] + policy.table.search_error)


def _halved(problem: Problem) -> Problem:
    """Problem with half the cells and half the levels of searched controls, a quarter of the tables."""
    axes = [replace(axis, nodes=(axis.nodes - 1) // 2 + 1) for axis in problem.axes]
    moves = []
    for move in problem.moves:
        coarse = {
            k: replace(v, count=v.count // 2 + 1) if isinstance(v, Levels) and v.search else v
            for k, v in move.controls.items()
        }
        moves.append(replace(move, controls=coarse))
    return replace(problem, axes=axes, moves=moves)
