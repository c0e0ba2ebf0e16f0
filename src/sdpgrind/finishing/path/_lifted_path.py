"""A tool path in several pieces over a trimmed surface, with lifts before, between and behind them."""

from dataclasses import KW_ONLY
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks, pictures
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, part, units_of
from sdpgrind.finishing.path._air import AirMove, across, contact_end, lifted_off, put_down
from sdpgrind.finishing.path._lift import Lift
from sdpgrind.finishing.path._path import BLEND, Path
from sdpgrind.finishing.path._samples import Ints, PathSamples
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._surface import Surface

if TYPE_CHECKING:
    from sdpgrind.finishing.path._metrics import PathMetrics

LEG = 2.0  # mm, chosen: a move through the air counts as legs of at most this length


class PathStretch(NamedTuple):
    """A piece or a move of a lifted path: its first run, length before it, and length, mm."""

    thing: Path | AirMove
    run: int
    before: float
    length: float


def _starts(name: str, value: Any) -> tuple[int, ...]:
    found = tuple(int(checks.count(f"{name}[{k}]", each, 0)) for k, each in enumerate(value))
    if not found or found[0] != 0 or any(b - a < 2 for a, b in pairwise(found)):
        raise checks.refuse(name, "first nodes of pieces of two or more nodes, from 0", found)
    return found


@described("finishing.lifted_path")
class LiftedPath(Described, ByValue):
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

    @cached_property
    def _course(self) -> tuple[PathStretch, ...]:
        """Moves and pieces in sequence."""
        found: list[PathStretch] = []
        run, before = 0, 0.0
        down = [put_down(contact_end(piece, -1), self.lift) for piece in self.pieces]
        off = [lifted_off(contact_end(piece, 1), self.lift) for piece in self.pieces]

        def add(thing: Path | AirMove, new: int) -> None:
            nonlocal run, before
            found.append(PathStretch(thing, run, before, thing.length))
            run, before = run + new, before + thing.length

        for k, piece in enumerate(self.pieces):
            over = across(off[k - 1][1], down[k][0], self.lift.height) if k else None
            if over is not None:
                add(over, 1)
            add(down[k][0], 1)
            add(down[k][1], 0)
            add(piece, int(piece.sample(per_leg=1).run[-1]))
            add(off[k][0], 1)
            add(off[k][1], 1)
        return tuple(found)

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
    def points(self) -> Floats:
        """Nodes on the surface, (n, 3), mm."""
        return np.concatenate([each.points for each in self.pieces])

    @property
    def length(self) -> float:
        """Length with all lifts, mm."""
        last = self._course[-1]
        return last.before + last.length

    @cached_property
    def contact_length(self) -> float:
        """Length on the work, mm."""
        return float(sum(each.length for each in self.pieces))

    @property
    def pitch(self) -> float:
        """Mean distance of neighbouring passes: trimmed area over length on the work, mm."""
        return self.patch.area / self.contact_length

    @property
    def runs(self) -> Ints:
        """First and last node of each smooth run on the work, (r, 2)."""
        return np.concatenate(
            [first + each.runs for first, each in zip(self.starts, self.pieces, strict=True)]
        )

    def frames(self) -> Floats:
        """Return contact frames (k, 4, 4) at the nodes of all pieces, mm; see `Path.frames`."""
        return np.concatenate([each.frames() for each in self.pieces])

    def sample(self, step: float | None = None, per_leg: int = 8) -> PathSamples:
        """Return samples along pieces and lifts; see `Path.sample`.

        Parameters
        ----------
        step : float, optional
            Greatest length between neighbours in a run, mm. None: by legs; moves through the air count as
            legs of at most 2 mm.
        per_leg : int
            Parts of each leg and each blend.

        Raises
        ------
        ValueError
            When one is not > 0.
        """
        if step is not None:
            checks.positive("step", step, "mm")
        checks.count("per_leg", per_leg)
        found = []
        for stretch in self._course:
            if isinstance(stretch.thing, Path):
                own = stretch.thing.sample(step, per_leg)
                found.append(own._replace(run=own.run + stretch.run, length=own.length + stretch.before))
            else:
                most = LEG / per_leg if step is None else step
                parts = max(1, int(np.ceil(stretch.length / most * (1 - 1e-12))))
                places = np.linspace(0.0, stretch.length, parts + 1)
                found.append(_in_air(stretch, _inner(stretch.thing, places)))
        return _joined(found)

    def at(self, length: npt.ArrayLike) -> PathSamples:
        """Return samples at lengths (m,) from the start of the path, mm; see `Path.at`.

        Raises
        ------
        ValueError
            When a length is not on the path.
        """
        lengths = np.atleast_1d(checks.finite_array("length", length, "mm"))
        checks.inside("length", lengths, 0.0, self.length, "mm", slack=1e-9 * self.length, numbered=True)
        before = np.array([each.before for each in self._course])
        which = np.maximum(np.searchsorted(before, lengths, side="right") - 1, 0)
        order = np.argsort(which, kind="stable")
        found = [self._of(self._course[k], lengths[order[which[order] == k]]) for k in np.unique(which)]
        back = np.argsort(order, kind="stable")
        joined = _joined(found)
        return PathSamples._make(column[back] for column in joined)

    def _of(self, stretch: PathStretch, lengths: Floats) -> PathSamples:
        """Samples on one stretch."""
        own = np.clip(lengths - stretch.before, 0.0, stretch.length)
        if isinstance(stretch.thing, AirMove):
            return _in_air(stretch, own)
        found = stretch.thing.at(own)
        return found._replace(run=found.run + stretch.run, length=found.length + stretch.before)

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

    def metrics(
        self, footprint_radius: float, *, surface_step: float | None = None, path_step: float | None = None
    ) -> "PathMetrics":
        """Return the quality of the pieces over the trimmed area; see `Path.metrics`.

        Parameters
        ----------
        footprint_radius : float
            Greatest straight distance of the tool's effect from the path, mm; see `ball_footprint`.
        surface_step, path_step : float, optional
            Width of the smallest cells of the surface, mm, cut to 1/4 of the pitch (None: 1/40 of radius),
            and longest chord of the path, mm (None: chords leave it by 0.1 % of radius or pitch).
        """
        from sdpgrind.finishing.path._metrics import metrics

        return metrics(self, footprint_radius, surface_step, path_step, pieces=self.pieces, patch=self.patch)

    def plot(self, ax: Any = None) -> Any:
        """Draw the path with its lifts in three dimensions, mm, in the axes `ax` or a new figure."""
        return pictures.drawn("sdpgrind.finishing.path._picture:plot", self, ax)


def _inner(move: AirMove, places: Floats) -> Floats:
    """Places without that at the contact, which belongs to the piece."""
    if not move.settling:
        return places
    return places[:-1] if move.back else places[1:]


def _in_air(stretch: PathStretch, lengths: Floats) -> PathSamples:
    """Samples of a move through the air."""
    assert isinstance(stretch.thing, AirMove)  # the caller knows
    there = stretch.thing.at(lengths)
    return PathSamples(
        np.full(len(lengths), stretch.run),
        stretch.before + lengths,
        np.full((len(lengths), 2), np.nan),
        there.point,
        there.frame[:, :, 0],
        there.curvature,
        there.frame[:, :, 2],
        there.clearance,
    )


def _joined(parts: list[PathSamples]) -> PathSamples:
    """Samples of several stretches in sequence."""
    return PathSamples._make(np.concatenate(columns) for columns in zip(*parts, strict=True))
