"""Any transition: expectation by quadrature over noise, value-to-go multilinear in the axes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import sparse

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.sdp._distributions.law import Law
from sdpgrind.sdp._problem.charges import Charge
from sdpgrind.sdp._problem.grid import Ints, record
from sdpgrind.sdp._transitions.edges import passed
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.rows import Rows

CHUNK = 1_000_000  # chosen: next states in one numpy call; more cost memory, fewer overhead


@dataclass(frozen=True)
class Sampled:
    """Transition ``next = step(s, c, e)``.

    Parameters
    ----------
    step : callable(s, c, e) -> tuple
        Next coordinates, one for each axis, in the axes' units. Written elementwise.
    noise : mapping of str to Law, optional
        Independent noises, the fields of ``e``; each a single law (of shape ()).
    charge : callable(s, c, n), optional
        Further in-path charge ($) that depends on the next coordinates ``n``.
    points : int
        Quadrature points of each noise (discrete laws are exact).
    compiled : bool, optional
        Evaluate `step` in a compiled kernel. None: where it compiles and compiling pays, from 1e5
        evaluations a stage on if no table of the move is kept (of a timed one, or one too large), from 1e6
        on if the table would be kept for the stages of a countdown. True: always, an error if it cannot be.

    Examples
    --------
    >>> from sdpgrind import sdp
    >>> jump = sdp.Sampled(lambda s, c, e: (s.x * (1 + e.eta),), {"eta": sdp.Discrete([-0.1, 0.1])})
    >>> jump.points
    16
    """

    step: Callable[..., tuple[Any, ...]]
    noise: Mapping[str, Law] = field(default_factory=dict)
    charge: Callable[..., Any] | None = None
    points: int = 16
    compiled: bool | None = None

    def __post_init__(self) -> None:
        if not callable(self.step):
            raise TypeError(
                "step must be a function f(s, c, e) that gives the coordinates after the move; "
                f"got {self.step!r}"
            )
        if not isinstance(self.noise, Mapping) or not all(
            isinstance(law, Law) for law in self.noise.values()
        ):
            raise TypeError(
                f"noise must be laws by name, such as {{'e': sdp.Normal(0.0, 1.0)}}; got {self.noise!r}"
            )

    def quadrature(self) -> tuple[dict[str, Floats], Floats]:
        """Return noise points by name and joint weights, each (Q,)."""
        pairs = {name: law.nodes(self.points) for name, law in self.noise.items()}
        axes = np.meshgrid(*(np.ravel(x) for x, _ in pairs.values()), indexing="ij")
        weight = np.ones(())
        for _, w in pairs.values():
            weight = np.multiply.outer(weight, np.ravel(w))
        return {name: np.ravel(x) for name, x in zip(pairs, axes, strict=True)}, np.ravel(weight)

    def arrive(self, menu: Menu, s: Any, c: Any, e: Any) -> tuple[tuple[Floats, ...], Any]:
        """Return the next coordinates and their further charge, all of one shape."""
        after = self.step(s, c, e)
        if not isinstance(after, tuple) or len(after) != len(menu.grid.axes):
            got = f"a tuple of {len(after)}" if isinstance(after, tuple) else type(after).__name__
            raise not_for_axes(menu, got)
        charge = (
            0.0
            if self.charge is None
            else self.charge(s, c, record("N", tuple(a.name for a in menu.grid.axes))(*after))
        )
        shape = np.broadcast_shapes(*(np.shape(x) for x in after), np.shape(charge))
        return tuple(np.broadcast_to(np.asarray(x, dtype=float), shape) for x in after), charge

    def rows(
        self, menu: Menu, points: tuple[Floats, ...], mode: Any, stage: Any, choice: Ints, level: Floats
    ) -> Rows:
        """Return the one-step distribution from P points with one control each."""
        noise, weight = self.quadrature()
        e = record("E", tuple(noise))(**{name: x[None, :] for name, x in noise.items()})
        column = tuple(p[:, None] for p in points)
        s = menu.state(
            column, None if mode is None else mode[:, None], stage if np.ndim(stage) == 0 else stage[:, None]
        )
        after, extra = self.arrive(menu, s, menu.controls(choice[:, None], level[:, None]), e)
        full = (points[0].size, weight.size)
        penalty = np.broadcast_to(
            menu.penalty(menu.state(points, mode, stage), menu.controls(choice, level)), full[:1]
        )
        after, extra = masked(menu, after, extra, np.isfinite(penalty)[:, None], full)
        landing = land(menu, after)
        index = np.broadcast_to(np.arange(full[0])[:, None], full)
        data = (weight * landing.part).ravel()
        cells = (np.broadcast_to(index, landing.node.shape).ravel(), landing.node.ravel())
        matrix = sparse.csr_array((data, cells), shape=(full[0], menu.grid.size))
        matrix.sum_duplicates()
        charge = (landing.charge + extra) @ weight + penalty
        arrival = mode if menu.into is None else menu.into[choice]
        return Rows(
            matrix,
            np.broadcast_to(0 if arrival is None else arrival, full[0]).astype(int),
            charge,
            landing.stopped @ weight,
        )

    def sample(
        self,
        menu: Menu,
        points: tuple[Floats, ...],
        mode: Any,
        stage: Any,
        choice: Ints,
        level: Floats,
        rng: np.random.Generator,
    ) -> tuple[tuple[Floats, ...], Any]:
        """Draw the next coordinates and their further charge."""
        e = record("E", tuple(self.noise))(
            **{name: law.sample(rng, points[0].shape) for name, law in self.noise.items()}
        )
        return self.arrive(menu, menu.state(points, mode, stage), menu.controls(choice, level), e)


@dataclass(frozen=True)
class Landing:
    """Next states on the grid: corners (2**axes, ...), weights (0 outside), and charges of leaving."""

    node: Ints
    part: Floats
    charge: Floats
    stopped: Floats


def outside(menu: Menu, after: tuple[Floats, ...]) -> tuple[list[Floats], Floats, Floats, Floats]:
    """Return clamped positions, 1.0 for states inside, charge of leaving, 1.0 for exits into a stop."""
    shape = after[0].shape if after else ()
    inside, stopped, charge = np.ones(shape), np.zeros(shape), np.zeros(shape)
    index = []
    for k, (axis, x) in enumerate(zip(menu.grid.axes, after, strict=True)):
        if np.any(np.isnan(x)):
            raise ValueError(
                f"move {menu.move.name!r}: step must give {checks.with_unit('numbers', axis.unit)}; "
                f"got NaN for {axis.name}"
            )
        with np.errstate(divide="ignore", invalid="ignore"):
            i = menu.grid.index(k, x)
        for beyond, edge, end in passed(axis, x):
            if edge == "refuse" and np.any(beyond & (np.abs(x - end) > 1e-9 * (axis.high - axis.low))):
                worst = float(x[beyond].flat[int(np.argmax(np.abs(x[beyond] - end)))])
                raise ValueError(
                    f"move {menu.move.name!r} must keep {axis.name} in {axis.interval},"
                    f" or the axis needs another edge than 'refuse'; got {worst:g}"
                )
            leaving = beyond & (inside > 0)
            if edge == "stop":
                stop = menu.problem.stops[0].charge
                assert isinstance(stop, Charge)
                charge = np.where(leaving, stop(x), charge)
                stopped, inside = np.where(leaving, 1.0, stopped), np.where(leaving, 0.0, inside)
            elif not isinstance(edge, str):
                charge, inside = np.where(leaving, edge, charge), np.where(leaving, 0.0, inside)
        index.append(np.clip(np.nan_to_num(i, nan=0.0, neginf=0.0), 0.0, axis.nodes - 1))
    return index, inside, charge, stopped


def not_for_axes(menu: Menu, got: str) -> TypeError:
    """Error of a step that gives another thing than a coordinate for each axis."""
    return TypeError(
        f"move {menu.move.name!r}: step must return a tuple of {len(menu.grid.axes)} coordinates; got {got}"
    )


def no_charge(menu: Menu) -> ValueError:
    """Error of a charge of the next coordinates that is no number."""
    name = menu.move.name
    return ValueError(f"move {name!r}: charge of the next coordinates must be a number ($); got NaN")


def masked(
    menu: Menu, after: tuple[Floats, ...], extra: Any, allowed: Any, shape: tuple[int, ...]
) -> tuple[tuple[Floats, ...], Floats]:
    """Return next coordinates and charges of this shape; a grid point and 0 where not allowed."""
    inside = tuple(
        np.where(allowed, np.broadcast_to(x, shape), axis.low)
        for axis, x in zip(menu.grid.axes, after, strict=True)
    )
    charge = np.where(allowed, np.broadcast_to(extra, shape), 0.0)
    if np.any(np.isnan(charge)):  # which would never be chosen, in silence
        raise no_charge(menu)
    return inside, charge


def land(menu: Menu, after: tuple[Floats, ...]) -> Landing:
    """Return the corners and weights of next coordinates of one shape."""
    index, inside, charge, stopped = outside(menu, after)
    node, part = menu.grid.corners(index)
    return Landing(node, part * inside, charge, stopped)
