"""A tool path over a surface: nodes in the unit square, the legs between them, and what follows on the surface."""

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.frozen import Frozen
from sdpgrind.base.stored import stored
from sdpgrind.finishing._path import contact
from sdpgrind.finishing._path.arc_length import POINTS, ArcLength, arc_length
from sdpgrind.finishing._path.blends import rounded
from sdpgrind.finishing._path.crossings import intervals
from sdpgrind.finishing._path.legs import Bools, Legs, legs, turning
from sdpgrind.finishing._path.mappings import MAPPINGS, Mapping, mapping_of
from sdpgrind.finishing._path.samples import Ints, Samples
from sdpgrind.finishing._surface.derivatives import Derivatives
from sdpgrind.finishing._surface.surface import Surface

if TYPE_CHECKING:
    from sdpgrind.finishing._path.metrics import PathMetrics

__all__ = ["Path", "Samples"]
STILL = 1e-12
"""Share of a path's length that is no leg."""
BLEND = 0.05
"""Default deviation of a rounded corner, pitches."""


@stored("finishing.path")
@dataclass(frozen=True, eq=False)
class Path(Frozen):
    """A tool path over a surface."""

    surface: Surface
    nodes: Floats
    _: KW_ONLY
    mapping: str = "parametric"
    pattern: str = "path"
    corners: Bools | None = None
    smooth: bool = False
    deviation: float = 0.0

    def __post_init__(self) -> None:
        checks.kind("surface", self.surface, Surface)
        object.__setattr__(self, "nodes", _nodes(self.nodes))
        checks.one_of("mapping", self.mapping, MAPPINGS)
        if self.corners is not None:
            object.__setattr__(self, "corners", _corners(self.corners, self.nodes))
        object.__setattr__(self, "deviation", checks.nonnegative("deviation", self.deviation, "mm"))

    @cached_property
    def _sharp(self) -> Bools:
        """Which nodes are sharp corners."""
        if self.corners is not None:
            return self.corners
        return np.zeros(len(self.nodes), bool) if self.smooth else turning(self.nodes)

    @cached_property
    def _legs(self) -> Legs:
        """Pieces of the path in the square."""
        sharp = legs(self.nodes, self._sharp, self.smooth)
        if self.deviation == 0 or not self._sharp.any():
            return sharp
        return rounded(self.surface, self._mapping, sharp, self._sharp, self.deviation)

    @cached_property
    def _mapping(self) -> Mapping:
        return mapping_of(self.mapping, self.surface)

    @cached_property
    def _moved(self) -> Floats:
        """Jets (k, 3, 2) of (u, v) at the nodes, both at a sharp corner."""
        own = self._legs
        return self._mapping.carried(contact.jets(own.coefficients, own.at_piece, own.at_t))

    @cached_property
    def _at_nodes(self) -> Derivatives:
        uv = self.uv
        return self.surface.derivatives(uv[:, 0], uv[:, 1])

    @cached_property
    def _arc(self) -> ArcLength:
        """Length by piece and t."""
        cut = intervals(self.surface, self._mapping, self._legs.coefficients)
        points = POINTS[self._legs.coefficients.shape[1] == 2]
        found = arc_length(self._speed, *cut, points)
        still = np.flatnonzero(found.pieces(len(self._legs.run)) <= STILL * found.total)
        if len(still):
            raise ValueError(f"nodes must be apart on the surface; leg {still[0]} is shorter than {STILL:g} of the path")
        return found

    def _speed(self, piece: Ints, t: Floats) -> Floats:
        return contact.speed(self.surface, self._mapping, self._legs.coefficients, piece, t)

    @property
    def uv(self) -> Floats:
        """Parameters of the surface at the nodes, (n, 2)."""
        first = np.searchsorted(self._legs.at_node, np.arange(len(self.nodes)))
        return np.ascontiguousarray(self._moved[first, 0])

    @property
    def points(self) -> Floats:
        """Nodes on the surface, (n, 3), mm."""
        return self._at_nodes.point

    @property
    def length(self) -> float:
        """Length on the surface, mm."""
        return self._arc.total

    @property
    def pitch(self) -> float:
        """Mean distance of neighbouring passes, area over length, mm."""
        return self.surface.area / self.length

    @property
    def runs(self) -> Ints:
        """First and last node of each smooth run between sharp corners, (r, 2)."""
        ends = np.concatenate([[0], np.flatnonzero(self._sharp), [len(self.nodes) - 1]])
        return np.stack([ends[:-1], ends[1:]], axis=1)

    def derivatives(self) -> Derivatives:
        """Return the surface's points and derivatives at the nodes, each (n, 3)."""
        return self._at_nodes

    def frames(self) -> Floats:
        """Return contact frames (k, 4, 4) at the nodes; two at a sharp corner."""
        own = self._legs
        found = contact.contact(self.surface, self._moved, self._at_nodes, own.at_node)
        return contact.frames(self.points, own.at_node, found.tangent, found.normal)

    def sample(self, step: float | None = None, per_leg: int = 8) -> Samples:
        """Return what is known of the path at places along it."""
        if step is None:
            return self._sampled(*self._by_legs(checks.count("per_leg", per_leg)))
        return self._sampled(*self._by_length(checks.positive("step", step, "mm")))

    def at(self, length: npt.ArrayLike) -> Samples:
        """Return what is known of the path at lengths from its start."""
        asked = np.atleast_1d(checks.finite_array("length", length, "mm"))
        return self._sampled(*self._arc.places(asked))

    def _by_legs(self, per_leg: int) -> tuple[Ints, Floats]:
        run = self._legs.run
        ends = np.append(np.diff(run) > 0, True)
        count = per_leg + ends
        piece = np.repeat(np.arange(len(run)), count)
        return piece, (np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)) / per_leg

    def _by_length(self, step: float) -> tuple[Ints, Floats]:
        first = np.searchsorted(self._legs.run, np.arange(self._legs.run[-1] + 2))
        ends = np.concatenate([[0.0], np.cumsum(self._arc.pieces(len(self._legs.run)))])[first]
        parts = np.maximum(np.ceil(np.diff(ends) / step * (1 - 1e-12)), 1).astype(int)
        run = np.repeat(np.arange(len(parts)), parts + 1)
        share = (np.arange(len(run)) - (np.cumsum(parts + 1) - parts - 1)[run]) / parts[run]
        piece, t = self._arc.places(ends[run] + share * np.diff(ends)[run])
        piece, t = np.where(share == 0, first[run], piece), np.where(share == 0, 0.0, t)
        return np.where(share == 1, first[run + 1] - 1, piece), np.where(share == 1, 1.0, t)

    def _sampled(self, piece: Ints, t: Floats) -> Samples:
        moved = self._mapping.carried(contact.jets(self._legs.coefficients, piece, t))
        there = self.surface.derivatives(moved[:, 0, 0], moved[:, 0, 1])
        found = contact.contact(self.surface, moved, there, np.arange(len(t)))
        length = self._arc.at(piece, t)
        uv = np.ascontiguousarray(moved[:, 0])
        return Samples(self._legs.run[piece], length, uv, there.point, found.tangent, found.curvature_vector, found.normal)

    def reversed(self) -> Self:
        """Return the path from its end to its start."""
        corners = None if self.corners is None else self.corners[::-1]
        return self.replace(nodes=self.nodes[::-1], corners=corners)

    def metrics(
        self, footprint_radius: float, *, surface_step: float | None = None, path_step: float | None = None
    ) -> "PathMetrics":
        """Return what the path is worth."""
        from sdpgrind.finishing._path.metrics import metrics

        return metrics(self, footprint_radius, surface_step, path_step)

    def plot(self, ax: Any = None) -> Any:
        """Draw the path on its surface in three dimensions."""
        from sdpgrind.finishing._path.picture import plot

        return plot(self, ax)


def _nodes(value: npt.ArrayLike) -> Floats:
    """Nodes in the unit square, (n, 2), read-only, no two in a row the same."""
    nodes = checks.finite_array("nodes", value).copy()
    if nodes.ndim != 2 or nodes.shape[1] != 2 or len(nodes) < 2:
        raise ValueError(f"nodes must be of shape (n, 2) with n >= 2; got shape {nodes.shape}")
    outside = np.flatnonzero((nodes < 0).any(axis=1) | (nodes > 1).any(axis=1))
    if len(outside):
        raise checks.refuse(f"nodes[{outside[0]}]", "in the unit square", tuple(nodes[outside[0]].tolist()))
    same = np.flatnonzero((nodes[1:] == nodes[:-1]).all(axis=1))
    if len(same):
        raise checks.refuse(f"nodes[{same[0] + 1}]", f"unlike nodes[{same[0]}]", tuple(nodes[same[0]].tolist()))
    nodes.flags.writeable = False
    return nodes


def _corners(value: npt.ArrayLike, nodes: Floats) -> Bools:
    """Which nodes are sharp, (n,); the ends are none."""
    corners = np.array(value, dtype=bool)
    if corners.shape != (len(nodes),):
        raise ValueError(f"corners must be of shape ({len(nodes)},); got shape {corners.shape}")
    corners[[0, -1]] = False
    corners.flags.writeable = False
    return corners
