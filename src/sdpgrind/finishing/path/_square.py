"""The unit square in the direction of its passes: s along them, c across."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._mappings import Mapping, mapping_of
from sdpgrind.finishing.path._spacing import INTERVALS, ROWS, Gaps, gaps_of, graded, with_middles
from sdpgrind.finishing.surface import _evaluation as evaluation
from sdpgrind.finishing.surface._creases import creases
from sdpgrind.finishing.surface._surface import Surface

BEFORE = 1e-12  # of the square, chosen: distance of a place before a crease


@dataclass(frozen=True)
class Square:
    """A surface over the unit square by a `mapping`, with passes `along` u or v."""

    surface: Surface
    mapping: str
    along: str

    @cached_property
    def _mapping(self) -> Mapping:
        return mapping_of(self.mapping, self.surface)

    def nodes(self, s: Floats, c: Floats) -> Floats:
        """Places (..., 2) in the square."""
        pair = np.broadcast_arrays(s, c)
        return np.stack(pair if self.along == "u" else pair[::-1], axis=-1)

    def points(self, s: Floats, c: Floats) -> Floats:
        """Points (n, 3) on the surface, mm, at places s (n,) and c (n,)."""
        u, v = np.ascontiguousarray(self._mapping.sides(self.nodes(s, c))[:, 0].T)
        return self.surface.point(u, v)

    def tangents(self, s: Floats, c: Floats) -> tuple[Floats, Floats]:
        """Derivatives Q_s, Q_c (..., 3) on the surface, mm."""
        lattice = {s.shape[1:], c.shape[1:]} == {(1,), ()}
        by_a, by_b = self._on_lattice(s, c) if lattice else self._derivatives(self.nodes(s, c))
        return (by_a, by_b) if self.along == "u" else (by_b, by_a)

    def along_passes(self, s: Floats, c: Floats) -> Floats:
        """Derivative Q_s (..., 3) on the surface, mm."""
        return self.tangents(s, c)[0]

    def _on_lattice(self, s: Floats, c: Floats) -> list[Floats]:
        """Derivatives by a and b at each s with each c, one of which is a column (n, 1)."""
        a, b = (s, c) if self.along == "u" else (c, s)
        if self.mapping == "parametric":
            (u, du), (v, dv) = (_side(*sides) for sides in zip((a, b), self.surface.domain, strict=True))
            by_u, by_v = evaluation.tangents_on_grid(evaluation.net_of(self.surface), u, v)
            found = [du * by_u, dv * by_v]
        else:  # lines of b one after the other: the strip of an a is found once
            pair = np.broadcast_arrays(a.reshape(-1, 1), b.ravel())
            found = self._derivatives(np.stack(pair, axis=-1))
        return found if a.ndim == 2 else [np.ascontiguousarray(each.swapaxes(0, 1)) for each in found]

    def _derivatives(self, places: Floats) -> list[Floats]:
        """Derivatives of the surface's points by a and b at places (..., 2) in the square."""
        moved = self._mapping.sides(places.reshape(-1, 2))
        there = self.surface.derivatives(moved[:, 0, 0], moved[:, 0, 1])
        by_a = moved[:, 1, :1] * there.u + moved[:, 1, 1:] * there.v
        by_b = moved[:, 2, 1:] * there.v  # u does not depend on b
        return [each.reshape(*places.shape[:-1], 3) for each in (by_a, by_b)]

    def gaps(self, across: bool = True) -> Gaps:
        """Gaps of lines of constant c, or of those of constant s."""
        return _gaps(self, across)

    def both_sides(self, side: int) -> Floats:
        """Return breaks with a place just before each crease: derivatives at a knot are those behind it."""
        axis = side if self.along == "u" else 1 - side
        low, high = self.surface.domain[axis]
        places = [
            (each.place - low) / (high - low) - BEFORE for each in creases(self.surface) if each.axis == axis
        ]
        return np.sort(np.concatenate([self.breaks(side), places]))

    def breaks(self, side: int) -> Floats:
        """Knots on the side of s (0) or of c (1), scaled to the unit square; only its ends for equal_area."""
        if self.mapping != "parametric":
            return np.array([0.0, 1.0])
        knots = self.surface.breaks[side if self.along == "u" else 1 - side]
        return np.asarray((knots - knots[0]) / (knots[-1] - knots[0]))


def _side(places: Floats, ends: tuple[float, float]) -> tuple[Floats, float]:
    """Parameters at places on a side of the square stretched to its ends, and their derivative."""
    low, high = ends
    return np.minimum(low + places * (high - low), high).ravel(), high - low  # rounding may step over the end


@lru_cache(maxsize=8)  # chosen: of a few surfaces, for other pitches; 1 MB each
def _gaps(square: Square, across: bool) -> Gaps:
    first, second = (square.both_sides(side) for side in ((0, 1) if across else (1, 0)))
    rows, places = graded(first, ROWS - 1), with_middles(graded(second, INTERVALS))
    if across:
        return gaps_of(*square.tangents(rows[:, None], places), places)
    by_s, by_c = square.tangents(places, rows[:, None])
    return gaps_of(by_c, by_s, places)
