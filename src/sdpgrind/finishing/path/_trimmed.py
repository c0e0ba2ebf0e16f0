"""Passes and curves cut at the trimming of a patch."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Bools, Floats
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

    def speed(self, s: Floats, c: float) -> Floats:
        """Return the length a unit of s along a line, mm."""
        return np.asarray(np.linalg.norm(self._square.along_passes(s, np.full(s.shape, c)), axis=-1))

    def speed_across(self, s: Floats, c: float) -> Floats:
        """Return the distance from a line a unit of c, mm."""
        by_s, by_c = self._square.tangents(s, np.full(s.shape, c))
        along = (by_s * by_c).sum(axis=-1) / (by_s * by_s).sum(axis=-1)
        return np.asarray(np.linalg.norm(by_c - along[:, None] * by_s, axis=-1))

    def spans(self, lines: Floats, pitch: float) -> list[list[Span]]:
        """Return the parts of each line (n,) inside: pulled in, or with bends along the trimming."""
        changes = [self._changes(c) for c in lines]
        c = np.repeat(lines, [start.size for start, _, _ in changes])
        low, high, first = (np.concatenate(each) for each in zip(*changes, strict=True))
        places = self._crossings(low, high, first, c)
        ends = np.cumsum([0] + [start.size for start, _, _ in changes])
        return [
            self._bent(k, float(c), places[a:b].reshape(-1, 2), pitch)
            for k, (c, a, b) in enumerate(zip(lines, ends, ends[1:], strict=False))
        ]

    def _bent(self, line: int, c: float, places: Floats, pitch: float) -> list[Span]:
        """Parts of a line at c that crosses the trimming at places (n, 2)."""
        parts = [(low, high) for low, high in places.tolist() if self._wide(low, high, c)]
        sides = [0.0, *(end for part in parts for end in part), 1.0]
        spans: list[Span] = []
        low, bent = 0.0, list[Floats]()  # of the part that is being laid
        for k, (start, stop) in enumerate(zip(sides[::2], sides[1::2], strict=True)):
            long = [0 <= n < len(parts) and self._holds_bend(parts[n], c, pitch) for n in (k - 1, k)]
            beside = self._bends(c, LineStretch(start, stop, *long), pitch)
            if k and not any(each.after for each in beside):
                spans.append(Span(line, c, low, self.drawn(start, self._pull, c, -1.0), _nodes(bent)))
            for each in beside:
                bent, low = (bent, low) if each.after else ([], float(each.nodes[0, 0]))
                bent.append(each.nodes)
                if not each.before:
                    spans.append(Span(line, c, low, float(each.nodes[-1, 0]), _nodes(bent)))
            if not any(each.before for each in beside):
                low, bent = self.drawn(stop, self._pull, c, 1.0), []
        return spans

    def _bends(self, c: float, stretch: LineStretch, pitch: float) -> list[PassBend]:
        return bends(self, c, stretch, pitch, self._away) if self._patch.trim else []

    def _holds_bend(self, part: tuple[float, float], c: float, pitch: float) -> bool:
        """Whether a part of a line is long enough for the starts of two bends."""
        pace = float(self.speed(np.array([sum(part) / 2]), c)[0])
        return (part[1] - part[0]) * pace > pitch / 2

    def _changes(self, c: float) -> tuple[Floats, Floats, Bools]:
        """Places along a line between which it crosses the trimming; whether the first is inside."""
        s = np.linspace(0.0, 1.0, 129)
        longest = float(self.speed(s, c).mean())
        s = np.linspace(0.0, 1.0, int(np.clip(np.ceil(longest / STEP), 16, MOST)) + 1)
        inside = self._on(s, np.full(s.shape, c))
        inside[[0, -1]] = False  # a pass keeps away from the border, too
        turns = np.flatnonzero(inside[1:] != inside[:-1])
        return s[turns], s[turns + 1], inside[turns]

    def _crossings(self, low: Floats, high: Floats, first: Bools, c: Floats) -> Floats:
        """Places between `low` and `high` where lines cross the trimming, by bisection."""
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            same = self._on(middle, c) == first
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        return (low + high) / 2

    def drawn(self, s: float, length: float, c: float, way: float) -> float:
        """Place a length (mm) along a line from s."""
        x, weight = np.polynomial.legendre.leggauss(8)
        out = s + way * length / float(self.speed(np.array([s]), c)[0])
        for _ in range(STEPS):
            places = np.clip(s + (out - s) * (1 + x) / 2, 0.0, 1.0)
            mean = float(weight @ self.speed(places, c)) / 2
            out = s + way * length / mean
        return out

    def _wide(self, low: float, high: float, c: float) -> bool:
        """Whether a part, pulled in, is longer than the margins: shorter ones are no passes."""
        low, high = self.drawn(low, self._pull, c, 1.0), self.drawn(high, self._pull, c, -1.0)
        middle = self.speed(np.array([(low + high) / 2]), c)
        return bool((high - low) * middle[0] > self._away + self._pull)

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
    return sorted(beside, key=lambda each: abs(_end(each, ahead) - _end(here, ahead)))


def _end(span: Span, ahead: bool) -> float:
    return span.high if ahead else span.low


def _joined(
    region: TrimmedSquare, pair: tuple[Span, Span], ahead: bool, pitch: float, longest: float
) -> tuple[Span, Span] | None:
    """Both parts with ends that a straight move joins on the work, at most `longest`; None: none is found."""
    for k in range(DRAWS + 1):
        back = pitch / 2 * (k / DRAWS) ** 2
        one, other = (_drawn_back(region, each, ahead, back) for each in pair)
        if min(one.high - one.low, other.high - other.low) <= 0.0:
            return None
        start, end = (each.at(_end(each, ahead)) for each in (one, other))
        if region.way(start, end) <= longest and region.clear(start, end):
            return _unfolded(region, one, other, ahead)
    return None


def _unfolded(region: TrimmedSquare, one: Span, other: Span, ahead: bool) -> tuple[Span, Span] | None:
    """Both parts without a bend along the move between them, which would turn right back; None if it must."""
    start, end = (each.at(_end(each, ahead)) for each in (one, other))
    pair = []
    for span, move in ((one, end - start), (other, start - end)):
        nodes = _at_end(span, ahead)
        if _turns_back(nodes[-1] - nodes[-2], move):
            straight = _straightened(region, span, nodes, ahead)
            if straight is None:
                return None
            pair.append(straight)
        else:
            pair.append(span)
    return pair[0], pair[1]


def _turns_back(one: Floats, other: Floats) -> bool:
    across = abs(one[0] * other[1] - one[1] * other[0])
    return bool(one @ other < 0 and across < BACK * np.hypot(*one) * np.hypot(*other))


def _at_end(span: Span, ahead: bool) -> Floats:
    """The last bend of a part, or all of it, and its end."""
    low, high = span.low, span.high
    own = span.bends[(span.bends[:, 0] > low) & (span.bends[:, 0] < high)]
    nodes = np.stack([span.at(s) for s in (low, *own[:, 0], high)])[:: 1 if ahead else -1]
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


def _drawn_back(region: TrimmedSquare, span: Span, ahead: bool, back: float) -> Span:
    if not back:
        return span
    end = region.drawn(_end(span, ahead), back, span.c, -1.0 if ahead else 1.0)
    return span._replace(high=end) if ahead else span._replace(low=end)


def _along(span: Span, columns: Floats) -> Floats:
    """Nodes (n, 2) of a part of a pass: its ends, its bends, and the columns between them."""
    room = CROWDED * float(np.diff(columns).min()) if columns.size > 1 else 0.0
    own = span.bends[(span.bends[:, 0] > span.low) & (span.bends[:, 0] < span.high)]
    taken = np.concatenate([[span.low], own[:, 0], [span.high]])
    after = np.clip(np.searchsorted(taken, columns), 1, taken.size - 1)
    inner = columns[(columns > taken[after - 1] + room) & (columns < taken[after] - room)]
    s = np.sort(np.concatenate([taken, inner]))
    return np.stack([span.at(each) for each in s])


def _nodes(parts: list[Floats]) -> Floats:
    return np.concatenate(parts) if parts else STRAIGHT
