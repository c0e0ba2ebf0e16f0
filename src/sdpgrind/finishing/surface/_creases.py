"""Creases: knots at which the tangents of a surface jump."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sdpgrind.finishing.surface._surface import Surface

PLACES = 9  # chosen: places in each knot span along a knot for the comparison of its two sides
JUMP = 1e-9  # of the greatest derivative, or of the surface's size, chosen: rounding


class Crease(NamedTuple):
    """A knot of u (axis 0) or v (1), `times` there at a degree; `torn` where points jump, too."""

    axis: int
    place: float
    times: int
    degree: int
    torn: bool

    def __str__(self) -> str:
        return f"knot {'uv'[self.axis]} = {self.place:g} is there {self.times} times at degree {self.degree}"


@lru_cache(maxsize=64)
def creases(surface: Surface) -> tuple[Crease, ...]:
    """Return the inner knots at which tangents jump."""
    found = [_found(surface, axis, place, times) for axis in (0, 1) for place, times in _sharp(surface, axis)]
    return tuple(crease for crease in found if crease is not None)


def refuse_creases(surface: Surface, mapping: str) -> None:
    """Raise for a mapping that tangents with a jump would spoil."""
    for crease in creases(surface):
        raise ValueError(
            f"mapping must be another one than {mapping!r} on a surface whose tangents jump: its {crease}"
        )


def _sharp(surface: Surface, axis: int) -> list[tuple[float, int]]:
    """Inner knots of a multiplicity that allows a jump."""
    places, times = np.unique(surface.knots[axis], return_counts=True)
    inside = np.isin(places, surface.breaks[axis][1:-1])
    places, times = places[inside], times[inside]
    sharp = times >= surface.degree[axis]
    return list(zip(places[sharp].tolist(), times[sharp].tolist(), strict=True))


def _found(surface: Surface, axis: int, place: float, times: int) -> Crease | None:
    ends = surface.breaks[1 - axis]
    along = np.unique(np.linspace(ends[:-1], ends[1:], PLACES))
    pair = np.array([np.nextafter(place, -np.inf), place])
    d = surface.grid(pair, along) if axis == 0 else surface.grid(along, pair)
    point, across = (np.diff(x, axis=axis) for x in (d.point, (d.u, d.v)[axis]))
    torn = np.abs(point).max() > JUMP * surface.size
    if torn or np.abs(across).max() > JUMP * np.abs((d.u, d.v)[axis]).max():
        return Crease(axis, place, times, surface.degree[axis], bool(torn))
    return None
