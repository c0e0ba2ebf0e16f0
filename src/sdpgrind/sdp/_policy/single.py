"""Look-ups of one state in microseconds, without arrays."""

from functools import partial
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._policy.single_kernels import (
    AXES,
    CELL_UNREAD,
    CHARGED,
    FOUND,
    HOLD,
    OUTSIDE,
    REFUSE,
    STOP,
    UNREAD,
    act_at,
    value_at,
)
from sdpgrind.sdp._policy.table import Solution
from sdpgrind.sdp._problem.coordinates import Axis
from sdpgrind.sdp._solve.kinks import Kinks

_Found = tuple[int, int, int, float, float]
_EDGES = {"hold": HOLD, "refuse": REFUSE, "stop": STOP}


class SingleStates:
    """Value and action of a table at one state; None: its arrays must be asked, which know or refuse it.

    Lines of cells in which the action changes are found when a state first lies in such a cell: they take
    long after a new plan.

    Parameters
    ----------
    solution : Solution
        Solved problem of one to three axes.
    """

    def __init__(self, solution: Solution) -> None:
        table, none = solution.table, Kinks.none((0, 0, 0))
        self._solution, self._read = solution, False
        self._place = frame_of(solution), solution.shape
        self._act = table.best, table.entry, table.control, table.gap
        self._value = table.value
        self._put(none._replace(at=self._marked))

    @staticmethod
    def of(solution: Solution) -> "SingleStates | None":
        """Return the look-ups of a table; None: it has no axis, or too many."""
        return SingleStates(solution) if 1 <= len(solution.grid.axes) <= AXES else None

    def act(self, time: float, x: float, y: float = 0.0, z: float = 0.0, mode: int = 0) -> _Found | None:
        """Return state (see `act_at`), move (stops < 0), entry, control and gap ($)."""
        found: _Found = self._act_at(mode, time, x, y, z)
        if found[0] <= OUTSIDE:
            return found
        return self.act(time, x, y, z, mode) if found[0] == UNREAD and self._learn() else None

    def value(self, time: float, x: float, y: float = 0.0, z: float = 0.0, mode: int = 0) -> float | None:
        """Return the value-to-go ($) at a stage coordinate and coordinates."""
        state, found = self._value_at(mode, time, x, y, z)
        if state == FOUND:
            return float(found)
        return self.value(time, x, y, z, mode) if state == UNREAD and self._learn() else None

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Constants of `act_at`, with the lines of all cells, for exports."""
        self._learn()
        return self._act_at.args

    @property
    def _marked(self) -> Any:
        """Numbers of the cells of one axis before their lines are known."""
        at = np.where(self._solution.changed, np.int32(CELL_UNREAD), np.int32(-1))
        return self._with_bent(at)

    def _with_bent(self, at: Any) -> Any:
        """Numbers of cells; where the charge of a stop is bent, lines are not all."""
        bent = self._solution.bent
        return np.where(bent, np.int32(CELL_UNREAD), at) if bent.size else at

    def _learn(self) -> bool:
        """Find the lines; return whether they were unknown."""
        if self._read:
            return False
        kinks = self._solution.kinks
        self._put(kinks._replace(at=self._with_bent(kinks.at)))
        self._read = True
        return True

    def _put(self, kinks: Kinks) -> None:
        lines = np.column_stack([kinks.cost, kinks.control, kinks.act, kinks.entry])
        where = np.ascontiguousarray(kinks.at), np.ascontiguousarray(kinks.start), lines
        self._act_at = partial(act_at, *self._place, *self._act, *where)
        self._value_at = partial(value_at, *self._place, self._value, *where)


def frame_of(solution: Solution) -> Floats:
    """Return stages and axes as rows for the kernels, (1 + axes, 7)."""
    layout, count, grid = solution.layout, solution.countdown, solution.grid
    stages = [layout.step, layout.count, count.first, count.lowest, count.has_base, layout.endless, 0.0]
    axes = [_row(axis, spacing) for axis, spacing in zip(grid.axes, grid.spacing, strict=True)]
    return np.array([stages, *axes], dtype=float)


def _row(axis: Axis, spacing: float) -> list[float]:
    log = axis.scale == "log"
    origin = float(np.log(axis.low)) if log else axis.low
    return [origin, spacing, log, axis.low, axis.high, _code(axis.below), _code(axis.above)]


def _code(edge: Any) -> int:
    return _EDGES[edge] if isinstance(edge, str) else CHARGED
