"""Smallest ball around points, exactly, by a growing support."""

import math
from itertools import combinations
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats

OUTSIDE = 1e-12  # chosen: share of the radius by which a point may stick out of the ball by rounding


class EnclosingBall(NamedTuple):
    """Smallest ball around points: centre (3,) and radius, mm, and at most four points on it (indices).

    The centre is the mean of these points by `weights` >= 0. For any place c and the mean m by the weights
    ``sum w |p - c|^2 = sum w |p - m|^2 + |m - c|^2``: whatever c, a point is at least as far from it as the
    root of the first sum on the right. That is `proved`, mm, whatever rounding did to the radius.
    """

    centre: Floats
    radius: float
    support: tuple[int, ...]
    weights: tuple[float, ...]

    def proved(self, points: Floats) -> float:
        """Distance, mm, that one of the points is from every place, at least."""
        few, weights = points[list(self.support)], np.array(self.weights)
        middle = weights @ few
        return math.sqrt(float(weights @ ((few - middle) ** 2).sum(axis=1)))


def enclosing_ball(points: Floats) -> EnclosingBall:
    """Return the smallest ball around points (m, 3), mm.

    The ball of a few points is made, the farthest point outside is added to its support, and so on. The
    radius grows with each step, so that no support comes twice.
    """
    start = int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))
    ball = EnclosingBall(points[start], 0.0, (start,), (1.0,))
    while True:
        away = np.linalg.norm(points - ball.centre, axis=1)
        farthest = int(np.argmax(away))
        if away[farthest] <= ball.radius * (1 + OUTSIDE) or farthest in ball.support:
            return ball
        larger = _of_few(points, (*ball.support, farthest))
        if larger is None or larger.radius <= ball.radius:
            return ball
        ball = larger


def _of_few(points: Floats, few: tuple[int, ...]) -> EnclosingBall | None:
    """Smallest ball around at most five points: the smallest that passes through some and holds all.

    None where rounding hides it.
    """
    found = []
    for size in range(2, min(len(few), 4) + 1):
        for support in combinations(few, size):
            weights = _weights(points[list(support)])
            if weights is None:
                continue
            centre = weights @ points[list(support)]
            radius = float(np.linalg.norm(points[list(support)] - centre, axis=1).max())
            if np.linalg.norm(points[list(few)] - centre, axis=1).max() <= radius * (1 + OUTSIDE):
                found.append(EnclosingBall(centre, radius, support, tuple(weights.tolist())))
    return min(found, key=lambda ball: ball.radius, default=None)


def _weights(few: Floats) -> Floats | None:
    """Weights by which the centre of the sphere through points is their mean; None: it is not among them."""
    edges = few[1:] - few[0]
    gram = edges @ edges.T
    try:
        shares = np.linalg.solve(gram, 0.5 * np.diag(gram))
    except np.linalg.LinAlgError:
        return None
    weights = np.append(1.0 - shares.sum(), shares)
    if not weights.min() >= -OUTSIDE:
        return None
    out: Floats = np.maximum(weights, 0.0) / np.maximum(weights, 0.0).sum()
    return out
