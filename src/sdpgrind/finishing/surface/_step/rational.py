"""Rational B-spline curves as they stand in files: places, feet of points, and the exact curve of a part."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.elementary import AS_TOLD, RING, TURN, Meaning

CLOSE = 1e-9  # of a curve's length or its domain, chosen: two places are one
LOOKS = 64  # chosen: places in each span of a curve from which feet are sought
STEPS = 40  # chosen: steps to a foot; five are usual
SETTLED = 1e-15  # of the parameters, chosen: length of the last step
LEVEL = 1e-9  # chosen: sine of a line's angle with a plane that it is parallel to
# places (n, 3) and their derivatives as they are seen, (n, k) each
View = Callable[[Floats, Floats], tuple[Floats, Floats]]


@dataclass(frozen=True)
class RationalCurve:
    """A curve with homogeneous control points (n, 4): w times the place in mm, and w.

    An `endless` one is a line, of degree 1 through two points, and goes on beyond its knots.
    """

    degree: int
    nodes: Floats
    knots: Floats
    endless: bool = False
    period: float | None = None
    meaning: Meaning = AS_TOLD

    @property
    def ends(self) -> tuple[float, float]:
        """First and last parameter, mm along a line."""
        if self.endless:
            return -np.inf, np.inf
        return float(self.knots[self.degree]), float(self.knots[len(self.nodes)])

    @property
    def breaks(self) -> Floats:
        """Parameters between which the curve is rational, those of its ends included."""
        return np.unique(np.clip(self.knots, *self.ends))

    def within(self, t: Floats) -> Floats:
        """Return the parameters on the curve: on a closed one by whole periods, else at its ends."""
        low, high = self.ends
        if self.period is not None:
            t = np.where((t < low) | (t > high), low + (t - low) % self.period, t)
        return np.clip(t, low, high)

    def places(self, t: Floats) -> tuple[Floats, Floats]:
        """Return places and their derivatives, each (n, 3), at parameters (n,)."""
        spline = BSpline(self.knots, self.nodes, self.degree)
        there, rate = spline(self.within(t)), spline(self.within(t), 1)
        place = there[:, :3] / there[:, 3:]
        return place, (rate[:, :3] - place * rate[:, 3:]) / there[:, 3:]

    def points(self, t: Floats) -> Floats:
        """Return the places (n, 3) at parameters (n,)."""
        return self.places(t)[0]

    def piece(self, low: float, high: float) -> "RationalCurve":
        """Return the same curve from one parameter to another; over the seam of a closed one, too."""
        if self.endless:
            nodes = np.column_stack([self.points(np.array([low, high])), np.ones(2)])
            return replace(self, nodes=nodes, knots=np.array([low, low, high, high]), endless=False)
        first, last = self.ends
        if self.period is None:
            return self._cut(max(low, first), min(high, last))
        turns = np.floor((low - first) / self.period + CLOSE) * self.period
        start, stop = max(low - turns, first), min(high, low + self.period) - turns
        if stop <= last + CLOSE * self.period:
            found = self._cut(start, min(stop, last))
        else:
            found = self._cut(start, last)._joined(self._cut(first, stop - self.period), self.period)
        return replace(found, knots=found.knots + turns)

    def reversed(self) -> "RationalCurve":
        """Return the curve the other way, its parameters negative."""
        meaning = self.meaning._replace(unit=-self.meaning.unit)
        return replace(self, nodes=self.nodes[::-1], knots=-self.knots[::-1], meaning=meaning)

    def _cut(self, low: float, high: float) -> "RationalCurve":
        knots, nodes = self.knots, self.nodes
        for place in (low, high):
            knots, nodes = _inserted(knots, nodes, self.degree, place)
        first = int(np.searchsorted(knots, low, side="right")) - self.degree
        last = int(np.searchsorted(knots, high, side="left"))
        inner = knots[first : last + self.degree]
        return replace(
            self, nodes=nodes[first - 1 : last], knots=np.concatenate([[low], inner, [high]]), period=None
        )

    def _joined(self, other: "RationalCurve", shift: float) -> "RationalCurve":
        """Return the curve with one that begins at its end, whose parameters move by `shift`."""
        # a common factor of all control points leaves a rational curve as it is
        after = other.nodes * (self.nodes[-1, 3] / other.nodes[0, 3])
        knots = np.concatenate([self.knots[:-1], other.knots[self.degree + 1 :] + shift])
        return replace(self, nodes=np.concatenate([self.nodes, after[1:]]), knots=knots)


def _inserted(knots: Floats, nodes: Floats, degree: int, place: float) -> tuple[Floats, Floats]:
    """Knots and control points with a knot as often as the degree; source: Boehm (1980)."""
    while (times := int(np.count_nonzero(knots == place))) < degree:
        k = int(np.searchsorted(knots, place, side="right")) - 1
        moved = np.arange(k - degree + 1, k - times + 1)
        share = ((place - knots[moved]) / (knots[moved + degree] - knots[moved]))[:, None]
        between = (1 - share) * nodes[moved - 1] + share * nodes[moved]
        nodes = np.concatenate([nodes[: moved[0]], between, nodes[moved[-1] :]])
        knots = np.insert(knots, k + 1, place)
    return knots, nodes


def closed_or_open(curve: RationalCurve) -> RationalCurve:
    """Return the curve with its period where its ends meet."""
    ends = curve.points(np.array(curve.ends))
    size = float(np.linalg.norm(np.ptp(curve.nodes[:, :3] / curve.nodes[:, 3:], axis=0)))
    closed = float(np.linalg.norm(ends[1] - ends[0])) <= CLOSE * size
    return replace(curve, period=curve.ends[1] - curve.ends[0] if closed else None)


def ring(centre: Floats, one: Floats, other: Floats, unit: float) -> RationalCurve:
    """Return a circle or an ellipse by its half axes (3,), mm; `unit` of the file's angles in rad."""
    places = centre + RING.nodes @ np.stack([one, other])
    nodes = np.column_stack([places, np.ones(len(places))]) * RING.weights[:, None]
    return RationalCurve(2, nodes, RING.knots, period=TURN, meaning=Meaning(unit, arcs=True))


def nearest(curve: RationalCurve, points: Floats, view: View) -> Floats:
    """Return the parameters (n,) at which a curve is seen nearest to points (n, 3)."""
    seen = view(points, np.zeros_like(points))[0]
    t = _begun_on_line(curve, seen, view) if curve.endless else _begun(curve, seen, view)
    for _ in range(STEPS):
        there, rate = view(*curve.places(t))
        step = np.sum(rate * (seen - there), axis=1) / np.maximum(np.sum(rate * rate, axis=1), 1e-300)
        after = curve.within(t + step)
        moved = np.abs(after - t)
        t = after
        if np.all(moved <= SETTLED * (1.0 + np.abs(t))):
            break
    return t


def _begun(curve: RationalCurve, seen: Floats, view: View) -> Floats:
    """Parameters of the nearest of many places of a curve."""
    breaks = curve.breaks
    looks = np.unique(np.linspace(breaks[:-1], breaks[1:], LOOKS + 1))
    found = cKDTree(view(*curve.places(looks))[0]).query(seen)[1]
    return np.asarray(looks[found], dtype=float)


def _begun_on_line(curve: RationalCurve, seen: Floats, view: View) -> Floats:
    """Parameters of a line by the last of the coordinates as seen; it is linear along the line."""
    start, after = view(*curve.places(np.array([0.0, 1.0])))[0][:, -1]
    level = abs(after - start) < LEVEL
    return np.zeros(len(seen)) if level else np.asarray((seen[:, -1] - start) / (after - start), dtype=float)
