"""True optimum of a grinding process at a wear flat area: the greatest infeed rate without burning."""

from math import exp, log
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from sdpgrind.base.checks import Floats
from sdpgrind.locus.processes._grinding import Grinding

_LOOKED_AT = 13  # chosen: rotations on a logarithmic scale; fewer could miss the highest maximum
_EXACT = 1e-7  # chosen: error of the logarithm of the rotation; about 1e-14 of the rate, flat at its maximum


class Ranges(NamedTuple):
    """Limits of a machine: greatest infeed rate (mm/s), least and greatest work rotation (rad/s)."""

    infeed_rate_max: float
    work_rotation_min: float
    work_rotation_max: float


def best_point(process: Grinding, ranges: Ranges, wear_flat_area: float) -> tuple[float, float]:
    """Return the greatest burn-free infeed rate (mm/s; 0: none) and its work rotation (rad/s)."""

    def lost(log_rotation: float) -> float:
        return -process.burn_free_rates(exp(log_rotation), wear_flat_area)[1]

    places = np.linspace(log(ranges.work_rotation_min), log(ranges.work_rotation_max), _LOOKED_AT)
    found = [lost(place) for place in places]
    first = int(np.argmin(found))
    around = places[max(0, first - 1)], places[min(_LOOKED_AT - 1, first + 1)]
    peak = minimize_scalar(lost, bounds=around, method="bounded", options={"xatol": _EXACT})
    value, place = min((float(peak.fun), float(peak.x)), (float(found[first]), float(places[first])))
    return min(-value, ranges.infeed_rate_max), exp(place)


def best_rates(process: Grinding, ranges: Ranges, areas: Floats) -> Floats:
    """Return the best rates (mm/s) of close areas, interpolated by a parabola of logarithms; NaN: burning."""
    low, high = float(areas.min()), float(areas.max())
    if high - low <= 1e-12 * high:
        return np.full(areas.shape, best_point(process, ranges, high)[0] or np.nan)
    nodes = np.array([low, 0.5 * (low + high), high])
    rates = np.array([best_point(process, ranges, area)[0] or np.nan for area in nodes])
    if np.isnan(rates).any():
        return np.full(areas.shape, np.nan)
    return np.asarray(np.exp(np.polynomial.Polynomial.fit(nodes, np.log(rates), 2)(areas)))
