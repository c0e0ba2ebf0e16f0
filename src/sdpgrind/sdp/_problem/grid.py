"""Grid of a problem: node coordinates, named tuples of callbacks, multilinear interpolation.

A table of values has the shape (modes, nodes of all axes flattened in C order). The position on an axis
("index") is in cells, uniform in the coordinate or in its logarithm.
"""

from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.sdp._problem.coordinates import Axis
from sdpgrind.sdp._problem.problem import Problem

Ints = npt.NDArray[np.int64]


@lru_cache(maxsize=256)
def record(kind: str, names: tuple[str, ...]) -> Any:
    """Return the named-tuple class of kind "S", "C", "E" or "N" with these fields; always the same class."""
    return namedtuple(kind, names)


@dataclass(frozen=True)
class Grid:
    """Nodes of the axes of a problem."""

    axes: tuple[Axis, ...]

    @classmethod
    def of(cls, problem: Problem, refine: int = 1) -> "Grid":
        """Return the problem's grid with every cell cut into `refine` cells."""
        return cls(tuple(replace(axis, nodes=(axis.nodes - 1) * refine + 1) for axis in problem.axes))

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Nodes of each axis."""
        return tuple(axis.nodes for axis in self.axes)

    @cached_property
    def size(self) -> int:
        """Number of nodes."""
        return int(np.prod(self.shape, dtype=int))

    @cached_property
    def spacing(self) -> tuple[float, ...]:
        """Length of a cell of each axis (of its logarithm on a log axis)."""
        return tuple(
            (self._scaled(axis, axis.high) - self._scaled(axis, axis.low)) / (axis.nodes - 1)
            for axis in self.axes
        )

    @cached_property
    def coordinates(self) -> tuple[Floats, ...]:
        """Node coordinates of each axis."""
        return tuple(self.nodes(axis) for axis in self.axes)

    @cached_property
    def points(self) -> tuple[Floats, ...]:
        """Coordinates of every node, flattened: one array of length `size` for each axis."""
        if not self.axes:
            return ()
        return tuple(np.ravel(mesh) for mesh in np.meshgrid(*self.coordinates, indexing="ij"))

    def surrounded(self, axis: int) -> Floats:
        """Return the node coordinates of a linear axis, extended by one cell at each end."""
        ax = self.axes[axis]
        return np.asarray(ax.low + self.spacing[axis] * np.arange(-1, ax.nodes + 1))

    @staticmethod
    def nodes(axis: Axis) -> Floats:
        """Node coordinates of one axis; the ends are exact."""
        space = np.geomspace if axis.scale == "log" else np.linspace
        return space(axis.low, axis.high, axis.nodes)

    @staticmethod
    def _scaled(axis: Axis, value: Any) -> Any:
        return np.log(value) if axis.scale == "log" else value

    def index(self, axis: int, value: Any) -> Any:
        """Return positions on an axis, in cells from the low end, also outside the grid."""
        ax = self.axes[axis]
        return (self._scaled(ax, value) - self._scaled(ax, ax.low)) / self.spacing[axis]

    def coordinate(self, axis: int, index: Any) -> Any:
        """Return the coordinates at positions on an axis: the inverse of `index`."""
        ax = self.axes[axis]
        scaled = self._scaled(ax, ax.low) + self.spacing[axis] * np.asarray(index)
        return np.exp(scaled) if ax.scale == "log" else scaled

    def corners(self, index: Any) -> tuple[Ints, Floats]:
        """Return flat nodes and weights, (2**axes, ...), of multilinear interpolation inside the grid."""
        return corners(self.shape, index)


@dataclass(frozen=True)
class Graded(Grid):
    """Grid of one linear axis with given nodes, for probability.

    Attributes
    ----------
    places : tuple of float
        Nodes, rising, from the low to the high end of the axis, in its unit.
    """

    places: tuple[float, ...]

    @classmethod
    def on(cls, axes: Sequence[Axis], nodes: npt.ArrayLike) -> "Graded":
        """Return the grid of the only one of `axes` with `nodes` (its unit)."""
        if len(axes) != 1 or axes[0].scale != "linear":
            raise ValueError(
                f"nodes must be left out unless there is one axis, a linear one; there are {len(axes)}"
            )
        axis = axes[0]
        places = checks.finite_array("nodes", nodes, axis.unit)
        ends = (
            places.ndim == 1 and places.size > 2 and bool(places[0] == axis.low and places[-1] == axis.high)
        )
        if not ends or np.any(np.diff(places) <= 0):
            raise checks.refuse(
                "nodes", f"3 or more that rise from {axis.low:g} to {axis.high:g}", nodes, axis.unit
            )
        return cls((replace(axis, nodes=places.size),), tuple(places.tolist()))

    @cached_property
    def coordinates(self) -> tuple[Floats, ...]:
        """Node coordinates of the axis."""
        return (np.array(self.places),)

    def surrounded(self, axis: int) -> Floats:
        """Return the node coordinates, extended by one cell at each end."""
        x = self.coordinates[axis]
        return np.concatenate([[2 * x[0] - x[1]], x, [2 * x[-1] - x[-2]]])


def corners(shape: Sequence[int], index: Sequence[Any]) -> tuple[Ints, Floats]:
    """Return flat nodes and weights, (2**axes, ...), of multilinear interpolation on a grid of `shape`."""
    if not shape:
        return np.zeros((1,), dtype=np.int64), np.ones((1,))
    low = [np.clip(np.floor(i).astype(np.int64), 0, n - 2) for i, n in zip(index, shape, strict=True)]
    part = [np.clip(i - k, 0.0, 1.0) for i, k in zip(index, low, strict=True)]
    stride = [int(np.prod(shape[k + 1 :], dtype=int)) for k in range(len(shape))]
    node, weight = [], []
    for upper in product((0, 1), repeat=len(shape)):
        node.append(sum((k + u) * s for k, u, s in zip(low, upper, stride, strict=True)))
        weight.append(
            np.prod(
                np.broadcast_arrays(*[p if u else 1 - p for p, u in zip(part, upper, strict=True)]), axis=0
            )
        )
    return np.stack(np.broadcast_arrays(*node)), np.stack(weight)
