"""Pieces of one path or of several patches in a sequence of their own, joined by lifts."""

from dataclasses import KW_ONLY
from functools import cached_property
from typing import Any, Self

import numpy as np
from scipy.spatial import cKDTree

from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described, flag, part
from sdpgrind.finishing.path._air import contact_end, lifted_off
from sdpgrind.finishing.path._lift import Lift
from sdpgrind.finishing.path._lifted_course import LiftedCourse
from sdpgrind.finishing.path._lifted_path import LiftedPath
from sdpgrind.finishing.path._order import as_given, cost_of
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.surface._patch import Patch
from sdpgrind.finishing.surface._surface import Surface

NEAR = 1.0  # mm, chosen: places on the straight moves, and on the work, whose distances are compared
SEVERAL = "several"  # name of patterns and mappings of which there is more than one


def _paths(name: str, value: Any) -> tuple[Path | LiftedPath, ...]:
    found = tuple(value) if isinstance(value, tuple | list) else (value,)
    for k, each in enumerate(found):
        if not isinstance(each, Path | LiftedPath):
            raise checks.refuse(f"{name}[{k}]", "a Path or a LiftedPath (see finishing.zigzag)", each)
    if not found:
        raise checks.refuse(name, "one path or more", found)
    return found


def _times(name: str, value: Any) -> tuple[float, float] | None:
    if value is None:
        return None
    given, now = checks.finite_array(name, value, "s")
    return float(given), float(now)


@described("finishing.sequenced_path")
class SequencedPath(Described, ByValue, LiftedCourse):
    """Pieces of one path, or of paths on several patches, in a sequence of their own, joined by lifts.

    What `sequence` returns. Lengths, samples and runs include the air, as those of a `LiftedPath`.

    Parameters
    ----------
    paths : sequence of Path or LiftedPath
        The paths as given; their pieces are numbered in sequence. Their own lifts do not count.
    order : sequence of int
        Number of each piece, in the sequence in which they are done.
    backwards : sequence of bool
        Whether each of them is done from its end to its start.
    lift : Lift
        The lifts, mm.
    exact : bool
        Whether no other sequence is shorter, or with a robot faster; False: none was found by the search.
    times : (float, float), optional
        Time of the moves between pieces by a robot, s: in the sequence as given, and in this one.

    Raises
    ------
    ValueError
        When the order is not one of all pieces.

    Examples
    --------
    >>> from sdpgrind import finishing as fin
    >>> flat = fin.surface.flat_surface(20.0)
    >>> rows = [fin.Path(flat, [(0.1, b), (0.9, b)]) for b in (0.1, 0.5, 0.9)]
    >>> path = fin.sequence(rows)
    >>> path.order, path.backwards, path.exact
    ((0, 1, 2), (False, True, False), True)
    """

    paths: tuple[Path | LiftedPath, ...] = custom(_paths)
    _: KW_ONLY
    order: tuple[int, ...] = custom()
    backwards: tuple[bool, ...] = custom()
    lift: Lift = part(Lift, default_factory=Lift)
    exact: bool = flag(default=False)
    times: tuple[float, float] | None = custom(_times, "s", default=None)

    def _check(self) -> None:
        count = len(self._given)
        order = tuple(int(checks.count(f"order[{k}]", each, 0)) for k, each in enumerate(self.order))
        if sorted(order) != list(range(count)):
            raise checks.refuse("order", f"each of 0 to {count - 1} once", self.order)
        back = tuple(
            bool(checks.kind(f"backwards[{k}]", each, bool)) for k, each in enumerate(self.backwards)
        )
        if len(back) != count:
            raise checks.refuse("backwards", f"{count} truth values, one for each piece", self.backwards)
        object.__setattr__(self, "order", order)
        object.__setattr__(self, "backwards", back)

    def __repr__(self) -> str:
        count, patches = len(self.order), len(self.patches)
        pieces = f"{count} piece{'s' if count > 1 else ''} of {patches} patch{'es' if patches > 1 else ''}"
        size = f"{self.contact_length:.4g} mm on the work of {self.length:.4g} mm"
        told = f"{self.travel:.4g} mm between pieces, {self.travel_given:.4g} mm as given"
        if self.times is not None:
            told = f"{self.times[1]:.3g} s between pieces, {self.times[0]:.3g} s as given"
        return f"SequencedPath({self.pattern}, {pieces}, {size}, {told})"

    @cached_property
    def _given(self) -> tuple[Path, ...]:
        """Pieces as given."""
        return tuple(
            piece
            for path in self.paths
            for piece in (path.pieces if isinstance(path, LiftedPath) else (path,))
        )

    @cached_property
    def pieces(self) -> tuple[Path, ...]:
        """The pieces in sequence, each a `Path` (mm)."""
        pairs = zip(self.order, self.backwards, strict=True)
        return tuple(self._given[k].reversed() if back else self._given[k] for k, back in pairs)

    @cached_property
    def patches(self) -> tuple[Patch, ...]:
        """Patches under the pieces, mm, each once."""
        each = (path.patch if isinstance(path, LiftedPath) else Patch(path.surface) for path in self.paths)
        return tuple(dict.fromkeys(each))

    @property
    def surface(self) -> Surface:
        """Whole surface under the path, mm.

        Raises
        ------
        ValueError
            When there are several.
        """
        surfaces = {path.surface for path in self.paths}
        if len(surfaces) > 1:
            rule = "on one surface for that; paths, patches and pieces tell of each"
            raise checks.refuse("path", rule, f"one on {len(surfaces)} surfaces")
        return self.paths[0].surface

    @property
    def nodes(self) -> Floats:
        """Nodes of all pieces in the unit squares of their surfaces, (n, 2) (dimensionless)."""
        return np.concatenate([each.nodes for each in self.pieces])

    @property
    def mapping(self) -> str:
        """Square on the surface (dimensionless); ``"several"``: more than one."""
        return _common(each.mapping for each in self.paths)

    @property
    def pattern(self) -> str:
        """Name of the pattern (no unit); ``"several"``: more than one."""
        return _common(each.pattern for each in self.paths)

    @property
    def deviation(self) -> float:
        """Greatest deviation of rounded corners, mm."""
        return max(each.deviation for each in self.paths)

    @cached_property
    def _travels(self) -> Floats:
        """Lengths between the pieces as given, mm; see `travels`."""
        return travels(self._given, self.lift)

    @property
    def travel(self) -> float:
        """Length of the straight moves between pieces, at the height of the lifts, mm."""
        return cost_of(self._travels, 2 * np.array(self.order) + self.backwards)

    @property
    def travel_given(self) -> float:
        """The same in the sequence as given, all pieces forward, mm."""
        return cost_of(self._travels, as_given(len(self._given)))

    @cached_property
    def least_clearance(self) -> float:
        """Least distance of the straight moves between pieces from the pieces, mm, at places 1 mm apart.

        With one piece, infinite. The body of the tool, the rest of the part and all around it are not looked
        at.
        """
        moves = [
            each.at(np.linspace(0.0, each.length, int(each.length / NEAR) + 2)) for each in self.crossings
        ]
        if not moves:
            return np.inf
        work = cKDTree(np.concatenate([each.sample(NEAR).point for each in self.pieces]))
        return float(work.query(np.concatenate([each.point for each in moves]))[0].min())

    def reversed(self) -> Self:
        """Return the path from its end to its start, mm; times of a robot (s) are those of this one alone."""
        back, timed = tuple(not each for each in self.backwards[::-1]), self.times is not None
        return self.replace(
            order=self.order[::-1], backwards=back, exact=self.exact and not timed, times=None
        )

    def blended(self, deviation: float | None = None) -> Self:
        """Return the path with corners rounded within `deviation`, mm; None: 0.05 pitch of each given path.

        Raises
        ------
        ValueError
            When the deviation is not > 0. Later, when a corner cannot be rounded, or the path crosses a
            crease.
        """
        return self.replace(paths=tuple(each.blended(deviation) for each in self.paths))


def _common(names: Any) -> str:
    found = set(names)
    return found.pop() if len(found) == 1 else SEVERAL


def _over_ends(pieces: tuple[Path, ...], lift: Lift) -> Floats:
    """Places (n, 2, 3) over start and end of each piece, mm, between which the tool moves."""
    lines = [[lifted_off(contact_end(each, way), lift)[1] for way in (-1, 1)] for each in pieces]
    return np.array([[line.at(np.array([line.length])).point[0] for line in pair] for pair in lines])


def travels(pieces: tuple[Path, ...], lift: Lift) -> Floats:
    """Return the length of the straight move from each state of a piece to each other one, (2 n, 2 n), mm."""
    over = _over_ends(pieces, lift)
    starts, ends = over.reshape(-1, 3), over[:, ::-1].reshape(-1, 3)
    return np.asarray(np.linalg.norm(ends[:, None] - starts, axis=-1))
