"""A tool path in several pieces over a trimmed surface, with lifts before, between and behind them."""

from dataclasses import KW_ONLY
from functools import cached_property
from itertools import pairwise
from typing import Any, Self

from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, part, units_of
from sdpgrind.finishing.path._lift import Lift
from sdpgrind.finishing.path._lifted_course import LiftedCourse
from sdpgrind.finishing.path._path import BLEND, Path
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._surface import Surface


def _starts(name: str, value: Any) -> tuple[int, ...]:
    found = tuple(int(checks.count(f"{name}[{k}]", each, 0)) for k, each in enumerate(value))
    if not found or found[0] != 0 or any(b - a < 2 for a, b in pairwise(found)):
        raise checks.refuse(name, "first nodes of pieces of two or more nodes, from 0", found)
    return found


@described("finishing.lifted_path")
class LiftedPath(Described, ByValue, LiftedCourse):
    """Pieces of a path on a patch, and the lifts that join them.

    The tool comes down to the first piece, is lifted between pieces, and leaves the last one. Lengths,
    samples and runs include the air; metrics count the pieces and the trimmed area alone. The straight lines
    of a lift are runs of their own; its arcs belong to the first and last run of a piece.

    Parameters
    ----------
    patch : Patch
        Trimmed surface under the path.
    path : Path
        Nodes of all pieces in sequence; its legs from one piece to the next are not travelled.
    starts : sequence of int
        Index of the first node of each piece, from 0.
    lift : Lift
        The lifts, mm.

    Raises
    ------
    ValueError
        When the path is not on the surface of the patch, or a piece has fewer than two nodes.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> path = fin.zigzag(fin.surface.flat_surface(20.0), pitch=5.0, lift=fin.Lift(height=10.0))
    >>> len(path.pieces), round(path.contact_length, 6), bool(path.sample().contact.all())
    (1, 75.0, False)
    """

    patch: Patch = part(Patch)
    path: Path = part(Path)
    _: KW_ONLY
    starts: tuple[int, ...] = custom(_starts, default=(0,))
    lift: Lift = part(Lift, default_factory=Lift)

    def _check(self) -> None:
        if self.path.surface != self.patch.surface:
            raise checks.refuse("path", "on the surface of the patch", self.path)
        if self.starts[-1] > len(self.path.nodes) - 2:
            raise checks.refuse(
                "starts", f"<= {len(self.path.nodes) - 2}, two nodes before the last", self.starts
            )

    def __repr__(self) -> str:
        count = len(self.starts)
        size = f"{count} piece{'s' if count > 1 else ''}, {self.contact_length:.4g} mm on the work"
        return f"LiftedPath({self.pattern}, {size} of {self.length:.4g} mm, on {self.patch!r})"

    @cached_property
    def pieces(self) -> tuple[Path, ...]:
        """The pieces, each a `Path` (mm)."""
        ends = (*self.starts[1:], len(self.path.nodes))
        own = self.path.corners
        return tuple(
            self.path.replace(nodes=self.path.nodes[a:b], corners=None if own is None else own[a:b])
            for a, b in zip(self.starts, ends, strict=True)
        )

    @property
    def surface(self) -> Surface:
        """Whole surface under the path, mm."""
        return self.path.surface

    @property
    def nodes(self) -> Floats:
        """Nodes of all pieces in the unit square, (n, 2) (dimensionless)."""
        return self.path.nodes

    @property
    def mapping(self) -> str:
        """Square on the surface (dimensionless)."""
        return self.path.mapping

    @property
    def pattern(self) -> str:
        """Name of the pattern (no unit)."""
        return self.path.pattern

    @property
    def deviation(self) -> float:
        """Deviation of rounded corners, mm."""
        return self.path.deviation

    @property
    def patches(self) -> tuple[Patch, ...]:
        """The patch, mm."""
        return (self.patch,)

    def reversed(self) -> Self:
        """Return the path from its end to its start, mm."""
        count = len(self.path.nodes)
        ends = (*self.starts[1:], count)
        starts = tuple(sorted(count - end for end in ends))
        return self.replace(path=self.path.reversed(), starts=starts)

    def blended(self, deviation: float | None = None) -> Self:
        """Return the path with corners rounded within `deviation`, mm; None: 0.05 pitch. See `Path.blended`.

        Raises
        ------
        ValueError
            When the deviation is not > 0. Later, when a corner cannot be rounded, or the path crosses a
            crease.
        """
        unit = units_of(Path)["deviation"]
        most = BLEND * self.pitch if deviation is None else checks.positive("deviation", deviation, unit)
        return self.replace(path=self.path.replace(deviation=most))
