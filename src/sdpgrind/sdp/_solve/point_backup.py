"""Backup of sampled and staying moves: each (row, node) by table, by numpy or by compiled code."""

from typing import Any

import numpy as np
from scipy import sparse

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.coordinates import Stages
from sdpgrind.sdp._problem.grid import Ints, record
from sdpgrind.sdp._solve import kernels as _kernels
from sdpgrind.sdp._transitions import step_kernels as _compiled
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.rows import Rows, RowsFound
from sdpgrind.sdp._transitions.sampled import CHUNK, Sampled, land, masked
from sdpgrind.sdp._transitions.stay import Stay

KEEP = 30_000_000  # chosen: most table entries kept; more cost memory, fewer an evaluation each sweep
# measured: compiling a step takes 0.7 s; without a table numpy takes 0.4 us longer for an evaluation: 1e5 of
# them on 40 stages pay. Below 1e6 a table that is kept costs less time; it takes 0.1 kB for an evaluation
COMPILED_ONCE, COMPILED_KEPT = 100_000, 1_000_000


class PointBundle:
    """One sampled or staying move on a block of nodes.

    `per_mode`: evaluated for each mode of departure. `stage`: stage coordinate of departure, for timed moves.
    `keep`: `best` is called more than once.
    """

    def __init__(
        self, menu: Menu, per_mode: bool, block: slice, stage: float | None = None, keep: bool = True
    ) -> None:
        self.menu, self.stage, self.block = menu, stage, block
        self.modes = len(menu.problem.modes)
        self.sources = np.arange(self.modes) if per_mode else np.zeros(1, dtype=int)
        self.tells_mode = per_mode and self.modes > 1
        self.nodes = tuple(x[block] for x in menu.grid.points)
        self.count = block.stop - block.start
        self.difference = np.zeros(1)  # largest error of the search between levels so far, $
        self.penalty = self._penalty()
        self.target = self._targets()
        self._table: Any = None
        if isinstance(menu.move.to, Sampled):
            self.noise, self.weight = menu.move.to.quadrature()
            entries = self.sources.size * menu.rows * self.count * self.weight.size * 2 ** len(menu.grid.axes)
            self.compiled = self._compiled(menu.move.to, keep, entries > KEEP)
            if keep and not self.compiled and entries <= KEEP:
                self._table = self._tabulate()
        elif not isinstance(menu.move.to, Stay):
            self._table = self._tabulate_rows()

    def _compiled(self, move: Sampled, keep: bool, large: bool) -> bool:
        """Whether the step is compiled; the grid decides, not the block, and so no executor does."""
        if move.compiled is not None:
            return move.compiled
        evaluations = self.sources.size * self.menu.rows * self.menu.grid.size * self.weight.size
        once = not keep and evaluations >= COMPILED_ONCE
        swept = isinstance(self.menu.problem.stages, Stages) and evaluations >= COMPILED_KEPT
        return (once or (keep and (large or swept))) and _compiled.compiles(self, move)

    def _penalty(self) -> Floats:
        """In-path charges [source, row, node]."""
        c = self.menu.row_controls()
        c = type(c)(*(f[None, :, None] for f in c))
        s = self.menu.state(
            [x[None, None, :] for x in self.nodes],
            self.sources[:, None, None] if self.tells_mode else None,
            self.stage,
        )
        return np.broadcast_to(
            self.menu.penalty(s, c), (self.sources.size, self.menu.rows, self.count)
        ).astype(float)

    def _targets(self) -> Ints:
        """Mode on arrival [source, row]."""
        into = self.menu.into
        found = self.sources[:, None] if into is None else np.repeat(into, self.menu.levels.size)
        return np.broadcast_to(found, (self.sources.size, self.menu.rows)).astype(np.int64)

    @property
    def search_error(self) -> float:
        """Estimated error ($) of the search between levels so far."""
        return float(self.difference[0])

    def best(self, value: Floats, level: Floats, some: slice = slice(None)) -> RowsFound:
        """Return the best for value[mode, node] and the stops' further charge level[mode].

        `some`: as in `ShiftBundle.best`; there is one move.
        """
        q = self.penalty + self._expect(value, level)
        out = (q.shape[0], self.count)
        best, control, entry = np.empty(out), np.empty(out), np.empty(out, dtype=np.int32)
        for k in range(q.shape[0]):
            _kernels.least(
                q[k],
                self.menu.levels,
                self.menu.regimes,
                self.menu.search,
                best[k],
                control[k],
                entry[k],
                self.difference,
            )
        return RowsFound(best[None], control[None], entry[None])

    def _expect(self, value: Floats, level: Floats) -> Floats:
        shape = (self.sources.size, self.menu.rows, self.count)
        if isinstance(self.menu.move.to, Stay):
            return np.asarray(value[self.target][:, :, self.block])
        if self._table is not None:
            matrix, charge, stopped = self._table
            inner: Floats = (matrix @ value.ravel()).reshape(shape)
            return np.asarray(inner + charge + stopped * level[self.target][:, :, None])
        if self.compiled:
            move = self.menu.move.to
            assert isinstance(move, Sampled)  # others are not compiled
            return _compiled.expect(self, move, value, level)
        out = np.empty(shape)
        for source, rows in self._chunks():
            landing, extra = self._land(source, rows)
            ahead = value[self.target[source, rows]]  # [row, node]
            at = np.arange(ahead.shape[0])[:, None, None]
            inner = sum(p * ahead[at, n] for n, p in zip(landing.node, landing.part, strict=True))
            gone = landing.charge + landing.stopped * level[self.target[source, rows]][:, None, None] + extra
            out[source, rows] = (inner + gone) @ self.weight
        return out

    def _chunks(self) -> list[tuple[int, slice]]:
        step = max(1, CHUNK // max(1, self.count * self.weight.size))
        return [
            (k, slice(r, min(r + step, self.menu.rows)))
            for k in range(self.sources.size)
            for r in range(0, self.menu.rows, step)
        ]

    def _land(self, source: int, rows: slice) -> tuple[Any, Any]:
        """Next states of rows: arrays [row, node, noise]."""
        move = self.menu.move.to
        assert isinstance(move, Sampled)
        c = self.menu.row_controls()
        c = type(c)(*(f[rows, None, None] for f in c))
        s = self.menu.state(
            [x[None, :, None] for x in self.nodes],
            int(self.sources[source]) if self.tells_mode else None,
            self.stage,
        )
        e = record("E", tuple(self.noise))(**self.noise)
        after, extra = move.arrive(self.menu, s, c, e)
        shape = (c[0].shape[0] if len(c) else 1, self.count, self.weight.size)
        after, extra = masked(
            self.menu, after, extra, np.isfinite(self.penalty[source, rows])[:, :, None], shape
        )
        return land(self.menu, after), extra

    def _tabulate_rows(self) -> tuple[Any, Floats, Floats]:
        """`_tabulate` of a user's own transition, by its `rows`, in-path charges included."""
        menu, shape = self.menu, (self.sources.size, self.menu.rows, self.count)
        points = tuple(np.tile(x, menu.rows) for x in self.nodes)
        choice = np.repeat(np.arange(menu.move.choices), menu.levels.size * self.count)
        level = np.tile(np.repeat(menu.levels, self.count), menu.move.choices)
        stage = None if self.stage is None else np.full(choice.size, self.stage)
        parts, charge, stopped = [], [], []
        for source in self.sources:
            mode = np.full(choice.size, source) if self.tells_mode else None
            rows: Rows = menu.move.to.rows(menu, points, mode, stage, choice, level)
            matrix = sparse.coo_array(rows.matrix)
            columns = rows.mode[matrix.row] * menu.grid.size + matrix.col
            parts.append(
                sparse.csr_array(
                    (matrix.data, (matrix.row, columns)), shape=(choice.size, self.modes * menu.grid.size)
                )
            )
            charge.append(rows.charge)
            stopped.append(rows.stopped)
        self.penalty = np.zeros(shape)
        return sparse.vstack(parts, format="csr"), np.reshape(charge, shape), np.reshape(stopped, shape)

    def _tabulate(self) -> tuple[Any, Floats, Floats]:
        """Sparse matrix from value[mode, node] to expectations [source, row, node]; charges of leaving."""
        size = self.menu.grid.size
        parts, charge, stopped = (
            [],
            np.empty((self.sources.size, self.menu.rows, self.count)),
            np.empty((self.sources.size, self.menu.rows, self.count)),
        )
        for source, rows in self._chunks():
            landing, extra = self._land(source, rows)
            charge[source, rows] = (landing.charge + extra) @ self.weight
            stopped[source, rows] = landing.stopped @ self.weight
            columns = landing.node + (self.target[source, rows] * size)[:, None, None]
            data = np.moveaxis(landing.part * self.weight, 0, -1)
            lines = data.shape[0] * data.shape[1]
            matrix = sparse.csr_array(
                (
                    data.ravel(),
                    np.moveaxis(columns, 0, -1).ravel(),
                    np.arange(lines + 1) * (data.size // lines),
                ),
                shape=(lines, self.modes * size),
            )
            matrix.sum_duplicates()
            parts.append(matrix)
        return sparse.vstack(parts, format="csr"), charge, stopped
