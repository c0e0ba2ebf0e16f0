"""Passes at equal distances from a border, cut by the other border, and their order."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path._geodesic import Field, distance_field, level_sets, refuse_folds
from sdpgrind.finishing.path._nearest import Nearest
from sdpgrind.finishing.path._passes import PathPass, ends_of, joined
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._shock_passes import STEP, TOO_FAR, PassField, shock_passes
from sdpgrind.finishing.path._shocks import FINE, LevelKinks, LevelSets, shocks
from sdpgrind.finishing.path._spacing import ROUNDING
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.path._turns_back import beside
from sdpgrind.finishing.surface._creases import refuse_creases

BEND, PARTS = 0.15, 4  # rad, chosen: turn of a leg of a pitch that needs nodes between; most parts
NEAR = 0.25  # of the least distance of columns, chosen: nearer to an end or a kink of a pass there is no node
SHORT = 0.25  # pitches, chosen: length of a piece that is dropped where gaps were too wide; else one pitch
BESIDE = (-3, -1, 1, 3)  # of that, chosen: nodes beside a kink, as legs of a spline should grow gradually
# pitches ahead of a pass, derived: where one is 0.03 off, or has a kink of a half turn over 0.35 rad, one of
# these places is more than 0.515 pitches from all passes
AMID = (0.485, 0.516)
KINK = 0.3  # rad, chosen: greatest turn between legs of a pass that is no sharp corner


class GeodesicNodes(NamedTuple):
    """Places (n, 2) of (s, c) along all passes, sharp corners (n,), and places of each pass along a shock."""

    places: Floats
    corners: Bools
    shocks: list[Floats]


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


def geodesic_nodes(square: Square, pitch: float, columns: Floats, top: float, radius: float) -> GeodesicNodes:
    """Return passes of equal distance up to c = `top`, and those along shocks where they are needed."""
    refuse_creases(square.surface, "geodesic")  # the metric of a node would not be that of all its triangles
    field = distance_field(square)
    refuse_folds(field, square.along)
    furthest = float(field.distance[:, -1].max())
    count = int(np.ceil(furthest / pitch * (1 - ROUNDING)))
    levels = (np.arange(count - 1) + 0.5) * furthest / count
    rim = Rim(columns, top)
    sets = LevelSets(field, levels)
    places, corners = _laid(square, sets, rim, pitch, radius)
    sharp = _laid(square, sets, rim, pitch, 0.0) if radius else (places, corners)  # arcs leave corners out
    if not _missed(square, field, levels, *sharp, rim, pitch):
        return GeodesicNodes(places, corners, [])
    places, corners = _laid(square, sets.closely(square), rim, pitch, radius)
    line = _sampled(square, places, corners, pitch)
    part = PassField(rim.left, rim.right, rim.top)
    found = shock_passes(square, shocks(square, field, pitch / FINE), [line], part, pitch)
    return GeodesicNodes(places, corners, found)


def _missed(
    square: Square, field: Field, levels: Floats, places: Floats, corners: Bools, rim: Rim, pitch: float
) -> bool:
    """Whether places amid two passes, which lie on `levels`, are too far from them."""
    c = level_sets(field, np.sort((levels[:, None] + pitch * np.array(AMID)).ravel()))
    inside = (field.s >= rim.left) & (field.s <= rim.right)
    s, c = np.broadcast_to(field.s[inside, None], c[inside].shape), c[inside]
    points = square.points(s[c < rim.top], c[c < rim.top])
    distance = Nearest([_sampled(square, places, corners, pitch)]).distance(points)
    return bool(distance.max(initial=0.0) > TOO_FAR * pitch)


def _sampled(square: Square, places: Floats, corners: Bools, pitch: float) -> Floats:
    """Points along passes (n, 3), mm."""
    nodes = square.nodes(*places.T)
    path = Path(square.surface, nodes, mapping=square.mapping, corners=corners, smooth=True)
    return path.sample(STEP * pitch).point


def _laid(square: Square, sets: LevelSets, rim: Rim, pitch: float, radius: float) -> tuple[Floats, Bools]:
    """Places and sharp corners of all level sets there and back."""
    passes, ends = _split(square, sets, rim, pitch)
    if not ends:
        places, corners = joined(square, [*passes, PathPass.straight(rim.columns, rim.top)], radius)
    else:
        places, corners = joined(square, passes, radius) if passes else (np.empty((0, 2)), np.empty(0, bool))
        places, corners = _worked_off(square, places, corners, ends, rim, pitch)
    sharp = _at_kinks(sets, places) if sets.close else _kinks(square, places)
    return places, corners | sharp


def _split(
    square: Square, sets: LevelSets, rim: Rim, pitch: float
) -> tuple[list[PathPass], list[list[PathPass]]]:
    """Whole passes, and the pieces of each level that meets the other border."""
    field, columns = sets.field, rim.columns
    inside = field.s[(field.s > columns[0]) & (field.s < columns[-1])]
    s = np.concatenate([columns[:1], inside, columns[-1:]])
    reach = CubicSpline(field.s, PchipInterpolator(field.c, field.distance, axis=1)(rim.top))(s)
    whole: list[PathPass] = []
    pieces: list[list[PathPass]] = []
    each_level = zip(sets.levels, sets.places.T, sets.kinks, sets.bends.T, sets.ways.T / pitch, strict=True)
    for level, c, found, bend, way in each_level:
        if not pieces and np.all(reach > level):
            nodes = _nodes(_closer(columns, field.s, bend, way), found.between(rim.left, rim.right))
            whole.append(PathPass.curved(nodes, _curve(field.s, c, found)))
        else:
            ends = [each for each in _ends(s, reach - level) if _seen(field.s, c, each)]
            closer = rim._replace(columns=_closer(columns, field.s, bend, way))
            pieces.append([_piece(field.s, c, each, closer, found) for each in ends])
    least = pitch * (SHORT if sets.close else 1.0)
    return whole, [[each for each in level if _length(square, each) > least] for level in pieces]


def _closer(columns: Floats, s: Floats, bend: Floats, way: Floats) -> Floats:
    """Columns, with others between them where a level set bends much.

    At places s (n,) it turns by `bend` (n,), rad, and is `way` (n,) long from the place before, pitches: what
    a leg cuts off grows with its turn and its length.
    """
    turned, length = (np.diff(np.interp(columns, s, np.cumsum(each))) for each in (bend, way))
    parts = np.clip(np.ceil(turned * np.maximum(length, 1.0) / BEND), 1, PARTS).astype(int)
    if parts.max(initial=1) == 1:
        return columns
    ends = zip(columns[:-1], columns[1:], parts, strict=True)
    return np.concatenate([*(np.linspace(a, b, n, endpoint=False) for a, b, n in ends), columns[-1:]])


def _nodes(columns: Floats, found: LevelKinks) -> Floats:
    """Columns, and kinks with nodes beside each instead of the columns that are near."""
    if not found.s.size:
        return columns
    room = NEAR * float(np.diff(columns).min())
    beside = (found.s[:, None] + room * np.array(BESIDE)).ravel()
    beside = beside[(beside > columns[0]) & (beside < columns[-1])]
    beside = beside[np.abs(beside[:, None] - found.s).min(axis=1) > room / 2]
    far = np.abs(columns[1:-1, None] - found.s).min(axis=1) > (BESIDE[-1] + 0.5) * room
    return np.unique(np.concatenate([columns[:1], columns[1:-1][far], columns[-1:], found.s, beside]))


def _curve(s: Floats, c: Floats, found: LevelKinks) -> PPoly:
    """A level set, known in columns s where it is finite: a spline between kinks."""
    known = np.isfinite(c)
    s, c = s[known], c[known]
    if not found.s.size:
        return CubicSpline(s, c)
    near = np.abs(np.searchsorted(s, found.s)[:, None] - 0.5 - np.arange(s.size)) < 1
    away = ~near.any(axis=0)
    s, c = np.append(s[away], found.s), np.append(c[away], found.c)
    order = np.argsort(s)
    s, c = s[order], c[order]
    cuts = [0, *np.searchsorted(s, np.sort(found.s)).tolist(), s.size - 1]
    parts = [CubicSpline(s[a : b + 1], c[a : b + 1]) for a, b in pairwise(cuts) if b > a]
    return PPoly(np.concatenate([each.c for each in parts], axis=1), s)


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


def _piece(s: Floats, c: Floats, ends: tuple[float, float], rim: Rim, found: LevelKinks) -> PathPass:
    """A pass between its ends, of which those within the surface lie on top."""
    low, high = ends
    columns, top = rim.columns, rim.top
    known = np.isfinite(c)
    before = s[known & (s <= low)]
    around = known & (s >= (before[-1] if before.size else low) - 0.05) & (s <= high + 0.05)
    gap = NEAR * np.diff(columns).min()
    nodes = np.concatenate([[low], columns[(columns > low + gap) & (columns < high - gap)], [high]])
    nodes = _nodes(nodes, found.between(low + gap, high - gap))
    places = np.asarray(_curve(s[around], c[around], found.between(s[around][0], s[around][-1]))(nodes))
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
    square: Square,
    places: Floats,
    corners: Bools,
    pieces: Sequence[Sequence[PathPass]],
    rim: Rim,
    pitch: float,
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
    return _without_turn(square, np.concatenate(all_places), np.concatenate(all_corners), len(part), pitch)


def _without_turn(
    square: Square, places: Floats, corners: Bools, last: int, pitch: float
) -> tuple[Floats, Bools]:
    """A path whose `last` places go back on the way on which it came go aside before."""
    at = len(places) - last
    added = beside(square, places[at - 2], places[at - 1], places[at], pitch)
    sharp = corners.copy()
    sharp[at] |= bool(len(added))  # back on the way, at an angle
    return np.insert(places, at, added, axis=0), np.insert(sharp, at, np.ones(len(added), bool))


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


def _at_kinks(sets: LevelSets, places: Floats) -> Bools:
    """Which places are kinks that turn by more than `KINK`."""
    return np.isin(places[:, 0], np.concatenate([each.s[2 * each.half > KINK] for each in sets.kinks]))


def _kinks(square: Square, places: Floats) -> Bools:
    """Where legs turn on the surface by more than `KINK`."""
    by_s, by_c = square.tangents(places[1:-1, 0], places[1:-1, 1])
    step = np.diff(places, axis=0)
    before, after = (leg[:, :1] * by_s + leg[:, 1:] * by_c for leg in (step[:-1], step[1:]))
    cosine = np.einsum("ij,ij->i", before, after)
    sine = np.linalg.norm(np.cross(before, after), axis=1)
    return np.concatenate([[False], np.arctan2(sine, cosine) > KINK, [False]])
