"""User's step in a compiled kernel, on floats, for moves too large to tabulate."""

import inspect
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numba import njit, typeof
from numba.np.unsafe.ndarray import to_fixed_tuple

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.grid import Ints, record
from sdpgrind.sdp._problem.one_sided import Constant, Linear, Quadratic
from sdpgrind.sdp._transitions.arrival_kernels import (
    CONSTANT,
    HOLD,
    LINEAR,
    NUMBER,
    QUADRATIC,
    REFUSE,
    STOP,
    EdgeTables,
    arrive,
)
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.sampled import Sampled, no_charge, not_for_axes

_ROOM = 8192  # chosen: steps at a time; what they reach stays in the cache
# ways in that nobody takes would be compiled, too: from C, and from Python into the user's functions
_OPTIONS: Any = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
_INNER: Any = {**_OPTIONS, "no_cpython_wrapper": True}
_KINDS = {Constant: CONSTANT, Linear: LINEAR, Quadratic: QUADRATIC}


class Block(Protocol):
    """Move on some nodes, as the kernel reads it."""

    menu: Menu
    sources: Ints
    nodes: tuple[Floats, ...]
    count: int
    tells_mode: bool
    stage: float | None
    noise: dict[str, Floats]
    weight: Floats
    target: Ints
    penalty: Floats


def compiled_step(menu: Menu) -> Any:
    """Return the user's step, compiled."""
    move = menu.move.to
    assert isinstance(move, Sampled)
    return njit(move.step)


@lru_cache(maxsize=32)
def _kernel(
    step: Any,
    charge: Any,
    state: Any,
    control: Any,
    noise: Any,
    after: Any,
    sizes: tuple[int, int, int, int],
    read: Any,
) -> Any:
    """The steps from some (row, node); compiled for each step function, so nothing else is in it."""
    n_state, n_control, n_noise, n_axes = sizes
    step = njit(step, **_INNER)
    charge = njit(charge, **_INNER) if charge is not None else None
    charged = charge is not None

    @njit(**_OPTIONS)
    def fill(points, controls, noises, penalty, begin, reached, paid):
        """reached[i, k], paid[i, k]: where noise `k` leads, and its charge, for the pairs from `begin` on.

        Pair `i` is the node and the row in ``row * nodes + node``; none that is not allowed is stepped.
        """
        nodes = points.shape[0]
        for i in range(min(reached.shape[0], controls.shape[0] * nodes - begin)):
            row, node = (begin + i) // nodes, (begin + i) % nodes
            if penalty[row, node] == np.inf:
                continue
            c = control(*to_fixed_tuple(controls[row], n_control))
            s = state(*to_fixed_tuple(points[node], n_state))
            for k in range(noises.shape[0]):
                x = step(s, c, noise(*to_fixed_tuple(noises[k], n_noise)))
                if len(x) != n_axes:
                    raise TypeError(len(x))
                for axis in range(n_axes):
                    reached[i, k, axis] = x[axis]
                if charged:
                    paid[i, k] = charge(s, c, after(*x))

    return fill


def compiles(bundle: Block, move: Sampled) -> bool:
    """Whether the step and its charge compile; they are compiled then."""
    try:
        _edges(bundle.menu)  # refuses charges that are no numbers
        fill, given = _call(bundle, move, 0)
        return _compiles(fill, tuple(typeof(x) for x in (*given, 0, *_room(bundle))))
    except (TypeError, ValueError):  # no function, or of values that numba has no type of
        return False


@lru_cache(maxsize=32)
def _compiles(fill: Any, types: tuple[Any, ...]) -> bool:
    try:
        fill.compile(types)
    except Exception:  # numba raises errors of any type
        return False
    return True


def expect(bundle: Block, move: Sampled, value: Floats, level: Floats) -> Floats:
    """Return expectations [source, row, node] of a bundle by its compiled kernel."""
    menu = bundle.menu
    out = np.empty((bundle.sources.size, menu.rows, bundle.count))
    edges = _edges(menu)
    for k in range(bundle.sources.size):
        ahead = tuple(map(np.ascontiguousarray, (value, bundle.target[k], level, bundle.penalty[k])))
        worst = _fill(bundle, move, k, (bundle.weight, edges, *ahead), out[k])
        if np.isinf(worst):
            raise ValueError(f"move {menu.move.name!r}: step must give numbers; got NaN or an infinity")
        if not np.isnan(worst):
            raise ValueError(
                f"move {menu.move.name!r} must not leave an axis whose edge is 'refuse'; got {worst:g}"
            )
        if np.any(np.isnan(out[k])):
            raise no_charge(menu)
    return out


def _fill(bundle: Block, move: Sampled, k: int, ahead: tuple[Any, ...], out: Floats) -> float:
    """Fill out[row, node] for the source `k`, some steps at a time; return what left an edge, as `arrive`."""
    fill, given = _call(bundle, move, k)
    reached, paid = _room(bundle)
    worst = np.nan
    for begin in range(0, out.size, len(paid)):
        try:
            fill(*given, begin, reached, paid)
        except TypeError as error:
            raise not_for_axes(bundle.menu, f"a tuple of {error}") from None
        worst = arrive(reached, paid, *ahead, begin, worst, out)
    return worst


def _room(bundle: Block) -> tuple[Floats, Floats]:
    """Room for the coordinates and charges of as many (row, node) as are stepped at a time."""
    noises = bundle.weight.size
    pairs = max(1, min(_ROOM // noises, bundle.menu.rows * bundle.count))
    return np.empty((pairs, noises, len(bundle.menu.grid.axes))), np.zeros((pairs, noises))


def _call(bundle: Block, move: Sampled, k: int) -> tuple[Any, tuple[Floats, ...]]:
    """The kernel, and its arguments for the source `k`."""
    menu = bundle.menu
    c = menu.row_controls()
    s = menu.state(
        list(bundle.nodes),
        np.full(bundle.count, float(bundle.sources[k])) if bundle.tells_mode else None,
        None if bundle.stage is None else np.full(bundle.count, bundle.stage),
    )
    sizes = (len(s), len(c), len(bundle.noise), len(menu.grid.axes))
    types: tuple[Any, ...] = (
        type(s),
        type(c),
        record("E", tuple(bundle.noise)),
        record("N", tuple(a.name for a in menu.grid.axes)),
    )
    read = _read(move.step), _read(move.charge)  # compiled in: other values make another kernel
    return _kernel(move.step, move.charge, *types, sizes, read), (
        _columns(s, bundle.count), _columns(c, menu.rows),
        _columns(tuple(bundle.noise.values()), bundle.weight.size), np.ascontiguousarray(bundle.penalty[k]),
    )  # fmt: skip


def _read(function: Any) -> Any:
    """Names and values that a function reads from around it, as a key."""
    if not inspect.isfunction(function):
        return None
    around = inspect.getclosurevars(function)
    return tuple(
        (name, _key(value)) for name, value in sorted({**around.globals, **around.nonlocals}.items())
    )


def _key(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    try:
        hash(value)
    except TypeError:  # numba takes no other value that may change, but for tuples of arrays
        return repr(value)
    return type(value), value


def _columns(fields: Any, length: int) -> Floats:
    return np.ascontiguousarray(
        np.array([np.broadcast_to(np.asarray(f, dtype=float), length) for f in fields])
        .reshape(len(fields), length)
        .T
    )


def _edges(menu: Menu) -> EdgeTables:
    grid = menu.grid
    axes = np.array([[a.low, a.high, h] for a, h in zip(grid.axes, grid.spacing, strict=True)]).reshape(-1, 3)
    kinds, extra = np.zeros((len(grid.axes), 2), dtype=np.int64), np.zeros((len(grid.axes), 2))
    for k, axis in enumerate(grid.axes):
        for side, edge in enumerate((axis.below, axis.above)):
            kinds[k, side] = (
                {"hold": HOLD, "stop": STOP, "refuse": REFUSE}.get(edge, NUMBER)
                if isinstance(edge, str)
                else NUMBER
            )
            extra[k, side] = 0.0 if isinstance(edge, str) else edge
    logs = np.array([a.scale == "log" for a in grid.axes])
    return EdgeTables(axes, logs, tuple(map(int, grid.shape)), kinds, extra, _sides(menu))


def _sides(menu: Menu) -> Floats:
    """Kind, amount and tolerance of the stop's charge below and above its target 0."""
    sides = np.zeros((2, 3))
    axis = menu.grid.axes[menu.problem.stop_axis] if menu.grid.axes else None
    if axis is None or "stop" not in (axis.below, axis.above):
        return sides
    charge = menu.problem.stops[0].charge
    assert isinstance(charge, Charge)
    met = axis.below == "stop" or axis.high < 0.0, axis.above == "stop" or axis.low > 0.0
    for row, one in enumerate((charge.over, charge.under)):
        if isinstance(one, Constant | Linear | Quadratic):
            amount = {Constant: "amount", Linear: "rate", Quadratic: "factor"}[type(one)]
            sides[row] = _KINDS[type(one)], getattr(one, amount), one.tolerance
        elif one is not None and met[row]:
            raise ValueError(
                f"move {menu.move.name!r}: beyond an edge 'stop' a compiled move needs a charge that is"
                f" Constant, Linear or Quadratic (leave out compiled=True for another); got {one!r}"
            )
    return sides
