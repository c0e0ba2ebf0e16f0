"""Trimming polygons: checks, and what is inside."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.surface._polygon_kernels import even_odd, first_crossing

Ints = npt.NDArray[np.intp]

OPEN = 1e-3  # of the domain; source: specification, a greater gap leaves a loop open
BEYOND = 1e-6  # of the domain, chosen: rounding of a polygon on the domain's edge
FLAT = 1e-12  # of the domain's area, chosen: a polygon without area


def closed(name: str, value: Any, domain: Floats) -> Floats:
    """Return a polygon (n, 2) in a domain [[u0, u1], [v0, v1]], its last place its first, read-only."""
    places = np.array(checks.finite_array(name, value))
    if places.ndim != 2 or places.shape[1] != 2 or len(places) < 4:
        raise checks.refuse(name, "of shape (n, 2), n >= 4, its last place its first", places.shape)
    low, high = domain[:, 0], domain[:, 1]
    widths = high - low
    gap = float(np.abs((places[-1] - places[0]) / widths).max())
    if gap > OPEN:
        rule = f"closed: its last place its first, within {OPEN:g} of the domain"
        raise checks.refuse(name, rule, f"a gap of {gap:.3g}")
    places[-1] = places[0]
    out = (places < low - BEYOND * widths) | (places > high + BEYOND * widths)
    if out.any():
        k = int(np.flatnonzero(out.any(axis=1))[0])
        raise checks.refuse(f"{name}[{k}]", "in the surface's domain", tuple(places[k].tolist()))
    places = np.clip(places, low, high)
    places = places[np.append(True, (np.diff(places, axis=0) != 0).any(axis=1))]
    if len(places) < 4 or abs(signed_area(places)) <= FLAT * float(np.prod(widths)):
        raise checks.refuse(name, "a polygon with an area", f"{len(places) - 1} sides without")
    return lasting(places)


def signed_area(places: Floats) -> float:
    """Return the area of a closed polygon, > 0 counter-clockwise."""
    u, v = (places - places[0]).T
    return float(0.5 * np.sum(u[:-1] * v[1:] - u[1:] * v[:-1]))


def sides(polygons: Sequence[Floats]) -> Floats:
    """Return starts and ends (n, 4) of the sides of all polygons."""
    if not polygons:
        return np.empty((0, 4))
    return np.concatenate([np.hstack([each[:-1], each[1:]]) for each in polygons])


class Bands(NamedTuple):
    """Sides (n, 4) by n bands of v from `low` to `high`: numbers band by band, and where each begins."""

    sides: Floats
    band: Ints
    begin: Ints
    low: float
    high: float
    width: float


def banded(polygons: Sequence[Floats]) -> Bands:
    """Return the sides of polygons by bands of v, so that a place meets those of its own band alone."""
    every = sides(polygons)
    ends = np.sort(every[:, 1::2], axis=1)
    low, high = float(ends.min()), float(ends.max())
    width = (high - low) / len(every)
    first, last = ((ends - low) / width).astype(np.intp).T
    number = np.repeat(np.arange(len(every)), last - first + 1)
    before = np.cumsum(last - first + 1) - (last - first + 1)
    at = first[number] + np.arange(number.size) - before[number]
    begin = np.searchsorted(np.sort(at), np.arange(at.max() + 2))
    return Bands(every, number[np.argsort(at, kind="stable")], begin, low, high, width)


def inside(bands: Bands, places: Floats) -> Bools:
    """Return which places (m, 2) are inside by the rule of even and odd."""
    out = np.empty(len(places), dtype=bool)
    even_odd(*bands, np.ascontiguousarray(places), out)
    return out


def ordered(polygons: Sequence[Floats]) -> tuple[Floats, ...]:
    """Return the outer polygon, if there is one, and the holes, checked against one another."""
    for k, each in enumerate(polygons):
        _refuse_crossing(f"trim[{k}]", each, "itself", each, same=True)
        for j, other in enumerate(polygons[:k]):
            _refuse_crossing(f"trim[{k}]", each, f"trim[{j}]", other, same=False)
    outer = [k for k, each in enumerate(polygons) if signed_area(each) > 0]
    if len(outer) > 1:
        rule = f"clockwise, as a hole is: trim[{outer[0]}] is the outer one"
        raise checks.refuse(f"trim[{outer[1]}]", rule, "a counter-clockwise polygon")
    holes = [k for k in range(len(polygons)) if k not in outer]
    for k in holes:
        _refuse_hole(polygons, k, outer, [j for j in holes if j != k])
    return tuple(polygons[k] for k in (*outer, *holes))


def _refuse_hole(polygons: Sequence[Floats], k: int, outer: list[int], others: list[int]) -> None:
    """Raise for a hole outside of the outer polygon, or in another hole."""
    middles = (polygons[k][1:] + polygons[k][:-1]) / 2
    for j in outer:
        if np.mean(inside(banded([polygons[j]]), middles)) < 0.5:
            raise checks.refuse(f"trim[{k}]", f"inside of trim[{j}]", "a hole outside")
    for j in others:
        if np.mean(inside(banded([polygons[j]]), middles)) > 0.5:
            raise checks.refuse(f"trim[{k}]", f"outside of trim[{j}]", "a hole in a hole")


def _refuse_crossing(name: str, one: Floats, whom: str, other: Floats, same: bool) -> None:
    found = first_crossing(sides([one]), sides([other]), same)
    if found >= 0:
        i, j = divmod(found, len(other) - 1)
        u, v = one[i]
        raise ValueError(
            f"{name} must not cross {whom}; its side {i}, from ({u:.6g}, {v:.6g}), crosses side {j}"
        )
