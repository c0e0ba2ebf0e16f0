"""Passes and curves cut at the trimming of a patch."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.halving import halved
from sdpgrind.finishing.path._bends import LineStretch, PassBend, bends
from sdpgrind.finishing.path._mappings import Mapping, mapping_of
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.surface._outline import Outline
from sdpgrind.finishing.surface._patch import Patch

STEP = 0.02  # mm, chosen: places on a line where its crossings are sought; a narrower slot may be missed
MOST = 8192  # chosen: such places on a line
HALVINGS = 30  # derived: 2^-30 of a step of at most 1/16 of the square is below 1e-10
STEPS = 6  # chosen: corrections of a length along a line
DRAWS = 8  # chosen: attempts to draw ends back until a move between them keeps away
SLACK = 1e-6  # mm, chosen: rounding of ends at the margin, between which a move along the edge stays there
CROWDED = 0.5  # of the distance of nodes, chosen: nearer to the end of a pass there is no other node
# pitches, chosen: sqrt(3^2 - 1) of such a move lead along a pass that covers their strip, too; measured: of
# 1055 moves beside edges at all angles 99 in 100 are shorter than 2.6, and six longer, up to 11
LONGEST = 3.0
BACK = 0.03  # chosen: sine of the angle between a bend and a move along it
CHORDS = 8  # chosen: chords of a move whose length is found; over a quarter of a circle 0.2 % are missing
STRAIGHT = np.empty((0, 2))
_GAUSS, _WEIGHTS = np.array(np.polynomial.legendre.leggauss(8)) / 2  # chosen: places of a mean speed


class Span(NamedTuple):
    """Part of a pass inside: line and its place across, ends along it, nodes (n, 2) of its bends."""

    line: int
    c: float
    low: float
    high: float
    bends: Floats = STRAIGHT

    def at(self, s: float) -> Floats:
        """Place (2,) on it."""
        c = np.interp(s, *self.bends.T) if len(self.bends) else self.c
        return np.array([s, float(c)])

    def end(self, ahead: bool) -> float:
        """The upper end of a part that is passed `ahead`, else the lower one."""
        return self.high if ahead else self.low

    @property
    def inner(self) -> Floats:
        """Nodes (n, 2) of its bends between its ends."""
        return self.bends[(self.bends[:, 0] > self.low) & (self.bends[:, 0] < self.high)]


class _LinePart(NamedTuple):
    """Part of a line inside, its ends pulled in, and whether two bends may start on it."""

    low: float
    high: float
    start: float
    end: float
    long: bool


class TrimmedSquare:
    """The unit square of a patch with its passes; what is inside the trimming and `away` from it, mm.

    Passes end `pull` (mm along them) before that.
    """

    def __init__(self, patch: Patch, square: Square, away: float = 0.0, pull: float = 0.0) -> None:
        self._patch, self._square = patch, square
        self._mapping: Mapping = mapping_of(square.mapping, patch.surface)
        self._away, self._pull = away, pull
        self._outline = Outline(patch) if away or patch.trim else None

    def inside(self, nodes: Floats, more: float = 0.0) -> Bools:
        """Return which places (m, 2) of the unit square are inside and away, by `more` mm than asked for."""
        u, v = self._carried(nodes)
        inside = self._patch.contains(u, v)
        if self._outline is not None and self._away + more > 0.0:
            inside[inside] = self._outline.clear(
                self._patch.surface.point(u[inside], v[inside]), self._away + more
            )
        return inside

    def _carried(self, nodes: Floats) -> Floats:
        """Parameters (2, m) of places (m, 2) of the unit square."""
        jets = np.zeros((len(nodes), 3, 2))
        jets[:, 0], jets[:, 1, 0] = nodes, 1.0
        return np.ascontiguousarray(self._mapping.carried(jets)[:, 0].T)

    def holds(self, s: Floats, c: Floats, more: float) -> Bools:
        """Return which places in the square are inside and away, by `more` mm than asked for."""
        out: Bools = (s >= 0.0) & (s <= 1.0) & (c >= 0.0) & (c <= 1.0)
        out[out] = self.inside(self._square.nodes(s[out], c[out]), more)
        return out

    def _on(self, s: Floats, c: Floats) -> Bools:
        return self.inside(self._square.nodes(s, c))

    def speed(self, s: Floats, c: Floats) -> Floats:
        """Return the length a unit of s along lines, mm."""
        return np.asarray(np.linalg.norm(self._square.along_passes(s, c), axis=-1))

    def speed_across(self, s: Floats, c: Floats) -> Floats:
        """Return the distance from lines a unit of c, mm."""
        by_s, by_c = self._square.tangents(s, c)
        along = (by_s * by_c).sum(axis=-1) / (by_s * by_s).sum(axis=-1)
        return np.asarray(np.linalg.norm(by_c - along[:, None] * by_s, axis=-1))

    def spans(self, lines: Floats, pitch: float) -> list[list[Span]]:
        """Return the parts of each line (n,) inside: pulled in, or with bends along the trimming."""
        parts = self._parts(lines, pitch)
        stretches = [_outside(*each) for each in zip(lines.tolist(), parts, strict=True)]
        asked = [each for row in stretches for each in row] if self._patch.trim else []
        found = iter(bends(self, asked, pitch, self._away))
        beside = [[next(found, []) for _ in row] for row in stretches]
        each = zip(range(len(lines)), lines.tolist(), parts, beside, strict=True)
        return [_laid(*line) for line in each]

    def _parts(self, lines: Floats, pitch: float) -> list[list[_LinePart]]:
        """The parts of each line inside, without those that are shorter, pulled in, than the margins."""
        changes = [self._changes(c) for c in lines.tolist()]
        line = np.repeat(np.arange(len(lines)), [start.size for start, _, _ in changes])
        before, behind, first = (np.concatenate(each) for each in zip(*changes, strict=True))
        low, high = self._crossings(before, behind, first, lines[line]).reshape(-1, 2).T
        line = line[::2]
        c = lines[line]
        start, end = self.drawn(low, self._pull, c, 1.0), self.drawn(high, self._pull, c, -1.0)
        wide = (end - start) * self.speed((start + end) / 2, c) > self._away + self._pull
        long = (high - low) * self.speed((low + high) / 2, c) > pitch / 2
        columns = (each.tolist() for each in (low, high, start, end, long))
        each = [_LinePart(*row) for row in zip(*columns, strict=True)]
        return [[each[k] for k in np.flatnonzero(wide & (line == n))] for n in range(len(lines))]

    def _changes(self, c: float) -> tuple[Floats, Floats, Bools]:
        """Places along a line between which it crosses the trimming; whether the first is inside."""
        s = np.linspace(0.0, 1.0, 129)
        longest = float(self.speed(s, np.array(c)).mean())
        s = np.linspace(0.0, 1.0, int(np.clip(np.ceil(longest / STEP), 16, MOST)) + 1)
        inside = self._on(s, np.full(s.shape, c))
        inside[[0, -1]] = False  # a pass keeps away from the border, too
        turns = np.flatnonzero(inside[1:] != inside[:-1])
        return s[turns], s[turns + 1], inside[turns]

    def _crossings(self, low: Floats, high: Floats, first: Bools, c: Floats) -> Floats:
        """Places between `low` and `high` where lines cross the trimming, by bisection."""
        return halved(low, high, lambda middle: np.asarray(self._on(middle, c) == first), HALVINGS)

    def drawn(self, s: Floats, length: float | Floats, c: Floats, way: float) -> Floats:
        """Places a length (mm) along lines at c from places s."""
        out = s + way * length / self.speed(s, c)
        for _ in range(STEPS):
            places = np.clip(s[:, None] + (out - s)[:, None] * (0.5 + _GAUSS), 0.0, 1.0)
            out = s + way * length / (self.speed(places, c[:, None]) @ _WEIGHTS)
        return out

    def clear(self, start: Floats, end: Floats) -> bool:
        """Whether a straight move in the square (s, c) from start to end stays inside."""
        by_s, by_c = self._square.tangents(start[:1], start[1:])
        way = np.linalg.norm(by_s[0] * (end[0] - start[0]) + by_c[0] * (end[1] - start[1]))
        share = np.linspace(0.0, 1.0, int(np.clip(np.ceil(way / STEP), 8, MOST)) + 1)[1:-1, None]
        places = start + share * (end - start)  # the ends are inside, up to rounding
        return bool(self.inside(self._square.nodes(*places.T), -SLACK).all())

    def way(self, start: Floats, end: Floats) -> float:
        """Return the length of a straight move in the square from start to end, mm."""
        places = self._square.nodes(*np.linspace(start, end, CHORDS + 1).T)
        points = self._patch.surface.point(*self._carried(places))
        return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _outside(c: float, parts: list[_LinePart]) -> list[LineStretch]:
    """Stretches of a line before, between and behind its parts."""
    sides = [0.0, *(end for part in parts for end in part[:2]), 1.0]
    long = [False, *(part.long for part in parts), False]
    return [LineStretch(c, *each) for each in zip(sides[::2], sides[1::2], long[:-1], long[1:], strict=True)]


def _laid(line: int, c: float, parts: list[_LinePart], beside: list[list[PassBend]]) -> list[Span]:
    """Parts of a pass: those of its line with the bends `beside` the stretches between them."""
    spans: list[Span] = []
    low, bent = 0.0, list[Floats]()  # of the part that is being laid
    for k, found in enumerate(beside):
        if k and not any(each.after for each in found):
            spans.append(Span(line, c, low, parts[k - 1].end, _nodes(bent)))
        for each in found:
            bent, low = (bent, low) if each.after else ([], float(each.nodes[0, 0]))
            bent.append(each.nodes)
            if not each.before:
                spans.append(Span(line, c, low, float(each.nodes[-1, 0]), _nodes(bent)))
        if k < len(parts) and not any(each.before for each in found):
            low, bent = parts[k].start, []
    return spans


def trimmed_passes(
    region: TrimmedSquare, lines: Floats, columns: Floats, pitch: float, longest: float = np.inf
) -> list[Floats]:
    """Return the pieces of a zigzag: places (n, 2) of (s, c) each.

    A piece goes on to the next line where a straight move to the nearer end of a part of it stays inside and
    is no longer than `longest` (mm); both ends are drawn back by up to half a pitch (mm) for that, as around
    a hole a straight move cuts the corner.
    """
    rest = region.spans(lines, pitch)
    pieces = []
    while any(rest):
        chain = _chain(region, rest, pitch, longest)
        forward = [k % 2 == 0 for k in range(len(chain))]
        places = [
            _along(span, columns)[:: 1 if ahead else -1] for span, ahead in zip(chain, forward, strict=True)
        ]
        pieces.append(np.concatenate(places))
    return pieces


def _chain(region: TrimmedSquare, rest: list[list[Span]], pitch: float, longest: float) -> list[Span]:
    """Take parts of following lines from the rest, as long as they can be joined on the work."""
    first = next(k for k, spans in enumerate(rest) if spans)
    chain = [rest[first].pop(0)]
    while (line := chain[-1].line + 1) < len(rest):
        for other in _beside(chain[-1], rest[line], len(chain) % 2 == 1):
            pair = _joined(region, (chain[-1], other), len(chain) % 2 == 1, pitch, longest)
            if pair:
                rest[line].remove(other)
                chain[-1:] = pair
                break
        else:
            break
    return chain


def _beside(here: Span, others: list[Span], ahead: bool) -> list[Span]:
    """Parts of the next line beside `here`, that whose end is nearest first."""
    beside = [each for each in others if each.low < here.high and each.high > here.low]
    return sorted(beside, key=lambda each: abs(each.end(ahead) - here.end(ahead)))


def _joined(
    region: TrimmedSquare, pair: tuple[Span, Span], ahead: bool, pitch: float, longest: float
) -> tuple[Span, Span] | None:
    """Both parts with ends that a straight move joins on the work, at most `longest`; None: none is found."""
    for one, other in _drawn_back(region, pair, ahead, pitch):
        if min(one.high - one.low, other.high - other.low) <= 0.0:
            return None
        start, end = (each.at(each.end(ahead)) for each in (one, other))
        if region.way(start, end) <= longest and region.clear(start, end):
            first = _unfolded(region, one, ahead, end - start)
            last = _unfolded(region, other, ahead, start - end)
            return None if first is None or last is None else (first, last)
    return None


def _unfolded(region: TrimmedSquare, span: Span, ahead: bool, move: Floats) -> Span | None:
    """The part without a bend along the move at its end, which would turn right back; None: it must."""
    nodes = _at_end(span, ahead)
    if _turns_back(nodes[-1] - nodes[-2], move):
        return _straightened(region, span, nodes, ahead)
    return span


def _turns_back(one: Floats, other: Floats) -> bool:
    across = abs(one[0] * other[1] - one[1] * other[0])
    return bool(one @ other < 0 and across < BACK * np.hypot(*one) * np.hypot(*other))


def _at_end(span: Span, ahead: bool) -> Floats:
    """The last bend of a part, or all of it, and its end."""
    nodes = np.stack([span.at(s) for s in (span.low, *span.inner[:, 0], span.high)])[:: 1 if ahead else -1]
    line = np.flatnonzero(nodes[:-1, 1] == span.c)
    return nodes[line[-1] if line.size else 0 :]


def _straightened(region: TrimmedSquare, span: Span, bend: Floats, ahead: bool) -> Span | None:
    """The part with a straight leg from its line to the end of a bend, twice as long as that."""
    foot = np.array([2 * bend[0, 0] - bend[-1, 0], span.c])
    inside = span.bends[span.bends[:, 0] < foot[0]] if ahead else span.bends[span.bends[:, 0] > foot[0]]
    last = inside[-1 if ahead else 0] if len(inside) else np.array([span.low if ahead else span.high, span.c])
    fits = bend[0, 1] == span.c == last[1] and (foot[0] > last[0]) == ahead
    if not fits or not region.clear(foot, bend[-1]):
        return None
    parts = [inside, [foot, bend[-1]]] if ahead else [[bend[-1], foot], inside]
    return span._replace(bends=np.concatenate(parts))


def _drawn_back(
    region: TrimmedSquare, pair: tuple[Span, Span], ahead: bool, pitch: float
) -> Iterator[tuple[Span, Span]]:
    """Both parts as they are, then with their ends drawn back, each time farther: up to half a pitch."""
    yield pair
    back = pitch / 2 * (np.arange(1, DRAWS + 1) / DRAWS) ** 2
    s, c = np.repeat([(each.end(ahead), each.c) for each in pair], DRAWS, axis=0).T
    drawn = region.drawn(s, np.tile(back, 2), c, -1.0 if ahead else 1.0)
    for one, other in drawn.reshape(2, DRAWS).T.tolist():
        yield _ended(pair[0], ahead, one), _ended(pair[1], ahead, other)


def _ended(span: Span, ahead: bool, end: float) -> Span:
    return span._replace(high=end) if ahead else span._replace(low=end)


def _along(span: Span, columns: Floats) -> Floats:
    """Nodes (n, 2) of a part of a pass: its ends, its bends, and the columns between them."""
    room = CROWDED * float(np.diff(columns).min()) if columns.size > 1 else 0.0
    taken = np.concatenate([[span.low], span.inner[:, 0], [span.high]])
    after = np.clip(np.searchsorted(taken, columns), 1, taken.size - 1)
    inner = columns[(columns > taken[after - 1] + room) & (columns < taken[after] - room)]
    s = np.sort(np.concatenate([taken, inner]))
    return np.stack([span.at(each) for each in s])


def _nodes(parts: list[Floats]) -> Floats:
    return np.concatenate(parts) if parts else STRAIGHT
