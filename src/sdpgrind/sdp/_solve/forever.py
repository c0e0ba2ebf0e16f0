"""Problems without a deadline: value iteration, then policy iteration until nothing changes."""

import dataclasses
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from sdpgrind.base.checks import Floats
from sdpgrind.base.progress import Progress
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._problem.one_sided import Linear
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._problem.stops import StopCharges
from sdpgrind.sdp._solve import kernels as _kernels
from sdpgrind.sdp._solve import sweep_kernels as _sweep_kernels
from sdpgrind.sdp._solve.bundles import Bundles
from sdpgrind.sdp._solve.kinks import Changes
from sdpgrind.sdp._solve.stages import StageTable
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.rows import Rows
from sdpgrind.sdp._transitions.sampled import Sampled

SETTLED = 1e-11  # chosen: relative Bellman residual of a solution; a smaller one is rounding
DIRECT = 6000  # chosen: most states of a direct policy evaluation; more fill too much memory
ROUNDS = 5000  # chosen: of an evaluation by steps; a policy that needs more is improved by sweeps alone
NEAR = 1e-8  # chosen: relative residual above which an evaluation counts as failed


def solve_forever(problem: Problem, grid: Grid, bundles: Bundles, progress: Progress) -> StageTable:
    """Solve ``J = min(stop, min charge + E J)``; with a searched control, J is the cost of the policy."""
    refuse_endless(problem, grid)
    stops = StopCharges(problem, grid)
    value = np.zeros((len(problem.modes), grid.size))
    table = _improve(problem, grid, bundles, stops, value)
    searched = any(move.levels is not None and move.levels.search for move in problem.moves)
    followed: StageTable | None = None
    for sweep in range(10_000):
        change = float(np.max(np.abs(table.value[0] - value)))
        scale = max(1.0, float(np.max(np.abs(table.value[0]))))
        progress(min(0.99, sweep / 200), f"{grid.size} nodes, sweep {sweep}, change {change:.1e}")
        if change <= SETTLED * scale:
            _refuse_idle(problem, grid, table)
            return table
        # Ties and the search between levels leave a residual: there, go on as long as the policy gets
        # cheaper.
        near = searched or _tied(table.value[0], value)
        swept = value = table.value[0]
        if change <= 1e-2 * scale or sweep % 20 == 19:
            value = _evaluated(problem, grid, stops, table, swept)
        if value is not swept:
            if near and followed is not None and np.mean(followed.value - value) <= SETTLED * scale:
                return followed
            followed = dataclasses.replace(table, value=value[None])
        table = _improve(problem, grid, bundles, stops, value)
    raise ValueError(f"the value-to-go does not settle; the last sweep still changed it by {change:.3g} $")


def _tied(new: Floats, old: Floats) -> bool:
    """Whether values differ by no more than a tie."""
    return bool(np.all(np.abs(new - old) <= _kernels.TIE_ABS + _kernels.TIE_REL * np.abs(new)))


def _improve(problem: Problem, grid: Grid, bundles: Bundles, stops: StopCharges, value: Floats) -> StageTable:
    """One Bellman sweep."""
    shape = (len(problem.moves), *value.shape)
    q, u, a = np.full(shape, np.inf), np.zeros(shape), np.zeros(shape, dtype=np.int32)
    for moves, found in bundles.best(value, stops.level(), None, None):
        for k, move in enumerate(moves):
            used = slice(0, 1) if bundles.shared[move] else slice(None)
            q[move, used], u[move, used], a[move, used] = found.q[k], found.control[k], found.entry[k]
    stop_q = stops.at(0, 0.0) if problem.stops else np.full((0, *value.shape), np.inf)
    table = StageTable.empty(0, 1, *value.shape)
    _sweep_kernels.choose(stop_q, (q, u, a), bundles.shared, table.slice(0))
    if len(grid.shape) != 1:
        return dataclasses.replace(table, search_error=bundles.search_error)
    changes = Changes.of(problem, bundles.shared)
    changes.add(0, stop_q, (q, u, a), table.best[0], table.entry[0], table.control[0])
    return dataclasses.replace(table, search_error=bundles.search_error, changes=changes)


def policy_rows(
    problem: Problem, grid: Grid, best: Any, control: Floats, entry: Any
) -> list[tuple[Any, Any, Rows]]:
    """Return for each move of a policy [mode, node]: the modes and nodes that use it, and its exact rows."""
    out = []
    for k in range(len(problem.moves)):
        mode, node = np.nonzero(best == k)
        if node.size:
            menu = Menu(problem, grid, k)
            start = tuple(x[node] for x in grid.points)
            told = mode if len(problem.modes) > 1 else None
            rows = menu.move.to.rows(
                menu, start, told, None, entry[mode, node].astype(np.int64), control[mode, node]
            )
            out.append((mode, node, rows))
    return out


def _evaluated(problem: Problem, grid: Grid, stops: StopCharges, table: StageTable, value: Floats) -> Floats:
    """Cost of following the table's policy; `value` if that policy never ends."""
    size = value.size
    rest = np.zeros(size)
    best = table.best[0]
    stop_q = stops.at(0, 0.0) if problem.stops else None
    if stop_q is not None:
        for k in range(stop_q.shape[0]):
            rest.reshape(value.shape)[best == -1 - k] = stop_q[k][best == -1 - k]
    found_rows = policy_rows(problem, grid, best, table.control[0], table.entry[0])
    for mode, node, rows in found_rows:
        rest[mode * grid.size + node] = rows.charge + rows.stopped * stops.level()[rows.mode]
    step = transitions(found_rows, grid, size)
    found = settled(step, rest, value.ravel())
    good = np.all(np.isfinite(found)) and _solves(found, step, rest)
    return found.reshape(value.shape) if good else value


def _solves(value: Floats, step: Any, rest: Floats) -> bool:
    """Whether value = rest + step value, nearly."""
    return bool(np.max(np.abs(step @ value + rest - value)) <= NEAR * max(1.0, np.max(np.abs(value))))


def transitions(found: list[tuple[Any, Any, Rows]], grid: Grid, size: int) -> Any:
    """Sparse matrix of one step of a policy over all (mode, node); empty rows where it stops."""
    step = sparse.csr_array((size, size))
    for mode, node, rows in found:
        matrix = sparse.coo_array(rows.matrix)
        start, end = mode * grid.size + node, rows.mode * grid.size
        step = step + sparse.csr_array(
            (matrix.data, (start[matrix.row], end[matrix.row] + matrix.col)), shape=(size, size)
        )
    return step


def _refuse_idle(problem: Problem, grid: Grid, table: StageTable) -> None:
    """Raise if the best policy never ends: moves without charge or progress look cheaper than any stop."""
    best = table.best[0]
    found = policy_rows(problem, grid, best, table.control[0], table.entry[0])
    step = transitions(found, grid, best.size)
    away = np.asarray(step.sum(axis=1)) > 1 - 1e-12
    while True:
        now = away & ~(step @ (~away).astype(float) > 1e-15)
        if np.array_equal(now, away):
            break
        away = now
    if np.any(away):
        mode, node = np.argwhere(away.reshape(best.shape))[0]
        raise ValueError(
            f"the best policy never ends from {_place(problem, grid, mode, node)}: "
            "a move that leads nowhere must be charged"
        )


def _place(problem: Problem, grid: Grid, mode: int, node: int) -> str:
    where = ", ".join(
        f"{a.name} = {x[node]:g} {a.unit}".strip() for a, x in zip(grid.axes, grid.points, strict=True)
    )
    return (where or "its start") + (f", mode {problem.modes[mode]!r}" if len(problem.modes) > 1 else "")


def settled(step: Any, rest: Floats, start: Floats) -> Floats:
    """Return the solution ($) of value = rest + step value; NaN where there is none or steps miss it.

    `start`: near it.
    """
    if start.size <= DIRECT:
        try:
            return np.asarray(splu(sparse.csc_array(sparse.eye_array(start.size) - step)).solve(rest))
        except RuntimeError:  # singular: endless policy
            return np.full(start.size, np.nan)
    value = start
    for _ in range(ROUNDS):
        new = step @ value + rest
        if np.max(np.abs(new - value)) <= 1e-12 * max(1.0, float(np.max(np.abs(new)))):
            return np.asarray(new)
        value = new
    return np.asarray(new) if _solves(new, step, rest) else np.full(start.size, np.nan)


def refuse_endless(problem: Problem, grid: Grid) -> None:
    """Raise if some state cannot reach a stop or a stopping edge, by backward sweeps."""
    bare = _without_charges(problem)
    bundles, stops = Bundles(bare, grid), StopCharges(bare, grid)
    away = np.ones((len(problem.modes), grid.size))
    while True:
        table = _improve(bare, grid, bundles, stops, away)
        now = np.where(np.minimum(table.value[0], away) < 1 - 1e-12, 0.0, 1.0)
        if np.array_equal(now, away):
            break
        away = now
    if np.any(away):
        place = _place(problem, grid, *np.argwhere(away)[0])
        raise ValueError(f"the process never ends from {place}: no policy reaches a stop from there")


def _without_charges(problem: Problem) -> Problem:
    """Return the problem with moves, stops and edges that cost nothing."""
    replace = dataclasses.replace
    return replace(
        problem,
        axes=[replace(a, below=_free(a.below), above=_free(a.above)) for a in problem.axes],
        moves=[
            replace(m, charge=0.0, to=replace(m.to, charge=None) if isinstance(m.to, Sampled) else m.to)
            for m in problem.moves
        ],
        stops=[
            replace(
                s,
                charge=Charge(Linear(0.0), Linear(0.0)) if isinstance(s.charge, Charge) else _nothing,
                extra=None,
            )
            for s in problem.stops
        ],
    )


def _free(edge: Any) -> Any:
    return edge if isinstance(edge, str) else 0.0


def _nothing(s: Any) -> float:
    return 0.0
