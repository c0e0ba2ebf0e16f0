"""Error of a grid from the change between it and a coarser one."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sdpgrind.sdp._plan.jumps import away, jumps, spreads
from sdpgrind.sdp._plan.look_up_error import between_nodes
from sdpgrind.sdp._policy.policy import Policy
from sdpgrind.sdp._problem.coordinates import Levels
from sdpgrind.sdp._problem.problem import Problem

COARSEST = 5  # derived: least nodes of an axis of which half, three, are an axis
JUMPED = 0.5  # order of the error by a charge that jumps; measured: 0.6 for a constant one from the target on


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


class GridChanges(NamedTuple):
    """Largest changes between two grids, $: at all nodes of the finer, at those that both share, and the same
    without those within a cell of a charge that jumps.
    """

    every: float
    shared: float
    away: float
    away_shared: float


def changes_between(coarse: Policy, fine: Policy) -> GridChanges:
    """Return the largest changes from a coarse grid to a fine one."""
    shape = fine.grid.shape
    row, mode, *node = (x.ravel() for x in np.indices((*fine.table.value.shape[:2], *shape)))
    ratio = [(m - 1) / (n - 1) for m, n in zip(coarse.grid.shape, shape, strict=True)]
    index = np.array(ratio)[:, None] * np.array(node).reshape(len(shape), row.size)
    change = np.abs(coarse.interpolated(row, mode, index) - fine.table.value.ravel())
    every, shared = np.ones(row.size, bool), np.all(index % 1 == 0, axis=0)
    far = away(fine.need_problem("an error"), fine.grid, np.array(node).reshape(index.shape))
    places = (every, shared, far, far & shared)
    return GridChanges(*(float(np.max(change, where=where, initial=0.0)) for where in places))


def away_error(policy: Policy, found: list[GridChanges]) -> float | None:
    """Return the estimated error ($) of the last grid over a cell off all jumps; None: as everywhere."""
    problem = policy.need_problem("an error")
    if not jumps(problem) or spreads(problem):
        return None
    shared = grid_error([each.away_shared for each in found]) + between_nodes(policy, off_jumps=True)
    return max(grid_error([each.away for each in found]), shared) + policy.table.search_error


def estimated(policy: Policy, solve: Callable[[Problem, int], Policy]) -> tuple[float, float | None]:
    """Return the estimated error of a grid, $, by a second one: of half the cells, or twice where few.

    The second number is that away from charges that jump; None: as everywhere. The error is of first order,
    the change to the coarser grid that of the finer; where a charge jumps, of the order `JUMPED`.
    """
    problem = policy.need_problem("an error")
    few = any(axis.nodes < COARSEST for axis in problem.axes)
    other = solve(problem if few else _halved(problem), 2 if few else 1)
    coarse, fine = (policy, other) if few else (other, policy)
    change, search = changes_between(coarse, fine), policy.table.search_error
    if not jumps(problem):
        return _of_change(1.0, few) * change.every + search, None
    factor = _of_change(JUMPED, few)
    error = max(factor * change.every, factor * change.shared + between_nodes(policy))
    if spreads(problem):
        return error + search, None
    factor = _of_change(1.0, few)
    off = max(factor * change.away, factor * change.away_shared + between_nodes(policy, off_jumps=True))
    return error + search, off + search


def _of_change(order: float, coarse: bool) -> float:
    """Error of the finer of two grids over their change, or of the coarser; one has half the cells."""
    ratio = float(2.0**order)
    return (ratio if coarse else 1.0) / (ratio - 1.0)


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
