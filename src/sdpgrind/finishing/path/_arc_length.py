"""Length along a path: Legendre series of the speed in intervals, halved until they converge."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.quadrature import leggauss
from sdpgrind.finishing.path._arc_kernels import inverted, travelled
from sdpgrind.finishing.path._samples import Ints

# chosen: Gauss points of an interval on a straight leg (True) and on a curved one; fewer halve more intervals
POINTS = {True: 8, False: 16}
# of a piece's length, chosen: last two terms of a converged series; the length itself is closer by orders
TOLERANCE = 1e-9
NOTHING = 1e-14  # of the path's length or the surface's size, chosen: no shorter interval is halved
HALVINGS = 40  # chosen: limit of the halvings of an interval

Speed = Callable[[Ints, Floats], Floats]


@dataclass(frozen=True)
class ArcLength:
    """Intervals by piece and t (`first`, `last`), Legendre series of their length, mm, and length before."""

    piece: Ints
    first: Floats
    last: Floats
    series: Floats
    before: Floats

    @property
    def total(self) -> float:
        """Length of the path, mm."""
        return float(self.before[-1])

    def pieces(self, count: int) -> Floats:
        """Length of each of `count` pieces, mm."""
        return np.asarray(np.bincount(self.piece, weights=np.diff(self.before), minlength=count), dtype=float)

    def at(self, piece: Ints, t: Floats) -> Floats:
        """Length up to t on a piece, mm."""
        interval = (
            np.searchsorted(self.piece + self.first, piece + np.minimum(t, 1 - 1e-15), side="right") - 1
        )
        interval = np.clip(interval, *np.searchsorted(self.piece, [piece, piece + 1]) - np.array([[0], [1]]))
        width = self.last[interval] - self.first[interval]
        out = np.empty(len(interval))
        travelled(
            self.series, interval, np.clip(2.0 * (t - self.first[interval]) / width - 1.0, -1.0, 1.0), out
        )
        return np.asarray(self.before[interval] + out)

    def places(self, length: Floats) -> tuple[Ints, Floats]:
        """Piece and t at lengths (mm); the end of a piece is the start of the next one."""
        interval = np.clip(np.searchsorted(self.before, length, side="right") - 1, 0, len(self.piece) - 1)
        out = np.empty(len(interval))
        inverted(self.series, interval, length - self.before[interval], out)
        width = self.last[interval] - self.first[interval]
        return self.piece[interval], np.asarray(self.first[interval] + 0.5 * (out + 1.0) * width)

    def evenly(self, run: Ints, step: float) -> tuple[Ints, Floats]:
        """Piece and t at even distances of at most `step` mm in each run (k,), its ends included."""
        first = np.searchsorted(run, np.arange(run[-1] + 2))
        ends = np.concatenate([[0.0], np.cumsum(self.pieces(len(run)))])[first]
        parts = np.maximum(np.ceil(np.diff(ends) / step * (1 - 1e-12)), 1).astype(np.intp)
        of = np.repeat(np.arange(len(parts)), parts + 1)
        number = np.arange(len(of)) - (np.cumsum(parts + 1) - parts - 1)[of]
        piece, t = self.places(ends[of] + number / parts[of] * np.diff(ends)[of])
        start, end = number == 0, number == parts[of]
        piece = np.where(start, first[of], np.where(end, first[of + 1] - 1, piece))
        return piece, np.where(start, 0.0, np.where(end, 1.0, t))


def arc_length(speed: Speed, piece: Ints, first: Floats, last: Floats, points: int, size: float) -> ArcLength:
    """Measure intervals on a surface of `size` mm, halving those whose series has not converged."""
    whole = np.zeros(piece.max() + 1)
    done: list[tuple[Ints, Floats, Floats, Floats]] = []
    for halvings in range(HALVINGS + 1):
        series = _series(speed, piece, first, last, points)
        if halvings == 0:
            np.add.at(whole, piece, 2.0 * series[:, 0])
        tail = np.abs(series[:, -1]) + np.abs(series[:, -2])
        good = (
            (tail <= TOLERANCE * whole[piece])
            | (series[:, 0] <= NOTHING * max(whole.sum(), size))
            | (halvings == HALVINGS)
        )
        done.append((piece[good], first[good], last[good], series[good]))
        if good.all():
            break
        piece, first, last = piece[~good], first[~good], last[~good]
        middle = 0.5 * (first + last)
        piece, first, last = (
            np.tile(piece, 2),
            np.concatenate([first, middle]),
            np.concatenate([middle, last]),
        )
    return _sorted(*map(np.concatenate, zip(*done, strict=True)))


def _series(speed: Speed, piece: Ints, first: Floats, last: Floats, points: int) -> Floats:
    """Legendre series of the speed over x in [-1, 1], mm."""
    x, terms = _rule(points)
    half = 0.5 * (last - first)
    t = 0.5 * (first + last)[:, None] + half[:, None] * x
    found = speed(np.repeat(piece, points), t.ravel()).reshape(t.shape)
    return np.asarray((found * half[:, None]) @ terms)


@lru_cache
def _rule(points: int) -> tuple[Floats, Floats]:
    """Gauss points, and what turns values there into the terms of a Legendre series (points, points)."""
    x, weights = leggauss(points)
    return x, lasting(legendre.legvander(x, points - 1) * weights[:, None] * (np.arange(points) + 0.5))


def _sorted(piece: Ints, first: Floats, last: Floats, series: Floats) -> ArcLength:
    order = np.lexsort((first, piece))
    before = np.concatenate([[0.0], np.cumsum(2.0 * series[order, 0])])
    return ArcLength(piece[order], first[order], last[order], series[order], before)
