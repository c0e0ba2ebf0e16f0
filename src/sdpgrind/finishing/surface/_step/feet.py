"""Feet of many points on a curve, seen along a direction or around an axis."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface._step.rational import RationalCurve

LOOKS = 64  # chosen: places in each span of a curve from which feet are sought
STEPS = 40  # chosen: steps to a foot; five are usual
SETTLED = 1e-15  # of the parameters, chosen: length of the last step
LEVEL = 1e-9  # chosen: sine of a line's angle with a plane that it is parallel to
# places (n, 3) and their derivatives as they are seen, (n, k) each
View = Callable[[Floats, Floats], tuple[Floats, Floats]]


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
