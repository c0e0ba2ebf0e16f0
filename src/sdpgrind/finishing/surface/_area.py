"""Area of a surface: Gauss per knot span, with twice the points until nothing changes."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.surface import _forms as forms
from sdpgrind.finishing.surface._derivatives import Differentiable

POINTS = (8, 16, 32, 64)
"""Per knot span, each way."""
SETTLED = 1e-13
"""Change by the last doubling, relative, at which the area is taken as found."""


class PatchArea(NamedTuple):
    """An area in mm^2, and by how much its last doubling of points changed it."""

    value: float
    change: float


def area(surface: Differentiable) -> PatchArea:
    """Integrate sqrt(EG - F^2) over the domain."""
    value = _by_gauss(surface, POINTS[0])
    change = np.inf
    for points in POINTS[1:]:
        before, value = value, _by_gauss(surface, points)
        change = abs(value - before)
        if change <= SETTLED * value:
            break
    return PatchArea(value, change)


def _by_gauss(surface: Differentiable, points: int) -> float:
    (u, weight_u), (v, weight_v) = (gauss(breaks, points) for breaks in surface.breaks)
    return float(weight_u @ forms.area_density(surface.grid(u, v)) @ weight_v)


def gauss(ends: Floats, points: int) -> tuple[Floats, Floats]:
    """Nodes and weights of Gauss's rule in each interval between neighbouring `ends`, so many points in each."""
    x, weight = np.polynomial.legendre.leggauss(points)
    half = 0.5 * np.diff(ends)[:, None]
    return (ends[:-1, None] + half * (1.0 + x)).ravel(), (half * weight).ravel()
