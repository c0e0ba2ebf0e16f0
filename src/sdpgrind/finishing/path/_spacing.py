"""Spacing of the lines of one family so that the widest gap between neighbours is at most a pitch.

The gap of the lines c = c1 and c = c2 at a place s is int |Q_s x Q_c|/|Q_s| dc at that s; its largest value
over s counts. A border counts as half way to another line: it is at most half a pitch away.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.path._spacing_kernels import march

# chosen: places along the lines for gaps, and intervals across them, shared by the knot spans
ROWS, INTERVALS = 257, 256
POINT = 1e-20  # of the greatest ``|Q_s|^2``, chosen: with less a line is a point
ROUNDING = 1e-9  # of the pitch, chosen: tolerance of a gap, as a side of 50 mm is 50 pitches of 1 mm


class Gaps(NamedTuple):
    """Distance from the border c = 0 across lines, rows at constant s: `total`, its derivative (rows, m)."""

    across: Floats
    total: Floats
    slope: Floats

    def at(self, lines: Floats) -> Floats:
        """Distances (rows, lines) of lines from the border, mm."""
        j = np.clip(np.searchsorted(self.across, lines) - 1, 0, self.across.size - 2)
        h = self.across[j + 1] - self.across[j]
        t = (lines - self.across[j]) / h
        rise, left, right = (
            self.total[:, j + 1] - self.total[:, j],
            self.slope[:, j] * h,
            self.slope[:, j + 1] * h,
        )
        bend = 3 * rise - 2 * left - right + t * (left + right - 2 * rise)
        return np.asarray(self.total[:, j] + t * (left + t * bend))

    @property
    def width(self) -> float:
        """Widest distance of the two borders, mm."""
        return float(self.total[:, -1].max())

    @property
    def densest(self) -> float:
        """Largest derivative over the mean of its row."""
        return float(
            np.max(
                self.slope.max(axis=1) / np.maximum(self.total[:, -1], 1e-300),
                initial=0.0,
                where=self.total[:, -1] > 0,
            )
        )


def gaps_of(tangent: Floats, across_tangent: Floats, across: Floats) -> Gaps:
    """Gaps from Q_s, Q_c (rows, 2m - 1, 3) at places `across` (2m - 1,), every other one a middle."""
    square = np.einsum("ijc,ijc->ij", tangent, tangent)
    mixed = np.einsum("ijc,ijc->ij", tangent, across_tangent)
    along = mixed / np.where(square > POINT * square.max(), square, np.inf)
    density = np.linalg.norm(across_tangent - along[..., None] * tangent, axis=-1)
    steps = np.diff(across[::2])
    simpson = (density[:, :-2:2] + 4 * density[:, 1::2] + density[:, 2::2]) * steps / 6
    total = np.concatenate([np.zeros((density.shape[0], 1)), np.cumsum(simpson, axis=1)], axis=1)
    return Gaps(across[::2].copy(), total, np.ascontiguousarray(density[:, ::2]))


def graded(breaks: Floats, parts: int) -> Floats:
    """Places from the first of `breaks` to the last, about `parts` intervals, with each break among them."""
    share = np.diff(breaks) / (breaks[-1] - breaks[0])
    pieces = [
        np.linspace(low, high, max(2, round(parts * part)), endpoint=False)
        for low, high, part in zip(breaks[:-1], breaks[1:], share, strict=True)
    ]
    return np.concatenate([*pieces, breaks[-1:]])


def with_middles(places: Floats) -> Floats:
    """Places with the middles between them."""
    out = np.empty(2 * places.size - 1)
    out[::2], out[1::2] = places, (places[1:] + places[:-1]) / 2
    return out


def largest_gap(gaps: Gaps, lines: Floats) -> float:
    """Widest gap of neighbouring lines, or twice that to a border, mm."""
    distance = gaps.at(lines)
    inner = np.diff(distance, axis=1).max() if lines.size > 1 else 0.0
    first, last = distance[:, 0].max(), (gaps.total[:, -1] - distance[:, -1]).max()
    return float(max(inner, 2 * first, 2 * last))


def equal_spacing(gaps: Gaps, pitch: float) -> Floats:
    """Places of the fewest lines with gaps <= `pitch`, with all widest gaps equal."""
    widest = np.diff(gaps.total, axis=1).max(axis=0).sum()
    greedy = _marched(gaps, pitch * (1 + ROUNDING), int(widest / pitch) + 2)
    open_border = (gaps.total[:, -1:] - gaps.at(np.minimum(greedy, 1.0))).max(axis=0)
    count = int(np.argmax((open_border <= pitch * (0.5 + ROUNDING)) | (greedy >= 1.0))) + 1
    equal = brentq(
        lambda gap: _excess(gaps, gap, count), 0.25 * pitch, pitch * (1 + ROUNDING), xtol=1e-12 * pitch
    )
    return _marched(gaps, equal, count)


def _marched(gaps: Gaps, gap: float, count: int) -> Floats:
    return np.asarray(march(gaps.total, gaps.slope, gaps.across, gap, count))


def _excess(gaps: Gaps, gap: float, count: int) -> float:
    """Distance of the far border from the last of `count` lines minus half a gap."""
    last = _marched(gaps, gap, count)[-1]
    beyond = max(last - 1.0, 0.0)
    left = gaps.total[:, -1] - gaps.at(np.array([min(last, 1.0)]))[:, 0] - beyond * gaps.slope[:, -1]
    return float(left.max()) - gap / 2


def even_spacing(gaps: Gaps, pitch: float) -> Floats:
    """Places of the fewest lines, evenly apart in their parameter, with gaps <= `pitch`."""
    count = int(np.ceil(gaps.slope.max() / pitch * (1 - ROUNDING)))
    while count > 1 and largest_gap(gaps, _middles(count - 1)) <= pitch * (1 + ROUNDING):
        count -= 1
    return _middles(count)


def _middles(count: int) -> Floats:
    return (np.arange(count) + 0.5) / count
