"""Area of a surface by Gauss points per knot span, doubled until convergence."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.base.quadrature import leggauss
from sdpgrind.finishing.surface import _forms as forms
from sdpgrind.finishing.surface._derivatives import Differentiable

POINTS = (8, 16, 32, 64)  # chosen: Gauss points per knot span, each way
SETTLED = 1e-13  # chosen: relative change by the last doubling at convergence


class PatchArea(NamedTuple):
    """An area and its change by the last doubling of points, mm^2."""

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
    """Nodes and weights of Gauss's rule with `points` in each interval between neighbouring `ends`."""
    x, weight = leggauss(points)
    half = 0.5 * np.diff(ends)[:, None]
    return (ends[:-1, None] + half * (1.0 + x)).ravel(), (half * weight).ravel()
