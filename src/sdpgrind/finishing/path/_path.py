"""A tool path over a surface: nodes in the unit square, the legs between them, the contact along it."""

from dataclasses import KW_ONLY
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks, pictures
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.quantities import Described, choice, custom, described, part, quantity, text, units_of
from sdpgrind.finishing.path import _contact as contact
from sdpgrind.finishing.path import _crossed_creases as crossed_creases
from sdpgrind.finishing.path._arc_length import POINTS, ArcLength, arc_length
from sdpgrind.finishing.path._blends import rounded
from sdpgrind.finishing.path._crossings import intervals
from sdpgrind.finishing.path._legs import Legs, by_legs, legs, turning
from sdpgrind.finishing.path._mappings import MAPPINGS, Mapping, mapping_of
from sdpgrind.finishing.path._nodes import sharp_corners, square_nodes
from sdpgrind.finishing.path._samples import Ints, PathSamples
from sdpgrind.finishing.surface._creases import creases
from sdpgrind.finishing.surface._derivatives import SurfaceDerivatives
from sdpgrind.finishing.surface._surface import Surface

if TYPE_CHECKING:
    from sdpgrind.finishing.path._metrics import PathMetrics

STILL = 1e-12  # of the path's length or the surface's size, chosen: a shorter piece is no leg
BLEND = 0.05  # pitches, chosen: default deviation of a rounded corner, small next to the gap of passes


@described("finishing.path")
class Path(Described, ByValue):
    """A tool path over a surface, through nodes in the unit square (Wang, section 3).

    Between nodes the path is straight in the square, or a spline; a mapping lays the square on the surface,
    and direction and curvature follow by the chain rule. A sharp corner, also at a crease of the surface,
    where its tangents jump, has two directions of feed; both are kept.

    Parameters
    ----------
    surface : Surface
        Surface under the path.
    nodes : array (n, 2)
        Places (a, b) in the unit square, no two in a row the same.
    mapping : {"parametric", "equal_area"}
        Square on the surface. "parametric": a and b are u and v, stretched onto the domain. "equal_area": u
        by the share of area up to it, v by the share along the line of that u, so that equal areas in the
        square are equal on the surface; no area inside may be zero.
    pattern : str
        Name of the pattern, ``"hilbert5"`` or ``"zigzag"``, a factor of roughness models.
    corners : array (n,) of bool, optional
        Sharp nodes; the ends do not count. None: all turns of straight legs, and none of a smooth path.
    smooth : bool
        Whether a cubic spline in the square with two continuous derivatives joins the nodes between sharp
        corners; False: straight legs.
    deviation : float
        Greatest distance between the sharp path and blends of continuous curvature that round its corners,
        mm; 0: sharp. A blend takes no more than about half of a leg between two corners, and then deviates
        less. See `blended`.

    Raises
    ------
    ValueError
        When nodes are outside of the unit square or coincide, or a corner is missing. Later, when two nodes
        in a row coincide on the surface, a spline leaves the square, the path meets a tear of the surface,
        "equal_area" meets a crease, a corner to be rounded turns right back, or a path to be rounded crosses
        a crease.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> path = finishing.Path(finishing.surface.flat_surface(10.0), [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9)])
    >>> round(path.length, 9)  # mm
    16.0
    >>> path.sample(per_leg=1).tangent.round(9) + 0.0  # one before, one after the corner
    array([[1., 0., 0.],
           [1., 0., 0.],
           [0., 1., 0.],
           [0., 1., 0.]])
    """

    surface: Surface = part(Surface)
    nodes: Floats = custom(square_nodes)
    _: KW_ONLY
    mapping: str = choice(*MAPPINGS, default="parametric")
    pattern: str = text(default="path")
    corners: Bools | None = custom(default=None)
    smooth: bool = custom(default=False)
    deviation: float = quantity("mm", at_least=0, usual=(0.0, 1000.0), typical=0.1, default=0.0)

    def _check(self) -> None:
        object.__setattr__(self, "corners", sharp_corners(self.corners, self.nodes, self.smooth))

    def __repr__(self) -> str:
        rounded = f", corners rounded by {self.deviation:.3g} mm" if self.deviation else ""
        even = ", equal areas" if self.mapping == "equal_area" else ""
        size = f"{len(self.nodes)} nodes, {self.length:.4g} mm"
        return f"Path({self.pattern}{even}, {size}{rounded}, on {self.surface!r})"

    @cached_property
    def _turns(self) -> Bools:
        """Which nodes are corners before rounding."""
        own = self.corners
        if own is None:
            own = np.zeros(len(self.nodes), bool) if self.smooth else turning(self.nodes)
        if not creases(self.surface):
            return own
        return own | crossed_creases.corners(self.surface, self._mapping, legs(self.nodes, own, self.smooth))

    @cached_property
    def _legs(self) -> Legs:
        """Pieces of the path in the square."""
        sharp = legs(self.nodes, self._turns, self.smooth)
        if creases(self.surface):
            crossed_creases.refuse_rounding(self.surface, self._mapping, sharp, self.deviation)
            sharp = crossed_creases.cut(self.surface, self._mapping, sharp)
        if self.deviation == 0 or not self._turns.any():
            return sharp
        return rounded(self.surface, self._mapping, sharp, self._turns, self.deviation)

    @cached_property
    def _mapping(self) -> Mapping:
        return mapping_of(self.mapping, self.surface)

    @cached_property
    def _moved(self) -> Floats:
        """Parameters at the nodes with their derivatives by t, (k, 3, 2); two of a sharp corner."""
        own = self._legs
        return self._mapping.carried(contact.jets(own.coefficients, own.at_piece, own.at_t))

    @cached_property
    def _there(self) -> SurfaceDerivatives:
        """The surface at the nodes."""
        uv = self.uv
        return self.surface.derivatives(uv[:, 0], uv[:, 1])

    @cached_property
    def _arc(self) -> ArcLength:
        """Length by piece and t."""
        own = self._legs
        cut = intervals(self.surface, self._mapping, own.coefficients)
        found = arc_length(self._speed, *cut, POINTS[own.coefficients.shape[1] == 2], self.surface.size)
        still = np.flatnonzero(found.pieces(len(own.run)) <= STILL * max(found.total, self.surface.size))
        if len(still):
            u, v = self._mapping.carried(contact.jets(own.coefficients, still[:1], np.zeros(1)))[0, 0]
            raise ValueError(
                "nodes must be apart on the surface;"
                f" leg {still[0]}, from (u, v) = ({u:.6g}, {v:.6g}), has no length"
            )
        return found

    def _speed(self, piece: Ints, t: Floats) -> Floats:
        return contact.speed(self.surface, self._mapping, self._legs.coefficients, piece, t)

    @property
    def uv(self) -> Floats:
        """Parameters at the nodes, (n, 2), in units of the surface; of a rounded corner, amid its blend."""
        first = np.searchsorted(self._legs.at_node, np.arange(len(self.nodes)))
        return np.ascontiguousarray(self._moved[first, 0])

    @property
    def points(self) -> Floats:
        """Nodes on the surface, (n, 3), mm."""
        return self._there.point

    @property
    def length(self) -> float:
        """Length on the surface, mm."""
        return self._arc.total

    @property
    def pitch(self) -> float:
        """Mean distance of neighbouring passes: area over length, mm."""
        return self.surface.area / self.length

    @property
    def runs(self) -> Ints:
        """First and last node of each smooth run between corners, (r, 2), whatever creases it crosses."""
        sharp = np.flatnonzero(np.diff(self._legs.at_node) == 0)
        ends = np.concatenate([[0], self._legs.at_node[sharp], [len(self.nodes) - 1]])
        return np.stack([ends[:-1], ends[1:]], axis=1)

    def derivatives(self) -> SurfaceDerivatives:
        """Return the surface's derivatives at the nodes, each (n, 3), mm a unit of the parameters."""
        return self._there

    def frames(self) -> Floats:
        """Return contact frames (k, 4, 4) at the nodes, in the surface's frame, mm.

        x is the direction of feed t, z the outward normal n, y = n x t. A sharp corner has two: before and
        after.
        """
        at_node = self._legs.at_node
        there, place = self._there, at_node
        if creases(self.surface):  # both sides of one
            there, place = self.surface.derivatives(*self._moved[:, 0].T), np.arange(len(at_node))
        found = contact.contact(self.surface, self._moved, there, place)
        return contact.frames(self.points, at_node, found.tangent, found.normal)

    def sample(self, step: float | None = None, per_leg: int = 8) -> PathSamples:
        """Return samples along the path, both sides of a sharp corner among them.

        Parameters
        ----------
        step : float, optional
            Greatest length between neighbours in a run, mm. None: by legs.
        per_leg : int
            Parts of each leg and each blend.

        Raises
        ------
        ValueError
            When one is not > 0.
        """
        if step is None:
            return self._sampled(*by_legs(self._legs.run, checks.count("per_leg", per_leg)))
        return self._sampled(*self._arc.evenly(self._legs.run, checks.positive("step", step, "mm")))

    def at(self, length: npt.ArrayLike) -> PathSamples:
        """Return samples at lengths (m,) from the start of the path, mm; at a sharp corner, the one after it.

        Raises
        ------
        ValueError
            When a length is not on the path.
        """
        total, lengths = self.length, np.atleast_1d(checks.finite_array("length", length, "mm"))
        checks.inside("length", lengths, 0.0, total, "mm", slack=1e-9 * total, numbered=True)
        return self._sampled(*self._arc.places(np.clip(lengths, 0.0, total)))

    def _sampled(self, piece: Ints, t: Floats) -> PathSamples:
        moved, there = contact.met(self.surface, self._mapping, self._legs.coefficients, piece, t)
        found = contact.contact(self.surface, moved, there, np.arange(len(t)))
        length, uv = self._arc.at(piece, t), np.ascontiguousarray(moved[:, 0])
        return PathSamples(
            self._legs.run[piece],
            length,
            uv,
            there.point,
            found.tangent,
            found.curvature_vector,
            found.normal,
            np.zeros(len(t)),
        )

    def resampled(self, step: float) -> Self:
        """Return the path with nodes at most `step` (mm) apart in each run; its sharp corners stay nodes.

        Straight legs stay straight. A smooth path, or one with rounded corners, becomes a spline through its
        nodes.

        Raises
        ------
        ValueError
            When the step is not > 0.
        """
        run = self._legs.run
        piece, t = self._arc.evenly(run, checks.positive("step", step, "mm"))
        first = np.append(True, np.diff(run[piece]) == 0)
        nodes = contact.jets(self._legs.coefficients, piece[first], t[first])[:, 0]
        corners = np.append(np.diff(run[piece]) > 0, False)[first]
        return self.replace(
            nodes=nodes, corners=corners, smooth=self.smooth or self.deviation > 0, deviation=0.0
        )

    def reversed(self) -> Self:
        """Return the path with its nodes in the unit square from end to start."""
        return self.replace(
            nodes=self.nodes[::-1], corners=None if self.corners is None else self.corners[::-1]
        )

    def blended(self, deviation: float | None = None) -> Self:
        """Return the path with corners rounded within `deviation`, mm; None: 0.05 pitch.

        Raises
        ------
        ValueError
            When the deviation is not > 0. Later, when a corner cannot be rounded, or the path crosses a
            crease.

        Examples
        --------
        >>> from sdpgrind import finishing
        >>> path = finishing.hilbert(finishing.surface.flat_surface(8.0), 3)
        >>> len(path.runs), len(path.blended().runs)
        (51, 1)
        """
        unit = units_of(Path)["deviation"]
        return self.replace(
            deviation=BLEND * self.pitch
            if deviation is None
            else checks.positive("deviation", deviation, unit)
        )

    def metrics(
        self, footprint_radius: float, *, surface_step: float | None = None, path_step: float | None = None
    ) -> "PathMetrics":
        """Return lengths, steps, areas, coverage and gaps of the path, with the sampling.

        Parameters
        ----------
        footprint_radius : float
            Greatest straight distance of the tool's effect from the path, mm; see `ball_footprint`.
        surface_step, path_step : float, optional
            Width of the smallest cells of the surface, mm, cut to 1/4 of the pitch (None: 1/40 of radius),
            and longest chord of the path, mm (None: chords leave it by 0.1 % of radius or pitch).

        Raises
        ------
        ValueError
            When one is not > 0, or needs more than 30 million samples.
        """
        from sdpgrind.finishing.path._metrics import metrics

        return metrics(self, footprint_radius, surface_step, path_step)

    def plot(self, ax: Any = None) -> Any:
        """Draw the path on its surface in three dimensions, mm, in the axes `ax` or a new figure."""
        return pictures.drawn("sdpgrind.finishing.path._picture:plot", self, ax)
