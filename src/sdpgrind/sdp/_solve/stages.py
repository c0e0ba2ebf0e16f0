"""Backward induction over a countdown, with stops and moves of several durations; being late is charged.

The value-to-go of stage n is finished first; then every move is evaluated *into* it, and the result kept
until the stage ``n + duration`` of its start. Each slice is multiplied once, by all rows of all moves.

Before the first stage of the table the value-to-go is ``base + late(time)``. For a linear late charge, base
is the stationary solution ``V = min{stop, min charge + rate * T + E V}``, exact for all late times; for a
convex one it is the stop charge, as no move pays once ``late(t + T_min) - late(t)`` exceeds every stop
charge.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.base.progress import Progress
from sdpgrind.sdp._problem.coordinates import Stages
from sdpgrind.sdp._problem.countdown import Countdown
from sdpgrind.sdp._problem.grid import Grid
from sdpgrind.sdp._problem.one_sided import Linear, OneSided
from sdpgrind.sdp._problem.problem import Problem
from sdpgrind.sdp._problem.stops import StopCharges
from sdpgrind.sdp._solve import sweep_kernels as _sweep_kernels
from sdpgrind.sdp._solve.bundles import Bundles
from sdpgrind.sdp._solve.kinks import Changes

SMALL = 64  # chosen: nodes below which the induction is one compiled call; on more, Python's share is small
HISTORY = 2**26  # chosen: bytes of costs kept for the kinks; more cost memory
TABLES = ("value", "best", "move", "control", "entry", "gap")
TABLES_SHARE = 0.45  # measured: of the time of a grid, before its first stage; 40 to 50 % from 801 nodes on
CONVERGED = 1e-13  # chosen: relative change of a solved stationary late side; a smaller one is rounding


@dataclass(frozen=True)
class StageTable:
    """Solution on the grid; the first axis is the stage, from `first` on (one entry for `Forever`).

    `best` counts stops as -1, -2, ... and moves as 0, 1, ...; `move`, `control` and `entry` are those of the
    best move, also where a stop is better (-1 and NaN: no move allowed); `base` holds before the first stage.
    """

    first: int
    value: Floats
    best: npt.NDArray[np.int16]
    move: npt.NDArray[np.int16]
    control: Floats
    entry: npt.NDArray[np.int32]
    gap: Floats
    search_error: float = 0.0  # of the search between levels, estimated, no bound, $
    changes: Changes | None = None  # on one axis
    base: "StageTable | None" = None

    @classmethod
    def empty(cls, first: int, stages: int, modes: int, nodes: int) -> "StageTable":
        """Return an empty table."""
        shape = (stages, modes, nodes)
        best, move, entry = np.empty(shape, np.int16), np.empty(shape, np.int16), np.empty(shape, np.int32)
        return cls(first, np.empty(shape), best, move, np.empty(shape), entry, np.empty(shape))

    @property
    def arrays(self) -> tuple[Any, ...]:
        """Arrays in the order of `TABLES`."""
        return self.value, self.best, self.move, self.control, self.entry, self.gap

    def slice(self, row: int) -> tuple[Any, ...]:
        """Arrays of one stage, [mode, node]."""
        return tuple(array[row] for array in self.arrays)

    def stacked(self) -> "StageTable":
        """Return the table with its base as first slice."""
        if self.base is None:
            return self
        joined: Any = [np.concatenate(pair) for pair in zip(self.base.arrays, self.arrays, strict=True)]
        changes = self.changes.shifted(self.base.changes) if self.changes else None
        return replace(
            self, first=self.first - 1, base=None, changes=changes, **dict(zip(TABLES, joined, strict=True))
        )


def late_stages(problem: Problem, stop_max: float) -> tuple[int, bool]:
    """Return the first stage of the table (<= 0), and whether its base is the stationary solution."""
    stages = problem.stages
    assert isinstance(stages, Stages)
    late = stages.late
    if late is None:
        return 0, False
    if isinstance(late, Linear) and stages.late_window is None:
        return -int(np.ceil(late.tolerance / stages.step - 1e-9)), True
    shortest = min(move.duration for move in problem.moves) * stages.step
    if stages.late_window is not None:
        window = stages.late_window
    elif not isinstance(late, OneSided) or late.zero or not late.convex:
        raise ValueError(
            f"late must be convex and not nothing, or late_window be given ({stages.unit}); got {late!r}"
        )
    else:
        window = stages.step
        while late(window + shortest) - late(window) <= stop_max and window < 1e6 * stages.step:
            window *= 2
    return -int(np.ceil(window / stages.step - 1e-9)), False


def solve_stages(problem: Problem, grid: Grid, bundles: Bundles, progress: Progress) -> StageTable:
    """Solve on the grid by backward induction."""
    stages = problem.stages
    assert isinstance(stages, Stages)
    stops = StopCharges(problem, grid)
    first, stationary = late_stages(problem, stops.largest())
    _refuse_late(problem, stops, first, stationary)
    sweep = _Sweep(problem, grid, bundles, stops, first, stages.count)
    if stages.late is not None:
        sweep.base = sweep.stationary(stages.late) if stationary else sweep.stopped()
    if sweep.at_once():
        return sweep.table()
    rows = stages.count - first + 1
    for row in range(rows):
        sweep.step(first + row)
        if (row + 1) % max(1, rows // 64) == 0:
            share = TABLES_SHARE + (1 - TABLES_SHARE) * (row + 1) / rows
            progress(share, f"{grid.size} nodes: stage {row + 1} of {rows}")
    return sweep.table()


def _refuse_late(problem: Problem, stops: StopCharges, first: int, stationary: bool) -> None:
    """Refuse problems without a late side: no stop there, or a need of the stage coordinate."""
    stages = problem.stages
    if not isinstance(stages, Stages) or stages.late is None:
        return
    if not np.all(np.isfinite(stops.at(first - 1, 0.0).min(axis=0, initial=np.inf))):
        raise ValueError(
            "late must be None where one may not stop everywhere; a stop is masked, or there is none"
        )
    timed = [move.name for move in problem.moves if move.timed]
    if stationary and timed:
        raise ValueError(
            f"late_window must be given ({stages.unit}) where moves are timed:"
            f" their late side has no end; got None and {timed[0]!r}"
        )


class _Sweep:
    """Working arrays of one backward induction."""

    def __init__(
        self, problem: Problem, grid: Grid, bundles: Bundles, stops: StopCharges, first: int, last: int
    ) -> None:
        self.problem, self.grid, self.bundles, self.stops, self.first = problem, grid, bundles, stops, first
        self.modes, self.countdown = len(problem.modes), Countdown.of(problem.stages, first)
        self.duration = np.array([move.duration for move in problem.moves])
        longest, rows = int(self.duration.max()), last - first + 1
        alone = bundles.alone() is not None and stops.still is not None
        self.small = alone and grid.size < SMALL
        self.keeps = alone and 20 * (rows + longest) * len(problem.moves) * grid.size <= HISTORY
        # Room for all that is ever found, or until it is begun.
        self.slots = longest + (rows if self.keeps else 1)
        shape = (len(problem.moves), self.modes, grid.size)
        self.q = np.full((self.slots, *shape), np.inf)
        self.control = np.zeros((self.slots, *shape))
        self.entry = np.zeros((self.slots, *shape), dtype=np.int32)
        self.filled = StageTable.empty(first, last - first + 1, self.modes, grid.size)
        self.value = self.filled.value
        self.changes = Changes.of(problem, bundles.shared) if len(grid.shape) == 1 else None
        self.base: StageTable | None = None
        self._base_found: list[tuple[Any, Any, Any]] = []

    def late(self, stage: int) -> float:
        """Late charge at a stage."""
        return float(self.countdown.late(stage * self.countdown.step))

    def at_once(self) -> bool:
        """Do the whole induction of a small problem in one compiled call; return whether it was small."""
        bundle, stop_q = self.bundles.alone(), self.stops.still
        if not self.small or bundle is None or stop_q is None:
            return False
        base = (
            [np.array([found[k] for found in self._base_found]) for k in range(3)]
            if self.base is not None
            else [np.empty((0, 0, 0)), np.empty((0, 0, 0)), np.empty((0, 0, 0), np.int32)]
        )
        stages = np.arange(self.first - int(self.duration.max()), self.first + len(self.value))
        late = self.countdown.late(stages * self.countdown.step)
        code = -2
        while code == -2:
            code = _sweep_kernels.sweep(
                late, self.duration, stop_q, self.stops.level(),
                tuple(base), (self.q, self.control, self.entry),
                bundle.scan_weight, bundle.scan_tables, bundle.plan, bundle.tables, self.bundles.shared,
                self.filled.arrays, bundle.difference,
            )  # fmt: skip
            if code == -2:
                bundle.tabulate_stopped()
        self.bundles.search_error = max(self.bundles.search_error, bundle.search_error)
        if code >= 0:
            self._refuse_unreachable(self.first + code, code)
        return True

    def _history(self, stop_q: Floats) -> tuple[Any, ...]:
        """Costs found, with rows of the table in place of modes, for `Changes`."""
        late = self.countdown.late(self.countdown.time(np.arange(len(self.value))))
        found = tuple(
            np.moveaxis(ring[: len(self.value), :, 0], 1, 0) for ring in (self.q, self.control, self.entry)
        )
        t = self.filled
        return stop_q[:, :1] + late[:, None], found, t.best[:, 0], t.entry[:, 0], t.control[:, 0]

    def step(self, stage: int) -> None:
        """Finish the value-to-go of `stage`, then evaluate every move into it."""
        row = stage - self.first
        slot = row % self.slots
        if self.base is not None:
            self._from_base(stage, slot)
        stop_q = self.stops.at(stage, self.late(stage))
        if not self._choose(stop_q, slot, row):
            self._refuse_unreachable(stage, row)
        if self.changes is not None and not self.keeps:
            found, t = (self.q[slot], self.control[slot], self.entry[slot]), self.filled
            self.changes.add(row, stop_q, found, t.best[row], t.entry[row], t.control[row])
        if not self.keeps:
            self.q[slot] = np.inf
        self._push(stage, self.value[row], self.stops.level(self.late(stage)))

    def _choose(self, stop_q: Floats, slot: int, row: int) -> bool:
        finite: bool = _sweep_kernels.choose(
            stop_q,
            (self.q[slot], self.control[slot], self.entry[slot]),
            self.bundles.shared,
            self.filled.slice(row),
        )
        return finite

    def _refuse_unreachable(self, stage: int, row: int) -> None:
        mode, node = np.argwhere(~np.isfinite(self.value[row]))[0]
        where = ", ".join(
            f"{axis.name} = {x[node]:g} {axis.unit}"
            for axis, x in zip(self.grid.axes, self.grid.points, strict=True)
        )
        raise ValueError(
            f"no stop and no move is allowed at stage {stage}, mode {self.problem.modes[mode]!r}, "
            f"{where or 'no coordinates'}"
        )

    def _push(self, stage: int, value: Floats, level: Floats) -> None:
        last = self.first + len(self.value) - 1
        for moves, found in self.bundles.best(value, level, stage, last):
            # Moves of a bundle share the treatment of modes; their departures are in different slots.
            at = ((stage - self.first + self.duration[moves]) % self.slots, moves)
            if self.bundles.shared[moves[0]]:
                self.q[:, :, 0][at] = found.q[:, 0]
                self.control[:, :, 0][at] = found.control[:, 0]
                self.entry[:, :, 0][at] = found.entry[:, 0]
            else:
                self.q[at], self.control[at], self.entry[at] = found.q, found.control, found.entry

    def _from_base(self, stage: int, slot: int) -> None:
        """Take moves that end before the first stage from the base."""
        for move, duration in enumerate(self.duration):
            if stage - duration < self.first:
                q, control, entry = self._base_found[move] or self._timed_from_base(move, stage)
                used = slice(0, 1) if self.bundles.shared[move] else slice(None)
                self.q[slot, move, used] = q + self.late(stage - duration)
                self.control[slot, move, used], self.entry[slot, move, used] = control, entry

    def _timed_from_base(self, move: int, stage: int) -> Any:
        """Best of a timed move from `stage` into the base."""
        assert self.base is not None  # checked by the caller
        found = self.bundles.timed(move, self.base.value[0], self.stops.level(), stage)
        return found.q[0], found.control[0], found.entry[0]

    def stopped(self) -> StageTable:
        """Base of a convex late charge: stop."""
        stop_q = self.stops.at(self.first - 1, 0.0)
        return self._settle(stop_q, stop_q.min(axis=0))

    def stationary(self, late: Any) -> StageTable:
        """Base of a linear late charge: the stationary solution."""
        stop_q = self.stops.at(self.first - 1, 0.0)
        value = stop_q.min(axis=0)
        step = self.problem.step
        for _ in range(100_000):
            before = value
            base = self._settle(stop_q, before, late.rate * step)
            # The exact value-to-go falls from sweep to sweep; the search between coarse levels may raise it.
            value = np.minimum(base.value[0], before)
            if np.max(before - value) <= CONVERGED * max(1.0, float(np.max(np.abs(value)))):
                return replace(base, value=value[None])
        raise ValueError("the late side does not settle: some move costs no time and charges nothing")

    def _settle(self, stop_q: Floats, value: Floats, rate: float | None = None) -> StageTable:
        """One sweep of the base (`rate` None: only stops); keeps the best of each move into `value`."""
        found_all: list[Any] = [None] * len(self.duration)
        q = np.full(self.q.shape[1:], np.inf)
        for moves, found in self.bundles.best(value, self.stops.level(), None, None):
            for k, move in enumerate(moves):
                found_all[move] = (found.q[k], found.control[k], found.entry[k])
                used = slice(0, 1) if self.bundles.shared[move] else slice(None)
                if rate is not None:
                    q[move, used] = found.q[k] + rate * self.duration[move]
                    self.control[0, move, used], self.entry[0, move, used] = found.control[k], found.entry[k]
        self._base_found = found_all
        base = StageTable.empty(0, 1, *value.shape)
        best = (q, self.control[0], self.entry[0])
        _sweep_kernels.choose(stop_q, best, self.bundles.shared, base.slice(0))
        if self.changes is None:
            return base
        changes = Changes.of(self.problem, self.bundles.shared)
        changes.add(0, stop_q, best, base.best[0], base.entry[0], base.control[0])
        return replace(base, changes=changes)

    def table(self) -> StageTable:
        """Finished table."""
        if self.keeps and self.changes is not None and self.stops.still is not None:
            self.changes.history = self._history(self.stops.still)
        return replace(
            self.filled, search_error=self.bundles.search_error, changes=self.changes, base=self.base
        )
