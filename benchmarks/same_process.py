"""One finite decision process, three ways: the library, plain numpy, and packages of the field.

Brown's grid of a weld-bead job: heights by 0.1 mm, stages of 2 s, 51 forces and that where the law changes, 8
durations. What is put together before (weights of the laws, arrays of a package) is timed apart from the
induction, and values must agree.
"""

import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import peers
import peers_numpy
from measure import in_turn, peak_memory

from sdpgrind import sdp, weldbead
from sdpgrind.base.parallel import one_blas_thread
from sdpgrind.base.progress import silent
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._solve.bundles import Bundles
from sdpgrind.sdp._solve.stages import solve_stages

QUICK = "--quick" in sys.argv
LEVELS = 51
EQUAL = 1e-12  # $; derived: 300 stages round values of some $ by 2e-16 of them, each a few times
CASES = (("P1", 1, 15), ("P5", 1, 15), ("P1", 10, 5))  # preset, refinement of both axes, runs


class Way(NamedTuple):
    """One way to solve: what is called for the weights, for arrays of them, for the induction, and for all."""

    weights: Callable[[], object]
    arrays: Callable[[], object] | None
    solve: Callable[[], object]
    whole: Callable[[], object]
    answer: Callable[[], tuple[np.ndarray, np.ndarray]]  # values, $, and actions, [stage, node]


def same_process() -> None:
    """Print the table."""
    print(
        "\n## The same finite decision process: heights by 0.1 mm x 2 s, 51 forces, 8 durations; times in ms"
    )
    print("In brackets: how many times ours. Arrays of a package are put together by this benchmark.")
    print(
        "| process | by | weights | arrays of them | solver | from the laws | largest difference | memory |\n"
        "|---|---|---|---|---|---|---|---|"
    )
    for name, refine, runs in CASES:
        _table(name, refine, max(3, runs // 5) if QUICK else runs)


def _table(name: str, refine: int, runs: int) -> None:
    problem = weldbead.preset(name)
    problem = problem.replace(stage=problem.stage / refine)
    nodes = 20 * refine + 1
    ways = {"this library": _ours(problem, nodes), "plain numpy": _numpy(problem, nodes)}
    if refine == 1:  # finer: 1.3e9 weights, 15 GB of arrays
        ways |= _packages(problem, nodes, hiive=name == "P1" and not QUICK)
    value, _ = ways["this library"].answer()
    took = in_turn({f"{who} {k}": run for who, way in ways.items() for k, run in _timed(way)}, runs)
    for who, way in ways.items():
        found, action = way.answer()
        off = float(np.max(np.abs(found - value)))
        worse = _worse(problem, nodes, value, action) if refine == 1 else 0
        if off > EQUAL or worse:
            raise AssertionError(f"{who} must find these values and actions; got {off:g} $, {worse} worse")
        print(f"| {name}, {value.size} states | {who} | {_told(took, who)} | {off:.0e} $ | {_memory(way)} |")


def _timed(way: Way) -> list[tuple[str, Callable[[], object]]]:
    parts = {"weights": way.weights, "arrays": way.arrays, "solve": way.solve, "whole": way.whole}
    return [(name, run) for name, run in parts.items() if run is not None]


def _told(took: dict[str, float], who: str) -> str:
    """Times, ms, and those of solver and whole over ours."""
    told = []
    for part in ("weights", "arrays", "solve", "whole"):
        time = took.get(f"{who} {part}")
        ratio = f" ({time / took[f'this library {part}']:.2g})" if time and part in ("solve", "whole") else ""
        told.append("" if time is None else f"{1e3 * time:.3g}{ratio}")
    return " | ".join(told)


def _memory(way: Way) -> str:
    return f"{peak_memory(way.whole):.0f} MB"


def _grid(problem: weldbead.SequenceProblem, nodes: int) -> sdp.Problem:
    return weldbead.sequence.sdp_problem(problem, nodes, levels=LEVELS, search=False)


def _ours(problem: weldbead.SequenceProblem, nodes: int) -> Way:
    plain = _grid(problem, nodes)
    grid = Grid.of(plain)
    longest = None if problem.lateness_charge else round(problem.horizon / problem.stage)

    def weights() -> Bundles:
        return Bundles(plain, grid, longest=longest)

    ready = weights()

    def solve() -> object:
        with one_blas_thread():
            return solve_stages(plain, grid, ready, silent)

    def whole() -> sdp.Policy:
        return sdp.plan(_grid(problem, nodes), progress=silent)

    def answer() -> tuple[np.ndarray, np.ndarray]:
        policy = whole()
        start = 1 if policy.countdown.has_base else 0
        return policy.table.value[start:, 0], np.zeros(())

    return Way(weights, None, solve, whole, answer)


def _numpy(problem: weldbead.SequenceProblem, nodes: int) -> Way:
    ready = peers_numpy.assemble(problem, nodes, LEVELS)

    def whole() -> tuple[np.ndarray, np.ndarray]:
        return peers_numpy.solve(peers_numpy.assemble(problem, nodes, LEVELS))

    return Way(
        lambda: peers_numpy.assemble(problem, nodes, LEVELS), None, lambda: peers_numpy.solve(ready),
        whole, whole,
    )  # fmt: skip


def _packages(problem: weldbead.SequenceProblem, nodes: int, hiive: bool) -> dict[str, Way]:
    """Packages, with the weights that the library gives for any process."""
    plain = _grid(problem, nodes)
    rows = peers.rows_of(plain)
    folded = peers.fold(plain, rows)
    makers = {"quantecon": peers.quantecon} | ({"mdptoolbox-hiive": peers.hiive} if hiive else {})
    ways = {}
    for who, make in makers.items():
        ready = make(rows, folded)

        def arrays(make: Callable[..., peers.Solve] = make) -> peers.Solve:
            return make(rows, peers.fold(plain, rows))

        def whole(make: Callable[..., peers.Solve] = make) -> object:
            rows = peers.rows_of(plain)
            return make(rows, peers.fold(plain, rows))()

        ways[who] = Way(lambda: peers.rows_of(plain), arrays, ready, whole, ready)
    return ways


def _worse(problem: weldbead.SequenceProblem, nodes: int, value: np.ndarray, action: np.ndarray) -> int:
    """States where an action, followed once, costs over 1e-9 $ more than the value; without actions none."""
    if not action.shape:
        return 0
    rows, late = peers.rows_of(_grid(problem, nodes)), problem.lateness_charge or np.zeros_like
    stage, node = np.indices(action.shape)
    stops, chosen = action == 0, np.maximum(action - 1, 0)
    arrival = np.where(stops, stage, np.maximum(stage - rows.duration[chosen], 0))
    weight = rows.weight.toarray().reshape(nodes, rows.actions, nodes)[node, chosen]
    moved = np.sum(weight * value[arrival], axis=2) + rows.charge.reshape(nodes, -1)[node, chosen]
    stopped = problem.height_charge(np.linspace(0.0, problem.height_max, nodes))
    behind = np.maximum(round((problem.late_window or 0.0) / problem.stage) - arrival, 0) * problem.stage
    cost = np.where(stops, stopped, moved) + np.where(stops, 1.0, 1.0 - weight.sum(axis=2)) * late(behind)
    return int(np.sum(cost > value + 1e-9))
