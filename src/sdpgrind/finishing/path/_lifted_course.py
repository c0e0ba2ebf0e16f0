"""Course of a tool along pieces of a path, with lifts before, between and behind them."""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks, pictures
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._air import AirMove, across, contact_end, lifted_off, put_down, straight_down
from sdpgrind.finishing.path._lift import Lift
from sdpgrind.finishing.path._path import Path
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


class LiftedCourse(ABC):
    """Pieces with lifts before, between and behind them; see `LiftedPath` and `SequencedPath`."""

    lift: Lift

    @property
    @abstractmethod
    def pieces(self) -> tuple[Path, ...]:
        """The pieces in sequence, each a `Path` (mm)."""

    @property
    @abstractmethod
    def patches(self) -> tuple[Patch, ...]:
        """Patches under the pieces, mm, each once."""

    @property
    @abstractmethod
    def surface(self) -> Surface:
        """Whole surface under the path, mm."""

    @property
    @abstractmethod
    def nodes(self) -> Floats:
        """Nodes of all pieces in the unit square, (n, 2) (dimensionless)."""

    @property
    @abstractmethod
    def mapping(self) -> str:
        """Square on the surface (dimensionless)."""

    @property
    @abstractmethod
    def pattern(self) -> str:
        """Name of the pattern (no unit)."""

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
            line, arc = down[k]
            over = across(off[k - 1][1], line, self.lift.height) if k else None
            if over is not None:
                add(over, 1)
            elif k:
                line = straight_down(off[k - 1][1], line)
            add(line, 1)
            add(arc, 0)
            add(piece, int(piece.sample(per_leg=1).run[-1]))
            add(off[k][0], 1)
            add(off[k][1], 1)
        return tuple(found)

    @cached_property
    def over(self) -> Floats:
        """Lengths (n, 2) at which the tool is over start and end of each piece, at the height, mm."""
        moves = [(each, each.thing) for each in self._course if isinstance(each.thing, AirMove)]
        lines = [(each, move) for each, move in moves if not (move.settling or move.is_crossing)]
        down = [each.before for each, move in lines if move.back]
        up = [each.before + each.length for each, move in lines if not move.back]
        return np.stack([down, up], axis=1)

    @property
    def crossings(self) -> tuple[AirMove, ...]:
        """Straight moves between pieces, at the height, mm."""
        moves = (each.thing for each in self._course)
        return tuple(each for each in moves if isinstance(each, AirMove) and each.is_crossing)

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
        return sum(each.area for each in self.patches) / self.contact_length

    @property
    def runs(self) -> Ints:
        """First and last node of each smooth run on the work, (r, 2)."""
        sizes = np.array([len(each.nodes) for each in self.pieces])
        firsts = np.cumsum(sizes) - sizes
        return np.concatenate([first + each.runs for first, each in zip(firsts, self.pieces, strict=True)])

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

    def metrics(
        self, footprint_radius: float, *, surface_step: float | None = None, path_step: float | None = None
    ) -> "PathMetrics":
        """Return the quality of the pieces over the trimmed area of their patch; see `Path.metrics`.

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
            When the path is on several patches: ``path.paths[0].metrics(...)`` tells of each.
        """
        from sdpgrind.finishing.path._metrics import metrics

        if len(self.patches) > 1:
            rule = "on one patch for metrics; path.paths[0].metrics(...) tells of each"
            raise checks.refuse("path", rule, f"one on {len(self.patches)} patches")
        patch = self.patches[0]
        return metrics(self, footprint_radius, surface_step, path_step, pieces=self.pieces, patch=patch)

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
