"""The weld-bead problem as one finite Markov decision process, for solvers that know nothing of stages or
structure.

Time is folded into the state: state = stage * nodes + node, and one absorbing state at the end. Rewards are
negative charges. Both sides use the same weights: those of the library's exact rows.
"""

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from sdpgrind import sdp, weldbead
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


class Stacked(NamedTuple):
    """The same weights as dense arrays for numpy: [duration, level * node, node], and what is charged."""

    weight: np.ndarray
    charge: np.ndarray  # [stage, duration, level * node]
    stop: np.ndarray  # [stage, node]
    duration: np.ndarray  # in stages, rising


def stack(problem: sdp.Problem, rows: Rows) -> Stacked:
    """Put the weights into arrays, outside the time that is told."""
    grid, step, late = Grid.of(problem), problem.step, problem.stages.late
    n, stops = grid.size, StopCharges(problem, grid)
    first, _ = late_stages(problem, stops.largest())
    duration, levels = np.unique(rows.duration, return_counts=True)
    if np.any(np.diff(rows.duration) < 0) or np.ptp(levels):
        raise ValueError("durations must rise, each with as many levels")
    shape = (n, duration.size, levels[0])
    weight = rows.weight.toarray().reshape(*shape, n).transpose(1, 2, 0, 3).reshape(duration.size, -1, n)
    charge = rows.charge.reshape(shape).transpose(1, 2, 0).reshape(duration.size, -1)
    stage = np.arange(first, problem.stages.count + 1)
    beyond = np.maximum(duration - stage[:, None], 0) * step  # late at the end of a pass
    behind = np.maximum(-stage, 0) * step
    lateness = np.zeros_like(beyond) if late is None else np.asarray(late(beyond))
    cost = np.zeros(stage.size) if late is None else np.asarray(late(behind))
    gone = 1.0 - weight.sum(axis=2)
    stop = np.array([stops.at(k, c)[0, 0] for k, c in zip(stage.tolist(), cost.tolist(), strict=True)])
    return Stacked(weight, charge + gone * lateness[:, :, None], stop, duration)


def solve_numpy(ready: Stacked) -> tuple[np.ndarray, np.ndarray]:
    """Values and actions by plain backward induction, the strongest simple rival."""
    weight, charge, stop, duration = ready
    value, action, node = stop.copy(), np.zeros(stop.shape, int), np.arange(stop.shape[1])
    for stage in range(int(duration[0]), len(stop)):
        count = int(np.searchsorted(duration, stage, side="right"))
        ahead = value[stage - duration[:count], :, None]
        cost = (charge[stage, :count] + (weight[:count] @ ahead)[..., 0]).reshape(-1, node.size)
        best = cost.argmin(axis=0)
        action[stage] = np.where(cost[best, node] < stop[stage], best + 1, 0)
        value[stage] = np.minimum(stop[stage], cost[best, node])
    return value, action


def solve_quantecon(problem: sdp.Problem, rows: Rows, tight: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Values [stage, node] and actions by quantecon's backward induction.

    The folded process ends within as many periods as there are stages; `tight` uses what we know besides,
    that every pass takes at least three, and so spares quantecon two thirds of its work.
    """
    return assembled_quantecon(problem, rows, tight)()


Solve = Callable[[], tuple[np.ndarray, np.ndarray]]


def assembled_quantecon(problem: sdp.Problem, rows: Rows, tight: bool = True) -> Solve:
    """The solver alone: the folded process is assembled here, outside what is called."""
    from quantecon.markov import DiscreteDP, backward_induction

    folded = fold(problem, rows)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # beta = 1 is what we want
        ddp = DiscreteDP(folded.reward, folded.transition, 1.0, folded.state, folded.action)
    periods = folded.stages // int(rows.duration.min()) + 2 if tight else folded.stages
    shape = (folded.stages, folded.nodes)

    def solve() -> tuple[np.ndarray, np.ndarray]:
        values, policies = backward_induction(ddp, periods)
        return -values[0][:-1].reshape(shape), policies[0][:-1].reshape(shape)

    return solve


def solve_hiive(problem: sdp.Problem, rows: Rows) -> np.ndarray:
    """Values [stage, node] by mdptoolbox-hiive's finite horizon; every action in every state, inadmissible
    ones at a price.
    """
    from hiive.mdptoolbox.mdp import FiniteHorizon

    folded = fold(problem, rows)
    size, actions = folded.stages * folded.nodes + 1, rows.actions + 1
    reward = np.full((size, actions), -1e6)
    reward[folded.state, folded.action] = folded.reward
    matrices = []
    for a in range(actions):
        at = np.flatnonzero(folded.action == a)
        choose = sparse.csr_matrix(
            (np.ones(at.size), (folded.state[at], at)), shape=(size, folded.transition.shape[0])
        )
        move = choose @ folded.transition
        missing = np.ones(size)
        missing[folded.state[at]] = 0.0
        matrices.append(
            (
                move
                + sparse.csr_matrix((missing, (np.arange(size), np.full(size, size - 1))), shape=(size, size))
            ).tocsr()
        )
    solver = FiniteHorizon(
        matrices, reward, 1.0, folded.stages // int(rows.duration.min()) + 2, skip_check=True
    )
    solver.run()
    return -solver.V[:-1, 0].reshape(folded.stages, folded.nodes)


def brown_grid(name: str, refine: int = 1, levels: int = 51) -> sdp.Problem:
    """Preset `name` on Brown's grid (0.1 mm, 2 s), or finer by `refine` in both; plain levels of force, no
    search.
    """
    problem = weldbead.preset(name)
    problem = problem.replace(stage=problem.stage / refine)
    return weldbead.sequence.sdp_problem(problem, nodes=20 * refine + 1, levels=levels, search=False)
