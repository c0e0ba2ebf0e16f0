"""Passes and curves cut at the trimming of a patch."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.path._mappings import Mapping, mapping_of
from sdpgrind.finishing.path._square import Square
from sdpgrind.finishing.surface._patch import Patch

STEP = 0.02  # mm, chosen: places on a line where its crossings are sought; a narrower slot may be missed
MOST = 8192  # chosen: such places on a line
HALVINGS = 30  # derived: 2^-30 of a step of at most 1/16 of the square is below 1e-10
STEPS = 6  # chosen: corrections of a length along a line
CROWDED = 0.5  # of the distance of nodes, chosen: nearer to the end of a pass there is no other node


class Span(NamedTuple):
    """Part of a pass inside: line across, ends along it, in the square."""

    line: int
    low: float
    high: float


class TrimmedSquare:
    """The unit square of a patch with its passes; what is inside the trimming."""

    def __init__(self, patch: Patch, square: Square) -> None:
        self._patch, self._square = patch, square
        self._mapping: Mapping = mapping_of(square.mapping, patch.surface)

    def inside(self, nodes: Floats) -> Bools:
        """Return which places (m, 2) of the unit square are inside."""
        jets = np.zeros((len(nodes), 3, 2))
        jets[:, 0], jets[:, 1, 0] = nodes, 1.0
        uv = self._mapping.carried(jets)[:, 0]
        return self._patch.contains(uv[:, 0], uv[:, 1])

    def _on(self, s: Floats, c: float) -> Bools:
        return self.inside(self._square.nodes(s, np.full(s.shape, c)))

    def _speed(self, s: Floats, c: float) -> Floats:
        """Length a unit of s along a line, mm."""
        return np.asarray(np.linalg.norm(self._square.tangents(s, np.full(s.shape, c))[0], axis=-1))

    def spans(self, line: int, c: float, margin: float) -> list[Span]:
        """Return the parts of the line at c that are inside, pulled in by a margin, mm."""
        s = np.linspace(0.0, 1.0, 129)
        longest = float(self._speed(s, c).mean())
        s = np.linspace(0.0, 1.0, int(np.clip(np.ceil(longest / STEP), 16, MOST)) + 1)
        inside = self._on(s, c)
        inside[[0, -1]] = False  # a pass keeps away from the border, too
        turns = np.flatnonzero(inside[1:] != inside[:-1])
        places = self._crossings(s[turns], s[turns + 1], inside[turns], c)
        spans = []
        for low, high in places.reshape(-1, 2):
            ends = self._pulled(low, margin, c, 1.0), self._pulled(high, margin, c, -1.0)
            if ends[0] < ends[1] and self._wide(*ends, c, margin):
                spans.append(Span(line, *ends))
        return spans

    def _crossings(self, low: Floats, high: Floats, first: Bools, c: float) -> Floats:
        """Places between `low` and `high` where a line crosses the trimming, by bisection."""
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            same = self._on(middle, c) == first
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        return (low + high) / 2

    def _pulled(self, s: float, margin: float, c: float, way: float) -> float:
        """Place a margin (mm) along a line from s."""
        x, weight = np.polynomial.legendre.leggauss(8)
        out = s + way * margin / float(self._speed(np.array([s]), c)[0])
        for _ in range(STEPS):
            places = np.clip(s + (out - s) * (1 + x) / 2, 0.0, 1.0)
            mean = float(weight @ self._speed(places, c)) / 2
            out = s + way * margin / mean
        return out

    def _wide(self, low: float, high: float, c: float, margin: float) -> bool:
        """Whether a part is longer than a margin: shorter ones are no passes."""
        middle = self._speed(np.array([(low + high) / 2]), c)
        return bool((high - low) * middle[0] > margin)

    def clear(self, start: Floats, end: Floats) -> bool:
        """Whether a straight move in the square (s, c) from start to end stays inside."""
        by_s, by_c = self._square.tangents(start[:1], start[1:])
        way = np.linalg.norm(by_s[0] * (end[0] - start[0]) + by_c[0] * (end[1] - start[1]))
        share = np.linspace(0.0, 1.0, int(np.clip(np.ceil(way / STEP), 8, MOST)) + 1)[:, None]
        places = start + share * (end - start)
        return bool(self.inside(self._square.nodes(*places.T)).all())


def trimmed_passes(region: TrimmedSquare, lines: Floats, columns: Floats, margin: float) -> list[Floats]:
    """Return the pieces of a zigzag: places (n, 2) of (s, c) each.

    A piece goes on to the next line where a straight move to the nearer end of a part of it stays inside.
    """
    rest = [region.spans(k, float(c), margin) for k, c in enumerate(lines)]
    pieces = []
    while any(rest):
        chain = _chain(region, lines, rest)
        forward = [k % 2 == 0 for k in range(len(chain))]
        places = [
            _along(span, float(lines[span.line]), columns)[:: 1 if ahead else -1]
            for span, ahead in zip(chain, forward, strict=True)
        ]
        pieces.append(np.concatenate(places))
    return pieces


def _chain(region: TrimmedSquare, lines: Floats, rest: list[list[Span]]) -> list[Span]:
    """Take parts of following lines from the rest, as long as they can be joined on the work."""
    first = next(k for k, spans in enumerate(rest) if spans)
    chain = [rest[first].pop(0)]
    while (line := chain[-1].line + 1) < len(rest):
        following = _following(region, lines, chain[-1], rest[line], len(chain) % 2 == 1)
        if following is None:
            break
        rest[line].remove(following)
        chain.append(following)
    return chain


def _following(
    region: TrimmedSquare, lines: Floats, here: Span, others: list[Span], ahead: bool
) -> Span | None:
    """Return the part of the next line beside `here` whose near end can be reached on the work."""

    def end(span: Span) -> float:
        return span.high if ahead else span.low

    beside = [each for each in others if each.low < here.high and each.high > here.low]
    start = np.array([end(here), lines[here.line]])
    for each in sorted(beside, key=lambda each: abs(end(each) - end(here))):
        if region.clear(start, np.array([end(each), lines[each.line]])):
            return each
    return None


def _along(span: Span, c: float, columns: Floats) -> Floats:
    """Nodes (n, 2) of a part of a pass: its ends, and the columns between them."""
    room = CROWDED * float(np.diff(columns).min()) if columns.size > 1 else 0.0
    inner = columns[(columns > span.low + room) & (columns < span.high - room)]
    s = np.concatenate([[span.low], inner, [span.high]])
    return np.stack([s, np.full(s.size, c)], axis=1)
