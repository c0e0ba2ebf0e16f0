"""The weld-bead problem as one finite Markov decision process, for solvers that know nothing of stages or
structure.

Time is folded into the state: state = stage * nodes + node, and one absorbing state at the end. Rewards are
negative charges. Both sides use the same weights: those of the library's exact rows.
"""

import warnings
from collections.abc import Callable
from contextlib import redirect_stdout
from typing import NamedTuple

import numpy as np
from scipy import sparse

from sdpgrind import sdp
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._problem.stops import StopCharges
from sdpgrind.sdp._solve.stages import late_stages
from sdpgrind.sdp._transitions.menu import Menu


class Rows(NamedTuple):
    """All passes from all nodes: weights [(node, action), node], charges, and the duration of each action in
    stages.
    """

    weight: sparse.csr_array
    charge: np.ndarray
    duration: np.ndarray
    actions: int


def rows_of(problem: sdp.Problem) -> Rows:
    """Weights of every pass (duration, force level) from every node, node by node."""
    grid = Grid.of(problem)
    weights, charges, durations = [], [], []
    for k in range(len(problem.moves)):
        menu = Menu(problem, grid, k)
        x = np.repeat(grid.points[0], menu.rows)
        level = np.tile(menu.levels, grid.size)
        found = menu.move.to.rows(menu, (x,), None, None, np.zeros(x.size, dtype=np.int64), level)
        weights.append(found.matrix.reshape(grid.size, menu.rows, grid.size))
        charges.append(found.charge.reshape(grid.size, menu.rows))
        durations.append(np.full(menu.rows, menu.move.duration))
    dense = np.concatenate(weights, axis=1)
    dense[np.abs(dense) < 1e-14] = 0.0
    actions = dense.shape[1]
    return Rows(
        sparse.csr_array(dense.reshape(-1, grid.size)),
        np.concatenate(charges, axis=1).ravel(),
        np.concatenate(durations),
        actions,
    )


class Folded(NamedTuple):
    """State-action pairs in the order that quantecon wants: rewards, transitions, states, actions; and the
    table's shape.
    """

    reward: np.ndarray
    transition: sparse.csr_matrix
    state: np.ndarray
    action: np.ndarray
    stages: int
    nodes: int


def fold(problem: sdp.Problem, rows: Rows) -> Folded:
    """Fold time into the state, vectorised over the pairs of each stage."""
    grid, step = Grid.of(problem), problem.step
    n, stops = grid.size, StopCharges(problem, grid)
    first, _ = late_stages(problem, stops.largest())
    late = problem.stages.late
    stages = problem.stages.count - first + 1
    end = stages * n
    data, columns, counts, reward, state, action = [], [], [], [], [], []
    length = np.diff(rows.weight.indptr)
    pair_duration = np.tile(rows.duration, n)
    pair_node = np.repeat(np.arange(n), rows.actions)
    entry_duration = np.repeat(pair_duration, length)
    gone = 1.0 - np.asarray(rows.weight.sum(axis=1)).ravel()
    for stage in range(stages):
        on_grid = pair_duration <= stage  # passes that would end before the table are left out on both sides
        cost = float(late(-(stage + first) * step)) if late is not None and stage + first < 0 else 0.0
        kept = np.repeat(on_grid, length)
        # For each node: stop first, then the passes; a pass has one more entry, the absorbing state.
        order = np.concatenate(
            [
                np.arange(n) * (rows.actions + 1),
                (pair_node * (rows.actions + 1) + 1 + np.tile(np.arange(rows.actions), n))[on_grid],
            ]
        )
        place = np.argsort(order, kind="stable")
        starts = np.concatenate([np.zeros(n, int), length[on_grid] + 0])
        block_data = np.concatenate([np.ones(n), rows.weight.data[kept], gone[on_grid]])
        block_column = np.concatenate(
            [
                np.full(n, end),
                rows.weight.indices[kept] + (stage - entry_duration[kept]) * n,
                np.full(on_grid.sum(), end),
            ]
        )
        pair_of_entry = np.concatenate(
            [
                np.arange(n),
                n + np.repeat(np.arange(on_grid.sum()), length[on_grid]),
                n + np.arange(on_grid.sum()),
            ]
        )
        rank = np.empty(place.size, dtype=np.int64)
        rank[place] = np.arange(place.size)
        by = np.argsort(rank[pair_of_entry], kind="stable")
        data.append(block_data[by])
        columns.append(block_column[by])
        counts.append((np.concatenate([np.ones(n, int), starts[n:] + 1]))[place])
        landing = np.where(
            stage + first - pair_duration < 0,
            [0.0 if late is None else float(late(-(stage + first - d) * step)) for d in rows.duration] * n,
            0.0,
        )
        charge = np.concatenate(
            [stops.at(stage + first, cost)[0, 0], (rows.charge + gone * landing)[on_grid]]
        )
        reward.append(-charge[place])
        state.append(stage * n + np.concatenate([np.arange(n), pair_node[on_grid]])[place])
        action.append((order % (rows.actions + 1))[place])
    data.append(np.ones(1))
    columns.append(np.array([end]))
    counts.append(np.ones(1, int))
    pointer = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    matrix = sparse.csr_matrix(
        (np.concatenate(data), np.concatenate(columns), pointer), shape=(pointer.size - 1, end + 1)
    )
    return Folded(
        np.append(np.concatenate(reward), 0.0),
        matrix,
        np.append(np.concatenate(state), end),
        np.append(np.concatenate(action), 0),
        stages,
        n,
    )


Solve = Callable[[], tuple[np.ndarray, np.ndarray]]
"""Values, $, and actions, [stage, node], of a process that is ready to be solved."""


def quantecon(rows: Rows, folded: Folded) -> Solve:
    """Backward induction by quantecon, its process assembled outside what is called.

    Every pass takes some stages, so that fewer periods than stages are enough: this spares quantecon two
    thirds of its work.
    """
    from quantecon.markov import DiscreteDP, backward_induction

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # beta = 1 is what we want
        ddp = DiscreteDP(folded.reward, folded.transition, 1.0, folded.state, folded.action)
    shape = (folded.stages, folded.nodes)

    def solve() -> tuple[np.ndarray, np.ndarray]:
        values, policies = backward_induction(ddp, _periods(rows, folded))
        return -values[0][:-1].reshape(shape), policies[0][:-1].reshape(shape)

    return solve


def hiive(rows: Rows, folded: Folded) -> Solve:
    """Finite horizon by mdptoolbox-hiive, which wants every action in every state: inadmissible ones at a
    price, assembled outside what is called.
    """
    from hiive.mdptoolbox.mdp import FiniteHorizon

    size, actions = folded.stages * folded.nodes + 1, rows.actions + 1
    reward = np.full((size, actions), -1e6)
    reward[folded.state, folded.action] = folded.reward
    matrices = [_of_action(folded, a, size) for a in range(actions)]
    shape = (folded.stages, folded.nodes)
    with redirect_stdout(None):  # it warns of a discount of 1, which is what we want
        solver = FiniteHorizon(matrices, reward, 1.0, _periods(rows, folded), skip_check=True)

    def solve() -> tuple[np.ndarray, np.ndarray]:
        solver.run()
        return -solver.V[:-1, 0].reshape(shape), solver.policy[:-1, 0].reshape(shape)

    return solve


def _of_action(folded: Folded, action: int, size: int) -> sparse.csr_matrix:
    """Transitions of one action from every state; where it is inadmissible, to the end."""
    at = np.flatnonzero(folded.action == action)
    choose = sparse.csr_matrix(
        (np.ones(at.size), (folded.state[at], at)), shape=(size, folded.transition.shape[0])
    )
    missing = np.ones(size)
    missing[folded.state[at]] = 0.0
    ends = sparse.csr_matrix((missing, (np.arange(size), np.full(size, size - 1))), shape=(size, size))
    return (choose @ folded.transition + ends).tocsr()


def _periods(rows: Rows, folded: Folded) -> int:
    return folded.stages // int(rows.duration.min()) + 2
