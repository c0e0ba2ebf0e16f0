"""Passes at equal distances from a border, cut by the other border, and their order."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path._geodesic import Field, distance_field, level_sets, refuse_folds
from sdpgrind.finishing.path._passes import PathPass, ends_of, joined
from sdpgrind.finishing.path._spacing import ROUNDING
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.surface._creases import refuse_creases

KINK = 0.3  # rad, chosen: greatest turn between legs of a pass that is no sharp corner


class Rim(NamedTuple):
    """Edge on which passes end: up the side s = `left` to c = `top`, along it, down the side s = `right`.

    Places on it are numbers from 0 to 3: 1 and 2 are its corners.
    """

    columns: Floats
    top: float

    @property
    def left(self) -> float:
        """Side at its start."""
        return float(self.columns[0])

    @property
    def right(self) -> float:
        """Side at its end."""
        return float(self.columns[-1])

    def number(self, s: float, c: float) -> float:
        """Return the number of a place on it."""
        if c >= self.top:
            return 1 + (s - self.left) / (self.right - self.left)
        return c / self.top if s <= self.left else 3 - c / self.top

    def between(self, start: float, end: float) -> tuple[Floats, Bools]:
        """Return the places (n, 2) of (s, c) on the way without its ends, and which are its sharp corners."""
        stations = 1 + (self.columns - self.left) / (self.right - self.left)
        low, high = min(start, end), max(start, end)
        inside = (stations > low + 1e-9) & (stations < high - 1e-9)
        places = np.stack([self.columns, np.full(self.columns.size, self.top)], axis=1)[inside]
        corners = ((self.columns == self.left) | (self.columns == self.right))[inside]
        return (places, corners) if end > start else (places[::-1], corners[::-1])


def geodesic_nodes(
    square: Square, pitch: float, columns: Floats, top: float, radius: float
) -> tuple[Floats, Bools]:
    """Return places (n, 2) of (s, c) along passes of equal distance up to c = `top`, and sharp corners."""
    refuse_creases(square.surface, "geodesic")  # the metric of a node would not be that of all its triangles
    field = distance_field(square)
    refuse_folds(field, square.along)
    furthest = float(field.distance[:, -1].max())
    count = int(np.ceil(furthest / pitch * (1 - ROUNDING)))
    levels = (np.arange(count - 1) + 0.5) * furthest / count
    passes, ends = _split(square, field, levels, columns, top, pitch)
    rim = Rim(columns, top)
    if not ends:
        places, corners = joined(square, [*passes, PathPass.straight(columns, top)], radius)
    else:
        places, corners = joined(square, passes, radius) if passes else (np.empty((0, 2)), np.empty(0, bool))
        places, corners = _worked_off(places, corners, ends, rim)
    return places, corners | _kinks(square, places)


def _split(
    square: Square, field: Field, levels: Floats, columns: Floats, top: float, pitch: float
) -> tuple[list[PathPass], list[list[PathPass]]]:
    """Whole passes, and the pieces of each level that meets the other border."""
    inside = field.s[(field.s > columns[0]) & (field.s < columns[-1])]
    s = np.concatenate([columns[:1], inside, columns[-1:]])
    reach = CubicSpline(field.s, [float(PchipInterpolator(field.c, row)(top)) for row in field.distance])(s)
    whole: list[PathPass] = []
    pieces: list[list[PathPass]] = []
    for level, c in zip(levels, level_sets(field, levels).T, strict=True):
        if not pieces and np.all(reach > level):
            whole.append(PathPass.curved(columns, _curve(field.s, c)))
        else:
            ends = [each for each in _ends(s, reach - level) if _seen(field.s, c, each)]
            pieces.append([_piece(field.s, c, each, columns, top) for each in ends])
    return whole, [[each for each in level if _length(square, each) > pitch] for level in pieces]


def _curve(s: Floats, c: Floats) -> CubicSpline:
    known = np.isfinite(c)
    return CubicSpline(s[known], c[known])


def _ends(s: Floats, above: Floats) -> list[tuple[float, float]]:
    """Start and end of each stretch of `s` with a function above 0."""
    over = np.concatenate([[False], above > 0, [False]])
    first, last = np.flatnonzero(over[1:] & ~over[:-1]), np.flatnonzero(~over[1:] & over[:-1]) - 1
    pairs = zip(first.tolist(), last.tolist(), strict=True)
    return [(_crossing(s, above, a, a - 1), _crossing(s, above, b, b + 1)) for a, b in pairs]


def _crossing(s: Floats, above: Floats, inside: int, outside: int) -> float:
    """Zero of the function between two neighbours; the end of `s` without a neighbour."""
    if not 0 <= outside < s.size:
        return float(s[inside])
    share = above[inside] / (above[inside] - above[outside])
    return float(s[inside] + share * (s[outside] - s[inside]))


def _seen(s: Floats, c: Floats, ends: tuple[float, float]) -> bool:
    """Whether a level has two columns of the field between its ends; shorter pieces are dropped."""
    return bool(np.count_nonzero(np.isfinite(c) & (s >= ends[0]) & (s <= ends[1])) >= 2)


def _piece(s: Floats, c: Floats, ends: tuple[float, float], columns: Floats, top: float) -> PathPass:
    """A pass between its ends, of which those within the surface lie on top."""
    low, high = ends
    known = np.isfinite(c)
    before = s[known & (s <= low)]
    around = known & (s >= (before[-1] if before.size else low) - 0.05) & (s <= high + 0.05)
    gap = 0.25 * np.diff(columns).min()
    nodes = np.concatenate([[low], columns[(columns > low + gap) & (columns < high - gap)], [high]])
    places = np.asarray(_curve(s[around], c[around])(nodes))
    on_top = np.array([low > columns[0], high < columns[-1]])
    places[[0, -1]] = np.where(on_top, top, places[[0, -1]])
    return PathPass(nodes, places)


def _length(square: Square, each: PathPass) -> float:
    """Length of a pass, roughly, mm."""
    middle = (each.s[1:] + each.s[:-1]) / 2, (each.c[1:] + each.c[:-1]) / 2
    by_s, by_c = square.tangents(*middle)
    legs = np.diff(each.s)[:, None] * by_s + np.diff(each.c)[:, None] * by_c
    return float(np.linalg.norm(legs, axis=1).sum())


def _worked_off(
    places: Floats, corners: Bools, pieces: Sequence[Sequence[PathPass]], rim: Rim
) -> tuple[Floats, Bools]:
    """Whole passes, then pieces column by column by way of the rim, then a pass along its top."""
    all_places, all_corners = [places], [corners]
    here = rim.number(*places[-1]) if len(places) else 0.0
    for each in _in_order(pieces, 0, -np.inf, np.inf):
        run = np.stack([each.s, each.c], axis=1)
        start, end = (rim.number(*run[k]) for k in (0, -1))
        if abs(here - end) < abs(here - start):
            run, start, end = run[::-1], end, start
        for part, sharp in (rim.between(here, start), (run, ends_of(len(run)))):
            all_places.append(part)
            all_corners.append(sharp)
        here = end
    for start, end in ((here, 1 + (here > 1.5)), (1 + (here > 1.5), 2 - (here > 1.5))):
        part, sharp = rim.between(start, end + np.sign(end - start) * 1e-6)
        all_places.append(part)
        all_corners.append(sharp)
    return np.concatenate(all_places), np.concatenate(all_corners)


def _in_order(
    pieces: Sequence[Sequence[PathPass]], level: int, low: float, high: float
) -> Iterator[PathPass]:
    """Each piece, then those beyond it, before the next one of its level."""
    if level == len(pieces):
        return
    for each in pieces[level]:
        if low <= each.s[0] and each.s[-1] <= high:
            yield each
            yield from _in_order(pieces, level + 1, float(each.s[0]), float(each.s[-1]))


def _kinks(square: Square, places: Floats) -> Bools:
    """Where legs turn on the surface by more than `KINK`."""
    by_s, by_c = square.tangents(places[1:-1, 0], places[1:-1, 1])
    step = np.diff(places, axis=0)
    before, after = (leg[:, :1] * by_s + leg[:, 1:] * by_c for leg in (step[:-1], step[1:]))
    cosine = np.einsum("ij,ij->i", before, after)
    sine = np.linalg.norm(np.cross(before, after), axis=1)
    return np.concatenate([[False], np.arctan2(sine, cosine) > KINK, [False]])
