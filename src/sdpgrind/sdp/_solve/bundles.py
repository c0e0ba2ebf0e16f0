"""Moves in bundles, cut into blocks of the grid, in this process or on an executor.

Shifts form one bundle, any other move its own. The cut depends on the grid alone and a result on its block
alone: results are bit-equal on any executor. A worker prepares a block once; later calls send only slices of
the value-to-go.
"""

import pickle
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.parallel import execute, one_blas_thread
from sdpgrind.sdp._problem.coordinates import Stages
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._solve.point_backup import PointBundle
from sdpgrind.sdp._solve.shift_backup import ShiftBundle
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.rows import RowsFound
from sdpgrind.sdp._transitions.shift import Shift

LINES, NODES = 4, 2048  # chosen: lines along the falling axis, nodes, of a block; smaller ones cost overhead


@dataclass(frozen=True)
class BundlePiece:
    """One block of one bundle, for a worker to prepare and evaluate."""

    moves: tuple[int, ...]
    per_mode: bool
    block: tuple[int, int]
    longest: int | None = None  # longest duration that is ever begun, stages; None: any

    def prepare(self, problem: Problem, grid: Grid, stage: float | None = None, keep: bool = True) -> Any:
        """Return the bundle of this block."""
        menus, block = [Menu(problem, grid, k) for k in self.moves], slice(*self.block)
        if isinstance(menus[0].move.to, Shift):
            return ShiftBundle(menus, self.per_mode, block, stage, self.longest)
        return PointBundle(menus[0], self.per_mode, block, stage, keep)


class Bundles:
    """All moves of a problem on a grid; with `longest`, stages, only those that can begin are evaluated."""

    def __init__(
        self,
        problem: Problem,
        grid: Grid,
        executor: Executor | None = None,
        keep: bool = True,
        longest: int | None = None,
    ) -> None:
        self.problem, self.grid, self.keep, self.longest = problem, grid, keep, longest
        self.shared = np.array([not _per_mode(Menu(problem, grid, k)) for k in range(len(problem.moves))])
        self.search_error = 0.0
        still = [k for k, move in enumerate(problem.moves) if not move.timed]
        self._timed = [k for k, move in enumerate(problem.moves) if move.timed]
        self._groups = [(moves, self._cut(moves)) for moves in self._together(still)]
        several = sum(len(pieces) for _, pieces in self._groups) > 1 and len(problem.axes) > 1
        self._remote = _Remote(problem, grid, executor) if executor is not None and several else None
        self._here = (
            {}
            if self._remote
            else {
                piece: piece.prepare(problem, grid, None, keep)
                for _, pieces in self._groups
                for piece in pieces
            }
        )

    def best(
        self, value: Floats, level: Floats, stage: int | None, last: int | None
    ) -> Iterator[tuple[list[int], RowsFound]]:
        """Yield the moves of each bundle with their best into value[mode, node], which is that of `stage`.

        Timed moves, and with `longest` all, that begin beyond the stage `last` are skipped; `stage` None: the
        late side.
        """
        for moves, pieces in self._groups:
            some = self._begun(moves, stage, last)
            if some.start < some.stop:
                yield moves[some], self._join(moves, pieces, self._evaluate(pieces, value, level, some))
        for move in self._timed:
            departure = stage + self.problem.moves[move].duration if stage is not None else None
            if departure is None or last is None or departure > last:
                continue
            yield [move], self.timed(move, value, level, departure)

    def _begun(self, moves: list[int], stage: int | None, last: int | None) -> slice:
        """Range from the first to the last of the `moves` that begin at the stage `last` at the latest."""
        if self.longest is None or stage is None or last is None:
            return slice(0, len(moves))
        begun = [k for k, move in enumerate(moves) if stage + self.problem.moves[move].duration <= last]
        return slice(begun[0], begun[-1] + 1) if begun else slice(0, 0)

    def timed(self, move: int, value: Floats, level: Floats, departure: int) -> RowsFound:
        """Return the best of one timed move from the stage `departure` into value[mode, node]."""
        pieces = self._cut([move])
        ready = [
            piece.prepare(self.problem, self.grid, departure * self.problem.step, keep=False)
            for piece in pieces
        ]
        return self._join([move], pieces, [(b.best(value, level), b.search_error) for b in ready])

    def alone(self) -> ShiftBundle | None:
        """Return the bundle if all moves are shifts of one axis and mode, in this process; else None."""
        if len(self.grid.shape) != 1 or len(self.problem.modes) > 1 or self._timed or len(self._here) != 1:
            return None
        bundle = next(iter(self._here.values()))
        return bundle if isinstance(bundle, ShiftBundle) else None

    def _evaluate(
        self, pieces: list[BundlePiece], value: Floats, level: Floats, some: slice
    ) -> list[tuple[RowsFound, float]]:
        if self._remote is not None:
            return self._remote.evaluate(pieces, value, level, some)
        ready = [self._here[piece] for piece in pieces]
        return [(bundle.best(value, level, some), bundle.search_error) for bundle in ready]

    def _join(
        self, moves: list[int], pieces: list[BundlePiece], results: list[tuple[RowsFound, float]]
    ) -> RowsFound:
        """Join blocks: [move, mode or 0, node]."""
        self.search_error = max(self.search_error, *(error for _, error in results))
        shift = self.problem.moves[moves[0]].to
        if len(pieces) == 1:
            found = results[0][0]
            if not isinstance(shift, Shift):
                return found
            if len(self.grid.shape) == 1:
                return RowsFound(found.q[:, :, 0], found.control[:, :, 0], found.entry[:, :, 0])
        parts = [
            np.concatenate([getattr(found, name) for found, _ in results], axis=2)
            for name in ("q", "control", "entry")
        ]
        if not isinstance(shift, Shift):
            return RowsFound(*parts)
        axis = shift.position(self.grid)
        rest = [n for k, n in enumerate(self.grid.shape) if k != axis]
        lines = [np.moveaxis(p.reshape(*p.shape[:2], *rest, p.shape[-1]), -1, axis + 2) for p in parts]
        return RowsFound(*(p.reshape(*p.shape[:2], self.grid.size) for p in lines))

    def _together(self, moves: list[int]) -> list[list[int]]:
        """Groups of moves, in their order: shifts of equal axis and treatment of modes together."""
        groups: dict[Any, list[int]] = {}
        for k in moves:
            to = self.problem.moves[k].to
            key = (to.axis, bool(self.shared[k])) if isinstance(to, Shift) else k
            groups.setdefault(key, []).append(k)
        return list(groups.values())

    def _cut(self, moves: list[int]) -> list[BundlePiece]:
        to = self.problem.moves[moves[0]].to
        total, size = self.grid.size, NODES
        if isinstance(to, Shift):
            total, size = self.grid.size // self.grid.shape[to.position(self.grid)], LINES
        return [
            BundlePiece(tuple(moves), not self.shared[moves[0]], (a, min(a + size, total)), self.longest)
            for a in range(0, total, size)
        ]


def _per_mode(menu: Menu) -> bool:
    """Whether a move is evaluated for each mode: it keeps the mode, or a callback reads it."""
    return len(menu.problem.modes) > 1 and (menu.move.into is None or _reads_mode(menu))


def _reads_mode(menu: Menu) -> bool:
    """Whether a callback fails at one node without the mode."""
    stages = menu.problem.stages
    stage = np.array([stages.step]) if isinstance(stages, Stages) else None
    first = tuple(x[:1] for x in menu.grid.points)
    try:
        menu.move.to.rows(menu, first, None, stage, np.zeros(1, dtype=np.int64), menu.levels[:1])
    except AttributeError as error:
        if error.name == "mode":
            return True
        raise
    return False


class _Remote:
    """Bundles in workers."""

    def __init__(self, problem: Problem, grid: Grid, executor: Executor) -> None:
        self.executor = executor
        self.recipe = pickle.dumps((problem, grid))

    def evaluate(
        self, pieces: list[BundlePiece], value: Floats, level: Floats, some: slice
    ) -> list[tuple[RowsFound, float]]:
        """Evaluate some moves of every piece; each worker unpacks the recipe once."""
        return execute(partial(_work, self.recipe, value, level, some), pieces, self.executor)


@lru_cache(maxsize=4)
def _unpacked(recipe: bytes) -> tuple[Problem, Grid]:
    problem, grid = pickle.loads(recipe)
    return problem, grid


@lru_cache(maxsize=256)
def _prepared(recipe: bytes, piece: BundlePiece) -> Any:
    return piece.prepare(*_unpacked(recipe))


def _work(
    recipe: bytes, value: Floats, level: Floats, some: slice, piece: BundlePiece
) -> tuple[RowsFound, float]:
    bundle = _prepared(recipe, piece)
    with one_blas_thread():
        return bundle.best(value, level, some), bundle.search_error
