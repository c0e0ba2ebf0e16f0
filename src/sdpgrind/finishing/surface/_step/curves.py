"""Curves of a STEP file in space: places at a parameter, and the parameter of a place."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.placements import (
    direction,
    moved,
    placement,
    placement_2d,
    point,
    seen_from,
)
from sdpgrind.finishing.surface._step.splines import IMPLICIT, knots_implicit, knots_told

DEEPEST = 8  # chosen: curves that stand on other curves
LOOKS = 64  # chosen: places in each span of a curve where its nearest place to a vertex is sought
CLOSE = 1e-9  # of a curve's length, chosen: its ends are one place
NARROWINGS = 4  # chosen: each makes the interval around the nearest place 16 times narrower
SPLINES = (
    "B_SPLINE_CURVE_WITH_KNOTS", "QUASI_UNIFORM_CURVE", "BEZIER_CURVE", "UNIFORM_CURVE",
)  # fmt: skip


ON_ANOTHER = ("SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE", "TRIMMED_CURVE")


@dataclass(frozen=True)
class StepCurve:
    """A curve (n,) -> (n, 3), mm, with the parameters between which it is a polynomial or an arc.

    `locate` gives the parameter of the nearest place; None: by search. `period` is that of a closed curve.
    """

    points: Callable[[Floats], Floats]
    breaks: Floats
    period: float | None = None
    locate: Callable[[Floats], float] | None = None

    def parameter(self, place: Floats) -> float:
        """Return the parameter at which the curve is nearest to a place (3,)."""
        return self.locate(place) if self.locate else self._sought(place)

    def _sought(self, place: Floats) -> float:
        low, high = float(self.breaks[0]), float(self.breaks[-1])
        looks = np.unique(np.linspace(self.breaks[:-1], self.breaks[1:], LOOKS + 1))
        for _ in range(2 + NARROWINGS):
            away = np.linalg.norm(self.points(looks) - place, axis=1)
            best = int(np.argmin(away))
            before, after = looks[max(best - 1, 0)], looks[min(best + 1, looks.size - 1)]
            looks = np.linspace(before, after, LOOKS // 2 + 1)
        return float(np.clip(looks[np.argmin(np.linalg.norm(self.points(looks) - place, axis=1))], low, high))


def is_known(file: StepFile, number: int, depth: int = 0) -> bool:
    """Return whether a curve is of a kind that `curve` reads."""
    row = file.find(number, *_READERS, *ON_ANOTHER)
    if row is None or row.type in _READERS or depth > DEEPEST:
        return row is not None
    under = row.optional_reference(1)
    return under is not None and is_known(file, under, depth + 1)


def curve(file: StepFile, number: int, scale: float, size: int = 3, depth: int = 0) -> StepCurve:
    """Return a curve by its number, mm; one of `size` 2, in a plane of parameters, with z = 0."""
    if depth > DEEPEST:
        raise ValueError(f"{file.name(number)} must not stand on itself")
    row = file.find(number, *_READERS, *ON_ANOTHER)
    if row is None:
        raise ValueError(f"{file.name(number)} is not read; export the edge as B-spline curve")
    if row.type in ON_ANOTHER:
        return curve(file, row.reference(1), scale, size, depth + 1)
    return _READERS[row.type](file, row, scale, size)


def _line(file: StepFile, row: StepRow, scale: float, size: int) -> StepCurve:
    start = point(file, row.reference(1), scale, size)
    along = direction(file, file.row(row.reference(2), "VECTOR").reference(1), size)
    return StepCurve(
        lambda t: np.asarray(start + np.asarray(t)[..., None] * along),
        np.array([-np.inf, np.inf]),
        locate=lambda place: float((place - start) @ along),
    )


def _conic(file: StepFile, row: StepRow, scale: float, size: int) -> StepCurve:
    """Circle or ellipse, over its angle."""
    at = row.reference(1)
    frame = placement(file, at, scale) if size == 3 else placement_2d(file, at)
    a = row.number_at(2) * scale
    b = a if row.type == "CIRCLE" else row.number_at(3) * scale
    if not (a > 0 and b > 0):
        raise row.refused(f"must have radii > 0; got {a:g} and {b:g} mm")

    def points(t: Floats) -> Floats:
        return moved(frame, np.stack([a * np.cos(t), b * np.sin(t), np.zeros_like(t)], axis=-1))

    def locate(place: Floats) -> float:
        x, y, _ = seen_from(frame, place)
        return float(np.arctan2(y / b, x / a))

    breaks = np.linspace(0.0, 2 * np.pi, 5)
    return StepCurve(points, breaks, 2 * np.pi, locate if a == b else None)


def _polyline(file: StepFile, row: StepRow, scale: float, size: int) -> StepCurve:
    nodes = np.array([point(file, each, scale, size) for each in row.references(1)])
    if len(nodes) < 2:
        raise row.refused("must have two points or more")
    knots = np.append(0.0, np.append(np.arange(len(nodes)), len(nodes) - 1.0))
    return _splined(1, nodes, np.ones(len(nodes)), knots)


def _spline(file: StepFile, form: StepRow, scale: float, size: int) -> StepCurve:
    return _splined(*told_spline(file, form, scale, size))


def told_spline(
    file: StepFile, form: StepRow, scale: float, size: int = 3
) -> tuple[int, Floats, Floats, Floats]:
    """Return degree, control points (n, 3) in mm, weights (n,) and knots of a B-spline curve, checked."""
    base = file.find(form.number, "B_SPLINE_CURVE") or form
    first = 0 if base.type == "B_SPLINE_CURVE" else 1
    degree = base.count(first)
    nodes = np.array([point(file, each, scale, size) for each in base.references(first + 1)])
    if form.type == SPLINES[0]:
        at = 0 if first == 0 else 6
        knots = knots_told(form, at, at + 1)
    else:
        kind = next(each for each in IMPLICIT if form.type == f"{each}_CURVE")
        knots = knots_implicit(form, kind, degree, len(nodes))
    rational = file.find(form.number, "RATIONAL_B_SPLINE_CURVE")
    weights = np.ones(len(nodes)) if rational is None else rational.numbers(0)
    _refuse_spline(form, degree, len(nodes), weights, knots)
    return degree, nodes, weights, knots


def _refuse_spline(row: StepRow, degree: int, count: int, weights: Floats, knots: Floats) -> None:
    if degree < 1 or count <= degree or len(knots) != count + degree + 1 or np.any(np.diff(knots) < 0):
        raise row.refused(
            f"must have degree >= 1 and rising knots, control points + degree + 1; got degree {degree},"
            f" {count} points, {len(knots)} knots"
        )
    if weights.shape != (count,) or weights.min() <= 0 or knots[degree] >= knots[count]:
        raise row.refused("must have weights > 0, one a control point, and knots that leave a domain")


def _splined(degree: int, nodes: Floats, weights: Floats, knots: Floats) -> StepCurve:
    """B-spline curve from checked numbers."""
    low, high = float(knots[degree]), float(knots[len(nodes)])
    spline = BSpline(knots, np.column_stack([nodes * weights[:, None], weights]), degree)
    ends = spline(np.array([low, high]))
    gap = np.linalg.norm(ends[1, :3] / ends[1, 3] - ends[0, :3] / ends[0, 3])
    closed = bool(gap <= CLOSE * np.linalg.norm(np.ptp(nodes, axis=0)))

    def points(t: Floats) -> Floats:
        inside = np.where(t > high, t - (high - low), t) if closed else t
        found = spline(np.clip(inside, low, high))
        return np.asarray(found[..., :3] / found[..., 3:])

    breaks = np.unique(np.clip(knots, low, high))
    return StepCurve(points, breaks, high - low if closed else None)


_READERS: dict[str, Callable[[StepFile, StepRow, float, int], StepCurve]] = {
    "LINE": _line,
    "CIRCLE": _conic,
    "ELLIPSE": _conic,
    "POLYLINE": _polyline,
    **dict.fromkeys(SPLINES, _spline),
}
