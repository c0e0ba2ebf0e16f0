"""Shift: a coordinate falls by a random amount whose law does not depend on it.

On a uniform grid of spacing h the expectation of a piecewise linear value-to-go is exact: the weight of
falling k cells is the second difference ``[G((k+1)h) - 2 G(kh) + G((k-1)h)]/h`` of ``G(y) = E (y-D)+``, equal
for all nodes (Toeplitz). Mass that leaves the grid is charged by the law's tail moments.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.sdp._distributions.law import Law
from sdpgrind.sdp._distributions.quick import hats
from sdpgrind.sdp._problem.grid import Grid, Ints, corners
from sdpgrind.sdp._transitions.edges import LEAK, Exit
from sdpgrind.sdp._transitions.menu import Menu
from sdpgrind.sdp._transitions.rows import Rows, Tail


@dataclass(frozen=True)
class Shift:
    """Transition ``coordinate - D`` with D independent of that coordinate.

    Parameters
    ----------
    axis : str
        Name of the falling coordinate (any unit, linear scale). D, in the same unit, may be negative.
    law : callable(s, c) -> Law
        Law of D, one for each control. ``s`` has no field `axis`.
    others : callable(s, c) -> tuple, optional
        Next values of the other coordinates (deterministic), in the order of the axes. None: unchanged.

    Examples
    --------
    >>> from sdpgrind import sdp
    >>> sdp.Shift("height", lambda s, c: sdp.Rayleigh(c.cut, 0.15 * c.cut)).axis
    'height'
    """

    axis: str
    law: Callable[[Any, Any], Law]
    others: Callable[[Any, Any], tuple[Any, ...]] | None = None

    def position(self, grid: Grid) -> int:
        """Return the index of the falling axis."""
        names = [axis.name for axis in grid.axes]
        if self.axis not in names:
            raise ValueError(f"Shift.axis must be one of {', '.join(names)}; got {self.axis!r}")
        if grid.axes[names.index(self.axis)].scale != "linear":
            raise ValueError(f"the axis {self.axis!r} of a Shift must have scale 'linear'; got 'log'")
        return names.index(self.axis)

    def rows(
        self, menu: Menu, points: tuple[Floats, ...], mode: Any, stage: Any, choice: Ints, level: Floats
    ) -> Rows:
        """Return the exact one-step distribution from P points with one control each."""
        grid, ax = menu.grid, self.position(menu.grid)
        s, c = menu.state(points, mode, stage, without=self.axis), menu.controls(choice, level)
        law, x = self.law(s, c), points[ax]
        penalty = np.broadcast_to(menu.penalty(menu.state(points, mode, stage), c), x.shape)
        allowed = np.isfinite(penalty)
        line, charge, stopped, tails = _line(menu, ax, law, x, allowed)
        others = [p for k, p in enumerate(points) if k != ax]
        node, part = self._targets(menu, ax, self.others(s, c) if self.others else others, allowed)
        whole = np.zeros((x.size, grid.size // grid.shape[ax], grid.shape[ax]))
        for n, p in zip(node, part, strict=True):
            whole[np.arange(x.size), n] += p[:, None] * line
        full = (*(n for k, n in enumerate(grid.shape) if k != ax), grid.shape[ax])
        matrix = np.moveaxis(whole.reshape(x.size, *full), -1, ax + 1).reshape(x.size, grid.size)
        charge = charge + penalty
        arrival = mode if menu.into is None else menu.into[choice]
        return Rows(
            matrix,
            np.broadcast_to(0 if arrival is None else arrival, x.shape).astype(int),
            charge,
            stopped,
            tails,
        )

    @staticmethod
    def _targets(menu: Menu, ax: int, after: Any, allowed: Any) -> tuple[Ints, Floats]:
        """Nodes (flat) and weights of the other coordinates, (corners, *shape of `allowed`)."""
        rest, shape = [k for k in range(len(menu.grid.axes)) if k != ax], allowed.shape
        index = [
            arrived(menu, k, np.where(allowed, value, menu.grid.axes[k].low))
            for k, value in zip(rest, after, strict=True)
        ]
        node, part = corners([menu.grid.shape[k] for k in rest], index)
        return np.broadcast_to(node, (len(node), *shape)) if not rest else node, np.broadcast_to(
            part, (len(part), *shape)
        ) if not rest else part

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
        """Draw the next coordinates from P points with one control each (and no further charge)."""
        ax = self.position(menu.grid)
        s, c = menu.state(points, mode, stage, without=self.axis), menu.controls(choice, level)
        fallen = points[ax] - self.law(s, c).sample(rng, points[ax].shape)
        after = list(self.others(s, c)) if self.others else [p for k, p in enumerate(points) if k != ax]
        after.insert(ax, fallen)
        return tuple(np.broadcast_to(p, points[ax].shape) for p in after), 0.0


def arrived(menu: Menu, axis: int, value: Any) -> Any:
    """Return the position (cells) of a deterministic coordinate: clamped by "hold", else refused outside."""
    ax, top = menu.grid.axes[axis], menu.grid.shape[axis] - 1
    index = menu.grid.index(axis, value)
    for outside, edge in ((index < -1e-9, ax.below), (index > top + 1e-9, ax.above)):
        if edge != "hold" and np.any(outside):
            worst = float(np.asarray(value)[outside].ravel()[0]) if np.ndim(value) else float(value)
            raise ValueError(
                f"move {menu.move.name!r}: "
                f"{ax.name} must stay in {ax.interval} or have the edge 'hold'; got {worst!r}"
            )
    return np.clip(index, 0.0, top)


def _line(
    menu: Menu, ax: int, law: Law, x: Floats, allowed: Any
) -> tuple[Floats, Floats, Floats, tuple[Tail, ...]]:
    """Weights (P, nodes of the falling axis) from points x, charge and probability of exits, tails."""
    axis, place = menu.grid.axes[ax], menu.grid.surrounded(ax)
    weight, h = hats(law, x, place), np.diff(place)
    charge, stopped, tails = np.zeros(x.shape), np.zeros(x.shape), []
    for end, node in ((Exit.low(menu.problem, axis), 0), (Exit.high(menu.problem, axis), -1)):
        probability = np.broadcast_to(end.probability(law, x), x.shape)
        weight[:, node] -= end.full_hat(law, x, float(h[node]), probability)
        charge = charge + end.charge(law, x, probability)
        if end.edge == "hold":
            weight[:, node] += probability
        elif end.edge == "stop":
            stopped = stopped + probability
            tails.append(Tail(end, law, x))
        elif end.edge == "refuse":
            refuse_leak(menu, end, np.where(allowed, probability, 0.0))
    return weight, charge, stopped, tuple(tails)


def refuse_leak(menu: Menu, end: Exit, probability: Floats) -> None:
    """Raise if a refused end is passed."""
    if np.any(probability > LEAK):
        side = "below" if end.sign > 0 else "above"
        raise ValueError(
            f"move {menu.move.name!r} must not leave the axis {side} {end.place:g},"
            " or the axis needs another edge than 'refuse'; "
            f"got a probability of {float(np.max(probability)):.3g}"
        )
