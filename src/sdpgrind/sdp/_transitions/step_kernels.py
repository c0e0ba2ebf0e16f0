"""User's step in a compiled kernel, on floats, for moves too large to tabulate."""

import inspect
from collections.abc import Callable
from functools import lru_cache, partial
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

_KINDS = {Constant: CONSTANT, Linear: LINEAR, Quadratic: QUADRATIC}
_ROOM = 8192  # chosen: steps whose next states are kept until their values are looked up
# nobody calls a step from C: its door would take a sixth of the time to compile
_njit: Any = partial(njit, error_model="numpy", no_cfunc_wrapper=True)


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
    """The steps of a row's nodes and noise, by one step function; compiled once for each.

    It holds no more than the user's functions: what happens where they arrive is compiled but once.
    """
    n_state, n_control, n_noise, n_axes = sizes
    inner = _njit(no_cpython_wrapper=True)  # called by `walk` only
    step = inner(step)
    charge = inner(charge) if charge is not None else None
    charged = charge is not None

    @_njit(nogil=True)
    def walk(points, controls, noises, penalty, reached, paid):
        """Put the next state [node, noise, axis] and the charge paid for it; skip infinite penalties.

        Return how many coordinates the step gives.
        """
        given = n_axes
        c = control(*to_fixed_tuple(controls, n_control))
        for node in range(points.shape[0]):
            if penalty[node] == np.inf:
                continue
            s = state(*to_fixed_tuple(points[node], n_state))
            for k in range(noises.shape[0]):
                x = step(s, c, noise(*to_fixed_tuple(noises[k], n_noise)))
                given = len(x)
                if given != n_axes:
                    return given
                for axis in range(n_axes):
                    reached[node, k, axis] = x[axis]
                if charged:
                    paid[node, k] = charge(s, c, after(*x))
        return given

    return walk


def compiles(bundle: Block, move: Sampled) -> bool:
    """Whether the step and its charge compile; they are compiled then."""
    try:
        _edges(bundle.menu)  # a charge that is a function is left to numpy
        walk, given = _call(bundle, move, 0)
        return _compiles(walk, tuple(typeof(x) for x in given(0, _some(bundle)[0])))
    except (TypeError, ValueError):  # no function, or of values that numba has no type of
        return False


@lru_cache(maxsize=32)
def _compiles(walk: Any, types: tuple[Any, ...]) -> bool:
    try:
        walk.compile(types)
    except Exception:  # numba raises errors of any type
        return False
    return True


def expect(bundle: Block, move: Sampled, value: Floats, level: Floats) -> Floats:
    """Return expectations [source, row, node] of a bundle by its compiled kernel."""
    menu = bundle.menu
    out = np.empty((bundle.sources.size, menu.rows, bundle.count))
    edges = _edges(menu)
    for k in range(bundle.sources.size):
        worst = _swept(bundle, move, k, (value, level, edges), out[k])
        if np.isinf(worst):
            raise ValueError(f"move {menu.move.name!r}: step must give numbers; got NaN or an infinity")
        if not np.isnan(worst):
            raise ValueError(
                f"move {menu.move.name!r} must not leave an axis whose edge is 'refuse'; got {worst:g}"
            )
        if np.any(np.isnan(out[k])):
            raise no_charge(menu)
    return out


def _swept(
    bundle: Block, move: Sampled, k: int, ahead: tuple[Floats, Floats, EdgeTables], out: Floats
) -> float:
    """Put the expectations [row, node] for the source `k`; return the worst coordinate, as `arrive`."""
    value, level, edges = ahead
    axes = (0.0,) * len(bundle.menu.grid.axes)
    walk, given = _call(bundle, move, k)
    worst = np.nan
    for row, target in enumerate(bundle.target[k]):
        behind = np.ascontiguousarray(value[target]), level[target]
        for some in _some(bundle):
            args = given(row, some)
            *_, penalty, reached, paid = args
            if (count := walk(*args)) != len(axes):
                raise not_for_axes(bundle.menu, f"a tuple of {count}")
            worst = arrive(reached, paid, bundle.weight, axes, edges, *behind, penalty, worst, out[row, some])
    return float(worst)


def _some(bundle: Block) -> list[slice]:
    """Nodes that are evaluated at once: what they arrive at stays in the processor's cache."""
    count = max(1, _ROOM // bundle.weight.size)
    return [slice(k, min(k + count, bundle.count)) for k in range(0, bundle.count, count)]


def _call(bundle: Block, move: Sampled, k: int) -> tuple[Any, Callable[[int, slice], tuple[Floats, ...]]]:
    """The kernel, and its arguments for a row of the source `k` and some nodes; all have the same room."""
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
    points, controls = _columns(s, bundle.count), _columns(c, menu.rows)
    noises = _columns(tuple(bundle.noise.values()), bundle.weight.size)
    penalty = np.ascontiguousarray(bundle.penalty[k])
    reached = np.empty((_some(bundle)[0].stop, bundle.weight.size, sizes[-1]))
    paid = np.zeros(reached.shape[:2])

    def given(row: int, some: slice) -> tuple[Floats, ...]:
        room = slice(some.stop - some.start)
        return points[some], controls[row], noises, penalty[row, some], reached[room], paid[room]

    return _kernel(move.step, move.charge, *types, sizes, read), given


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
    return EdgeTables(axes, logs, np.array(grid.shape, dtype=np.int64), kinds, extra, _sides(menu))


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
