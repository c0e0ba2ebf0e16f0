"""Moves grouped by how they are evaluated: all shifts together, everything else one by one."""

from collections.abc import Iterator
from concurrent.futures import Executor

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._grid import Grid
from sdpgrind.sdp._menu import Menu
from sdpgrind.sdp._problem import Problem, Stages
from sdpgrind.sdp._shift import Shift
from sdpgrind.sdp._toeplitz import Found, ShiftBundle


class Bundles:
    """All moves of a problem on a grid, ready to be evaluated into a value-to-go."""

    def __init__(self, problem: Problem, grid: Grid, executor: Executor | None = None) -> None:
        self.problem, self.grid = problem, grid
        self.menus = [Menu(problem, grid, k) for k in range(len(problem.moves))]
        self.shared = np.array([not self._per_mode(menu) for menu in self.menus])
        self._ready: list[tuple[list[int], ShiftBundle]] = []
        self._timed: list[int] = [k for k, move in enumerate(problem.moves) if move.timed]
        for per_mode in (False, True):
            shifts = [k for k, m in enumerate(self.menus) if isinstance(m.move.to, Shift) and not m.move.timed and self.shared[k] != per_mode]
            if shifts:
                self._ready.append((shifts, ShiftBundle([self.menus[k] for k in shifts], per_mode)))

    @property
    def search_error(self) -> float:
        """Largest amount ($) by which a parabola lowered a level."""
        return max((bundle.search_error for _, bundle in self._ready), default=0.0)

    def best(self, value: Floats, level: Floats, stage: int | None, last: int | None) -> Iterator[tuple[list[int], Found]]:
        """Yield the moves of each bundle with what is best into value[mode, node] at `stage`."""
        for moves, bundle in self._ready:
            yield moves, bundle.best(value, level)

    def _per_mode(self, menu: Menu) -> bool:
        """Whether the move must be evaluated for each mode: where it keeps the mode or a callback reads it."""
        if len(self.problem.modes) == 1:
            return False
        return menu.move.into is None
