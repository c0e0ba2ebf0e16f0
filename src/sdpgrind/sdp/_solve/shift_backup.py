"""Fast backup of shift moves: tables once for each grid, then one matrix product and one kernel call a stage.

All shift moves of a problem form one bundle. Scanned rows are a matrix product with the Toeplitz matrix of
the value-to-go; the search between them evaluates single rows.
"""

import itertools
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._distributions.law import Law
from sdpgrind.sdp._distributions.quick import quick
from sdpgrind.sdp._problem.grid import Grid, Ints
from sdpgrind.sdp._solve import kernels as _kernels
from sdpgrind.sdp._solve.shift_sums import Convolution, Product
from sdpgrind.sdp._transitions.edges import Exit
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.rows import RowsFound
from sdpgrind.sdp._transitions.shift import Shift, refuse_leak

ROUGH = 0.05  # chosen: sd, cells, below which expectations have kinks at nodes; more would forbid good curves
LONG = 300  # chosen: least nodes of sums by Fourier transform, n log n instead of n^2 operations a row
PIECE = 2**16  # chosen: entries of a table filled together; more leave the processor's cache
ROUNDING = 2.0**-48  # derived: of the largest value, 16 roundings; transforms of 2^16 nodes make no more


class ShiftBundle:
    """Shift moves of one problem along one axis of a grid.

    `per_mode`: tables for each mode of departure (a callback reads it, or it stays). `block`: lines along the
    falling axis (nodes of the other axes, flattened). `stage`: stage coordinate of departure, for timed
    moves. `longest`: moves of more stages are never asked for, and have no tables; None: all are.
    """

    def __init__(
        self,
        menus: Sequence[Menu],
        per_mode: bool,
        block: slice,
        stage: float | None = None,
        longest: int | None = None,
    ) -> None:
        self.menus, self.per_mode, self.block, self.stage = tuple(menus), per_mode, block, stage
        self._longest = longest
        self.grid: Grid = menus[0].grid
        self.axis = _shift(menus[0]).position(self.grid)
        self.modes = len(menus[0].problem.modes)
        self.others = self.grid.size // self.grid.shape[self.axis]
        self.nodes = self.grid.shape[self.axis]
        self.sources = self.modes if per_mode else 1
        self.groups = (block.stop - block.start) * self.sources
        self.difference = np.zeros(1)  # largest error of the search between levels so far, $
        self._layout()
        self._tables()

    def _layout(self) -> None:
        def offsets(sizes: list[int]) -> Ints:
            return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)

        menus = self.menus
        self.row_at = offsets([m.rows for m in menus])
        scans = [_scan_rows(m) + at for m, at in zip(menus, self.row_at, strict=False)]
        self.scan_rows = np.concatenate(scans)
        self.plan = (
            self.row_at, offsets([m.levels.size for m in menus]),
            offsets([m.regimes.size for m in menus]), offsets([s.size for s in scans]),
            np.concatenate([m.levels for m in menus]), np.concatenate([m.regimes for m in menus]),
            np.array([m.stride for m in menus]), np.array([m.search for m in menus]), self.scan_rows,
        )  # fmt: skip
        self.coarse = np.empty((max(s.size for s in scans), self.nodes))

    def _tables(self) -> None:
        groups, rows, n = self.groups, int(self.row_at[-1]), self.nodes
        asked = [(menu, int(at), *self._laws(menu)) for menu, at in self._asked()]
        rising = any(float(np.min(law.support[0], initial=0.0)) < 0 for _, _, law, *_ in asked)
        self.first_lag = 1 - n if rising else 0
        self.weight = np.zeros((groups, rows, n - self.first_lag))
        problem, axis = self.menus[0].problem, self.grid.axes[self.axis]
        ends = [Exit.low(problem, axis), Exit.high(problem, axis)]
        used = ends if rising else ends[:1]
        charged = any(not isinstance(end.edge, str) or end.edge == "refuse" for end in used)
        self.gone = np.zeros((groups, rows, n if charged else 0))
        self.stopped = np.zeros((groups, rows, 0))
        # Rows, nodes, and what gives their probabilities of stopping.
        self._ended: list[tuple[slice, slice, Any]] = []
        self.above = np.zeros((groups, rows, n if rising else 0))
        self.charge = np.zeros((groups, rows, n))
        self.target = np.zeros((groups, rows, 2 ** (len(self.grid.axes) - 1)), dtype=np.int64)
        self.part = np.ones(self.target.shape)
        self.reach = np.empty((groups, rows, 2), dtype=np.int64)
        self.reach[:] = self.first_lag, self.first_lag - 1
        self.rough = np.zeros((groups, rows), dtype=np.bool_)
        for menu, at, law, s, c in asked:
            here = slice(at, at + menu.rows)
            allowed = self._fill(menu, here, law, ends, rising)
            self._aim(menu, here, s, c, allowed.any(axis=2))
        lags = self.weight, self.first_lag, self.reach
        edges = self.gone, self.stopped, self.above
        self.tables: tuple[Any, ...] = (*lags, *edges, self.charge, self.target, self.part, self.rough)
        self.dense = self.target.shape[2] == 1 and not (self.per_mode and self.modes > 1)
        scanned = self.scan_rows if self.dense else self.scan_rows[:0]
        self.scan_weight = self.weight[0, scanned if n < LONG else scanned[:0]]
        self._product = (
            Product(self.scan_weight, n, self.weight.shape[2], self.first_lag)
            if n < LONG
            else Convolution(self.weight[0], scanned, n, self.first_lag)
        )
        self._products = np.empty((self.scan_rows.size, n if self.dense else 0))
        self._runs = _runs(self.target[0, self.scan_rows, 0]) if self.dense else []

    def _asked(self) -> list[tuple[Menu, Any]]:
        """Moves with tables, and their first rows."""
        longest = self._longest
        each = zip(self.menus, self.row_at, strict=False)
        return [(menu, at) for menu, at in each if longest is None or menu.move.duration <= longest]

    def _fill(self, menu: Menu, here: slice, law: Law, ends: list[Exit], rising: bool) -> Any:
        """Fill the tables of one move; return the mask (groups, rows, nodes) of what is allowed."""
        self.rough[:, here] = _rough(menu, law, self.groups, self.grid.spacing[self.axis])
        allowed = np.broadcast_to(self._penalties(menu, here), (self.groups, menu.rows, self.nodes))
        for some in self._pieces(menu):
            there = slice(here.start + some.start, here.start + some.stop)
            piece = quick(self._laws(menu, some, extra=2)[0])
            self._put_weight(there, piece)
            for end in ends if rising else ends[:1]:
                self._put_end(menu, end, there, piece, allowed[:, some])
        return allowed

    def _pieces(self, menu: Menu) -> list[slice]:
        """Rows whose laws are evaluated together."""
        size = max(1, PIECE // (self.nodes * self.groups))
        return [slice(k, min(k + size, menu.rows)) for k in range(0, menu.rows, size)]

    def _put_weight(self, here: slice, law: Law) -> None:
        """Put the weights of laws (groups, rows, 1) into the table, and their first and last lag."""
        h, (low, high) = self.grid.spacing[self.axis], law.support
        # Weights beyond the law's support are rounding of differences: sums skip them.
        ends = np.floor(np.min(low) / h) - 1, np.ceil(np.max(high) / h) + 1
        first, last = (int(np.clip(end, self.first_lag, self.nodes - 1)) for end in ends)
        put = self.weight[:, here, first - self.first_lag : last + 1 - self.first_lag]
        curve = law.under(h * np.arange(first - 1, last + 2))
        shape = (*put.shape[:2], put.shape[2] + 2)
        if curve.shape != shape:  # one law for several rows
            curve = np.broadcast_to(curve, shape).copy()
        end = np.broadcast_to(high + h, (*shape[:2], 1)).copy()
        _kernels.weigh(curve, end, first, h, put, self.reach[:, here])

    def _put_end(self, menu: Menu, end: Exit, here: slice, law: Law, allowed: Any) -> None:
        """Put probability and charge of passing one end into the tables, of laws (groups, rows, 1)."""
        h = self.grid.spacing[self.axis]
        near, x = self._near(end, law)
        if end.edge == "stop":
            self._ended.append((here, near, partial(end.probability, law, x)))
        if end.edge == "stop" and end.sign > 0:
            self.charge[:, here, near] += end.charge(law, x)
            return
        probability = end.probability(law, x)
        if end.edge == "refuse":
            refuse_leak(menu, end, np.where(allowed[..., near], probability, 0.0))
        if end.edge not in ("stop", "hold"):
            self.gone[:, here, near] += probability
        self.charge[:, here, near] += end.charge(law, x, probability)
        if end.sign < 0:
            kept = probability if end.edge == "hold" else 0.0
            self.above[:, here, near] += end.full_hat(law, x, h, probability) - kept

    def _near(self, end: Exit, law: Law) -> tuple[slice, Floats]:
        """Nodes from which some law passes an end, and their coordinates."""
        axis = self.grid.axes[self.axis]
        x = np.asarray(axis.low + self.grid.spacing[self.axis] * np.arange(self.nodes))
        y = x - end.place
        if end.sign > 0:
            near = slice(0, int(np.count_nonzero(y <= np.max(law.support[1]))) + 1)
        else:
            near = slice(max(0, int(np.count_nonzero(y < np.min(law.support[0]))) - 1), self.nodes)
        return near, x[near]

    def _penalties(self, menu: Menu, here: slice) -> Any:
        """Put the in-path charges into the table; return the mask of allowed moves."""
        if menu.move.allowed is None and not callable(menu.move.charge):
            if menu.move.charge:
                self.charge[:, here] += menu.move.charge
            return True
        points, mode = self._starts()
        c = _row_controls(menu, extra=2)
        x = self.grid.coordinates[self.axis]
        places = [np.asarray(p)[:, None, None] for p in points]
        places.insert(self.axis, x[None, None, :])
        s = menu.state(places, None if mode is None else mode[:, None, None], self.stage)
        penalty = menu.penalty(s, c)
        self.charge[:, here] += penalty
        return np.isfinite(penalty)

    def _aim(self, menu: Menu, here: slice, s: Any, c: Any, allowed: Any) -> None:
        """Set the target of each allowed row (groups, rows): mode and corners of the other axes."""
        points, mode = self._starts()
        if not points and menu.into is None and mode is None:
            return
        others = _shift(menu).others
        after = others(s, c) if others else [p[:, None] for p in points]
        node, part = Shift._targets(menu, self.axis, after, allowed)
        if menu.into is not None:
            arrival: Any = np.repeat(menu.into, menu.levels.size)
        else:
            arrival = 0 if mode is None else mode[:, None]
        self.target[:, here] = np.moveaxis(node + arrival * self.others, 0, 2)
        self.part[:, here] = np.moveaxis(part, 0, 2)

    @property
    def search_error(self) -> float:
        """Estimated error ($) of the search between levels so far."""
        return float(self.difference[0])

    def best(self, value: Floats, level: Floats, some: slice = slice(None)) -> RowsFound:
        """Return the best of some moves for value[mode, node] and the stops' further charge level[mode]."""
        v = self._by_line(value)
        flipped = np.ascontiguousarray((v - v[:, :1])[:, ::-1])
        begin, end, _ = some.indices(len(self.menus))
        self._multiply(flipped, slice(*self.plan[3][[begin, end]].tolist()))
        shape = (len(self.menus), self.groups, self.nodes)
        q, control, entry = np.empty(shape), np.empty(shape), np.empty(shape, dtype=np.int32)
        targets = np.repeat(level, self.others) if self.others > 1 else level
        if self._ended and _differ(targets, v):
            self.tabulate_stopped()
        _kernels.push(
            begin, end, self.plan, self.tables, v, flipped, targets,
            self._products, self.dense, False, self.coarse, (q, control, entry), self.difference,
        )  # fmt: skip
        # [move, mode or 0, line, node of the falling axis]
        lines = (len(self.menus), self.sources, -1, self.nodes)
        return RowsFound(*(found.reshape(lines)[some] for found in (q, control, entry)))

    def _multiply(self, flipped: Floats, wanted: slice) -> None:
        """Take the inner sums of the `wanted` scanned rows; a product of matrices always takes all."""
        for target, rows in self._runs:
            if isinstance(self._product, Convolution):
                rows = slice(max(rows.start, wanted.start), min(rows.stop, wanted.stop))
            self._product(rows, flipped[target], self._products[rows])

    def _starts(self) -> tuple[list[Floats], Ints | None]:
        """Coordinates of every group on the other axes, and its mode (None: only one, or irrelevant)."""
        rest = [x for k, x in enumerate(self.grid.coordinates) if k != self.axis]
        points = [np.ravel(m)[self.block] for m in np.meshgrid(*rest, indexing="ij")]
        lines = self.block.stop - self.block.start
        mode = np.repeat(np.arange(self.modes), lines) if self.per_mode and self.modes > 1 else None
        return [np.tile(p, self.sources) for p in points], mode

    def _laws(self, menu: Menu, rows: slice = slice(None), extra: int = 1) -> tuple[Law, Any, Any]:
        """Laws of (groups, rows), or with `extra` 2 of (groups, rows, 1), with their ``s`` and ``c``."""
        points, mode = self._starts()
        last = (slice(None), *([None] * extra))
        places = [p[last] for p in points]
        places.insert(self.axis, np.empty(0))
        s = menu.state(places, None if mode is None else mode[last], self.stage, without=_shift(menu).axis)
        c = _row_controls(menu, rows, extra)
        return _shift(menu).law(s, c), s, c

    def tabulate_stopped(self) -> None:
        """Tabulate probabilities of ending beyond an edge, for charges unlike those at the first node."""
        if self.stopped.size:
            return
        self.stopped = np.zeros((self.groups, int(self.row_at[-1]), self.nodes))
        for here, near, probability in self._ended:
            self.stopped[:, here, near] += probability()
        self._ended.clear()
        self.tables = (*self.tables[:4], self.stopped, *self.tables[5:])

    @property
    def scan_tables(self) -> tuple[Floats, ...]:
        """Tables (charge, gone, stopped, above) of the scanned rows, [row, node], of the only group."""
        return tuple(table[0, self.scan_rows] for table in (self.charge, self.gone, self.stopped, self.above))

    def _by_line(self, value: Floats) -> Floats:
        """[mode, node] to [(mode, other node), node of the falling axis]."""
        if self.others == 1:
            return value
        lines = np.moveaxis(value.reshape(self.modes, *self.grid.shape), self.axis + 1, -1)
        return np.ascontiguousarray(lines).reshape(-1, self.nodes)


def _differ(targets: Floats, value: Floats) -> bool:
    """Whether charges of stopping differ from the values at the first node of each line, beyond rounding."""
    largest = np.max(np.abs(value), where=np.isfinite(value), initial=0.0)
    return bool(np.any(np.abs(targets - value[:, 0]) > ROUNDING * largest))


def _shift(menu: Menu) -> Shift:
    assert isinstance(menu.move.to, Shift)  # others are not in the bundle
    return menu.move.to


def _scan_rows(menu: Menu) -> Ints:
    """Scanned rows: every stride-th level of every entry of the lists."""
    return np.add.outer(
        np.arange(menu.move.choices) * menu.levels.size, np.arange(0, menu.levels.size, menu.stride)
    ).ravel()


def _row_controls(menu: Menu, rows: slice = slice(None), extra: int = 1) -> Any:
    """``c`` with shape (1, rows) or (1, rows, 1): groups first, nodes of the falling axis last."""
    c = menu.row_controls()
    return type(c)(*(np.asarray(f)[(None, rows, *([None] * (extra - 1)))] for f in c))


def _rough(menu: Menu, law: Law, groups: int, h: float) -> Any:
    """Mask of laws narrower than the step of their mean between levels, which do not resolve the cost."""
    shape = (groups, menu.move.choices, menu.levels.size)
    mean, sd = (np.broadcast_to(x, (groups, menu.rows)).reshape(shape) for x in (law.mean, law.sd))
    step = np.abs(np.diff(mean, axis=2, prepend=mean[:, :, :1], append=mean[:, :, -1:]))
    wide = np.maximum(step[:, :, 1:], step[:, :, :-1])
    rough = (wide > 0) & (sd < np.maximum(wide, ROUGH * h))
    # A law that jumps from 0 to an amount: no curve may use the level that removes nothing.
    for near in (1, 2):
        rough[:, :, near:] |= (sd[:, :, near:] > 0) & (sd[:, :, :-near] == 0)
        rough[:, :, :-near] |= (sd[:, :, :-near] > 0) & (sd[:, :, near:] == 0)
    return rough.reshape(groups, menu.rows)


def _runs(targets: Ints) -> list[tuple[int, slice]]:
    """Runs of rows with the same target: each is one matrix product."""
    ends = [0, *(np.flatnonzero(np.diff(targets)) + 1), targets.size]
    return [(int(targets[a]), slice(int(a), int(b))) for a, b in itertools.pairwise(ends)]
