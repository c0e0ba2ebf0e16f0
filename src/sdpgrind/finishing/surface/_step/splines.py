"""B-splines of a STEP file: knots told or implicit, weights, nets of control points."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.entities import StepFile, StepRow
from sdpgrind.finishing.surface._step.placements import point

# of a simple entity, values before them: the name; a complex one has none in these records
IMPLICIT = ("QUASI_UNIFORM", "BEZIER", "UNIFORM")
MOST = 10_000_000  # chosen: knots that a file may ask for
REPEAT = 1e-9  # of the domain, chosen: nearer knots are one


class SplineNet(NamedTuple):
    """Degrees, control points (nu, nv, 3) in mm, weights or None, knots along u and v."""

    degree: tuple[int, int]
    points: Floats
    weights: Floats | None
    knots: tuple[Floats, Floats]


def knots_told(row: StepRow, multiplicities: int, values: int) -> Floats:
    """Return the knots of two lists of a record, with their repeats."""
    times, places = row.counts(multiplicities), row.numbers(values)
    if len(times) != len(places) or sum(times) > MOST:
        raise row.refused(f"must have as many multiplicities as knots; got {len(times)} and {len(places)}")
    return np.repeat(places, times)


def knots_implicit(row: StepRow, kind: str, degree: int, count: int) -> Floats:
    """Return the knots of a form without a list of them; source: ISO 10303-42."""
    if degree < 1 or count <= degree:
        raise row.refused(f"must have more control points than its degree; got {count} and {degree}")
    if kind == "UNIFORM":
        return np.arange(-degree, count + 1, dtype=float)
    if kind == "QUASI_UNIFORM":
        inner = np.arange(0.0, count - degree + 1)
        return np.concatenate([np.full(degree, inner[0]), inner, np.full(degree, inner[-1])])
    if (count - 1) % degree:
        raise row.refused(f"must have a multiple of {degree} control points and one more; got {count}")
    inner = np.repeat(np.arange(0.0, (count - 1) // degree + 1), degree)
    return np.concatenate([inner[:1], inner, inner[-1:]])


def net(file: StepFile, number: int, scale: float) -> SplineNet:
    """Return the net of a B-spline surface, simple or complex."""
    known = ("B_SPLINE_SURFACE_WITH_KNOTS", *(f"{kind}_SURFACE" for kind in IMPLICIT))
    form = file.row(number, *known)
    base = file.find(number, "B_SPLINE_SURFACE") or form
    first = 0 if base.type == "B_SPLINE_SURFACE" else 1
    degree = base.count(first), base.count(first + 1)
    points = np.array([[point(file, each, scale) for each in row] for row in base.reference_net(first + 2)])
    if form.type == known[0]:
        at = 0 if first == 0 else 8
        u, v = knots_told(form, at, at + 2), knots_told(form, at + 1, at + 3)
    else:
        kind = form.type.removesuffix("_SURFACE")
        u, v = (knots_implicit(form, kind, degree[k], points.shape[k]) for k in (0, 1))
    return SplineNet(degree, points, _weights(file, number, points), (_merged(u), _merged(v)))


def _weights(file: StepFile, number: int, points: Floats) -> Floats | None:
    row = file.find(number, "RATIONAL_B_SPLINE_SURFACE")
    if row is None:
        return None
    weights = np.array(row.number_net(0))
    if weights.shape != points.shape[:2]:
        raise row.refused(f"must have weights for {points.shape[:2]} control points; got {weights.shape}")
    return None if np.all(weights == weights[0, 0]) and weights[0, 0] > 0 else weights


def _merged(knots: Floats) -> Floats:
    """Knots with those that rounding has parted made one; the first of them stays."""
    out = knots.copy()
    for k, (before, here) in enumerate(pairwise(knots), 1):
        if 0 < here - before <= REPEAT * (knots[-1] - knots[0]):
            out[k] = out[k - 1]
    return out
