"""Passes and curves cut at the trimming of a patch."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Bools, Floats
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


class Span(NamedTuple):
    """Part of a pass inside: line across, ends along it, in the square."""

    line: int
    low: float
    high: float


class TrimmedSquare:
    """The unit square of a patch with its passes; what is inside the trimming and `away` from it, mm.

    Passes end `pull` (mm along them) before that.
    """

    def __init__(self, patch: Patch, square: Square, away: float = 0.0, pull: float = 0.0) -> None:
        self._patch, self._square = patch, square
        self._mapping: Mapping = mapping_of(square.mapping, patch.surface)
        self._away, self._pull = away, pull
        self._outline = Outline(patch) if away else None

    def inside(self, nodes: Floats, slack: float = 0.0) -> Bools:
        """Return which places (m, 2) of the unit square are inside and, but for a slack, away."""
        jets = np.zeros((len(nodes), 3, 2))
        jets[:, 0], jets[:, 1, 0] = nodes, 1.0
        u, v = self._mapping.carried(jets)[:, 0].T
        inside = self._patch.contains(u, v)
        if self._outline is not None:
            inside[inside] = self._outline.clear(
                self._patch.surface.point(u[inside], v[inside]), self._away - slack
            )
        return inside

    def _on(self, s: Floats, c: Floats) -> Bools:
        return self.inside(self._square.nodes(s, c))

    def _speed(self, s: Floats, c: float) -> Floats:
        """Length a unit of s along a line, mm."""
        return np.asarray(np.linalg.norm(self._square.along_passes(s, np.full(s.shape, c)), axis=-1))

    def spans(self, lines: Floats) -> list[list[Span]]:
        """Return the parts of each line (n,), a place across, that are inside, pulled in."""
        changes = [self._changes(c) for c in lines]
        c = np.repeat(lines, [first.size for _, _, first in changes])
        low, high, first = (np.concatenate(each) for each in zip(*changes, strict=True))
        places = self._crossings(low, high, first, c)
        ends = np.cumsum([0] + [first.size for _, _, first in changes])
        return [
            self._pulled(k, float(c), places[a:b].reshape(-1, 2))
            for k, (c, a, b) in enumerate(zip(lines, ends, ends[1:], strict=False))
        ]

    def _changes(self, c: float) -> tuple[Floats, Floats, Bools]:
        """Places along a line between which it crosses the trimming; whether the first is inside."""
        s = np.linspace(0.0, 1.0, 129)
        longest = float(self._speed(s, c).mean())
        s = np.linspace(0.0, 1.0, int(np.clip(np.ceil(longest / STEP), 16, MOST)) + 1)
        inside = self._on(s, np.full(s.shape, c))
        inside[[0, -1]] = False  # a pass keeps away from the border, too
        turns = np.flatnonzero(inside[1:] != inside[:-1])
        return s[turns], s[turns + 1], inside[turns]

    def _pulled(self, line: int, c: float, places: Floats) -> list[Span]:
        """Parts (n, 2) of a line at c, pulled in."""
        spans = []
        for low, high in places:
            ends = self.drawn(low, self._pull, c, 1.0), self.drawn(high, self._pull, c, -1.0)
            if ends[0] < ends[1] and self._wide(*ends, c):
                spans.append(Span(line, *ends))
        return spans

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
        out = s + way * length / float(self._speed(np.array([s]), c)[0])
        for _ in range(STEPS):
            places = np.clip(s + (out - s) * (1 + x) / 2, 0.0, 1.0)
            mean = float(weight @ self._speed(places, c)) / 2
            out = s + way * length / mean
        return out

    def _wide(self, low: float, high: float, c: float) -> bool:
        """Whether a part is longer than the margins: shorter ones are no passes."""
        middle = self._speed(np.array([(low + high) / 2]), c)
        return bool((high - low) * middle[0] > self._away + self._pull)

    def clear(self, start: Floats, end: Floats) -> bool:
        """Whether a straight move in the square (s, c) from start to end stays inside."""
        by_s, by_c = self._square.tangents(start[:1], start[1:])
        way = np.linalg.norm(by_s[0] * (end[0] - start[0]) + by_c[0] * (end[1] - start[1]))
        share = np.linspace(0.0, 1.0, int(np.clip(np.ceil(way / STEP), 8, MOST)) + 1)[1:-1, None]
        places = start + share * (end - start)  # the ends are inside, up to rounding
        return bool(self.inside(self._square.nodes(*places.T), SLACK).all())


def trimmed_passes(region: TrimmedSquare, lines: Floats, columns: Floats, pitch: float) -> list[Floats]:
    """Return the pieces of a zigzag: places (n, 2) of (s, c) each.

    A piece goes on to the next line where a straight move to the nearer end of a part of it stays inside;
    both ends are drawn back by up to half a pitch (mm) for that, as around a hole a straight move cuts the
    corner.
    """
    rest = region.spans(lines)
    pieces = []
    while any(rest):
        chain = _chain(region, lines, rest, pitch)
        forward = [k % 2 == 0 for k in range(len(chain))]
        places = [
            _along(span, float(lines[span.line]), columns)[:: 1 if ahead else -1]
            for span, ahead in zip(chain, forward, strict=True)
        ]
        pieces.append(np.concatenate(places))
    return pieces


def _chain(region: TrimmedSquare, lines: Floats, rest: list[list[Span]], pitch: float) -> list[Span]:
    """Take parts of following lines from the rest, as long as they can be joined on the work."""
    first = next(k for k, spans in enumerate(rest) if spans)
    chain = [rest[first].pop(0)]
    while (line := chain[-1].line + 1) < len(rest):
        for other in _beside(chain[-1], rest[line], len(chain) % 2 == 1):
            pair = _joined(region, lines, (chain[-1], other), len(chain) % 2 == 1, pitch)
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
    region: TrimmedSquare, lines: Floats, pair: tuple[Span, Span], ahead: bool, pitch: float
) -> tuple[Span, Span] | None:
    """Both parts with ends that a straight move joins on the work; None where none is found."""
    for k in range(DRAWS + 1):
        back = pitch / 2 * (k / DRAWS) ** 2
        one, other = (_drawn_back(region, float(lines[each.line]), each, ahead, back) for each in pair)
        if min(one.high - one.low, other.high - other.low) <= 0.0:
            return None
        start, end = (np.array([_end(each, ahead), lines[each.line]]) for each in (one, other))
        if region.clear(start, end):
            return one, other
    return None


def _drawn_back(region: TrimmedSquare, c: float, span: Span, ahead: bool, back: float) -> Span:
    if not back:
        return span
    end = region.drawn(_end(span, ahead), back, c, -1.0 if ahead else 1.0)
    return span._replace(high=end) if ahead else span._replace(low=end)


def _along(span: Span, c: float, columns: Floats) -> Floats:
    """Nodes (n, 2) of a part of a pass: its ends, and the columns between them."""
    room = CROWDED * float(np.diff(columns).min()) if columns.size > 1 else 0.0
    inner = columns[(columns > span.low + room) & (columns < span.high - room)]
    s = np.concatenate([[span.low], inner, [span.high]])
    return np.stack([s, np.full(s.size, c)], axis=1)
