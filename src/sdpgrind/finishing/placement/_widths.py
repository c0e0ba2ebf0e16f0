"""Least room of flat points between two pairs of parallel lines, over all turns, in closed form."""

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from sdpgrind.base.checks import Floats


class Room(NamedTuple):
    """Turn (rad) at which points fit a rectangle best, and what they need there along x and y, mm."""

    turn: float
    needed: tuple[float, float]
    excess: float


def least_room(points: Floats, sides: tuple[float, float]) -> Room:
    """Return the turn of points (m, 2) with the least excess over the sides of a rectangle along x and y, mm.

    The excess is that of the axis that lacks more, ``max(w(t) - sides[0], w(t + pi/2) - sides[1])`` with the
    width w along the direction t. Between two directions in which an edge of the convex hull is seen end on,
    a width is ``A cos(t - a)``, positive, so concave. The greater of two concave functions is least at an end
    of an interval or where both are equal: there are no other candidates.
    """
    hull = _hull(points)
    edges = np.diff(np.vstack([hull, hull[:1]]), axis=0)
    edge = np.arctan2(edges[:, 1], edges[:, 0])
    ends = np.unique(np.mod(np.concatenate([edge, edge + math.pi / 2, [0.0]]), math.pi))
    ends = np.append(ends, math.pi)
    turns = np.concatenate([ends, _crossings(hull, ends, sides[0] - sides[1])])
    needed = np.stack([widths(hull, turns), widths(hull, turns + math.pi / 2)], axis=1)
    excess = (needed - np.array(sides)).max(axis=1)
    best = int(np.argmin(excess))
    return Room(float(turns[best]), (float(needed[best, 0]), float(needed[best, 1])), float(excess[best]))


def widths(points: Floats, turns: Floats) -> Floats:
    """Widths of points (m, 2) along directions (k,), rad; mm."""
    along = np.cos(turns)[:, None] * points[:, 0] + np.sin(turns)[:, None] * points[:, 1]
    out: Floats = along.max(axis=1) - along.min(axis=1)
    return out


def _hull(points: Floats) -> Floats:
    """Corners of the convex hull in order; the ends where all lie on a line."""
    try:
        corners: Floats = points[ConvexHull(points).vertices]
        return corners
    except (QhullError, ValueError):
        away = points - points.mean(axis=0)
        along = away @ np.linalg.svd(away, full_matrices=False)[2][0]
        return points[[int(np.argmin(along)), int(np.argmax(along))]]


def _crossings(hull: Floats, ends: Floats, difference: float) -> Floats:
    """Turns at which w(t) - w(t + pi/2) is a difference, mm, within the intervals between `ends`."""
    middle = (ends[1:] + ends[:-1]) / 2
    one, other = _chord(hull, middle), _chord(hull, middle + math.pi / 2)
    # w(t) = one . (cos t, sin t), w(t + pi/2) = other . (-sin t, cos t)
    p, q = one[:, 0] - other[:, 1], one[:, 1] + other[:, 0]
    size, phase = np.hypot(p, q), np.arctan2(q, p)
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.arccos(np.clip(difference / size, -1.0, 1.0))
    found = np.stack([phase + apart, phase - apart])
    found = ends[:-1] + np.mod(found - ends[:-1], 2 * math.pi)
    out: Floats = found[np.isfinite(found) & (found <= ends[1:])]
    return out


def _chord(points: Floats, turns: Floats) -> Floats:
    """Way (k, 2) from the last to the first point along directions (k,)."""
    along = np.cos(turns)[:, None] * points[:, 0] + np.sin(turns)[:, None] * points[:, 1]
    out: Floats = points[along.argmax(axis=1)] - points[along.argmin(axis=1)]
    return out
