"""From points to circles with their proofs: the exchange, what its contacts prove, and a search where that is not enough."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from centering._roundness.branch_kernels import search
from centering._roundness.direction_kernels import gaps
from centering._roundness.distance_kernels import extremes
from centering._roundness.lsc_kernels import algebraic_centre, least_squares_circle
from centering._roundness.mcc_kernels import smallest_circle
from centering._roundness.mic_kernels import empty_circle
from centering._roundness.mzc_kernels import zone
from centering._roundness.proof_kernels import ball, empty_reach, steepness, zone_reach
from sdpgrind.base.checks import Bools, Floats

Indices = npt.NDArray[np.int64]

ROUNDING = 16 * float(np.finfo(float).eps)
"""Of a distance, relative to the size of the profile."""
SLACK = 1e-12
"""By which no centre is better, relative to the radius, where a search has proved it."""
WORK = 10_000_000
"""Points that a search looks at, at most: a second or so."""
HALF_TURN = np.pi + np.radians(1.0)
"""Largest gap, rad: centres of half a turn of points are off by their form and noise, so that a degree is let pass."""


class Found(NamedTuple):
    """A circle, about the mean of the points (mm), and what is proved of it."""

    center: tuple[float, float]
    radius: float
    bound: float
    certificate: str
    contacts: Indices = np.empty(0, dtype=np.int64)
    outer: Bools = np.empty(0, dtype=bool)


def start_centre(x: Floats, y: Floats) -> tuple[float, float]:
    """Centre (mm) to begin from; refuse points on a line and those of less than half a turn about it."""
    cx, cy = algebraic_centre(x, y)
    if np.isinf(cx):
        raise ValueError("points must go around a circle; they lie on a line")
    gap = gaps(x, y, cx, cy)[0]
    if gap > HALF_TURN:
        swept = np.degrees(2 * np.pi - gap)
        raise ValueError(f"points must cover at least 180 deg about their circle; they cover {swept:.4g} deg")
    return cx, cy


def least_squares(x: Floats, y: Floats) -> Found:
    """LSC: the sum of squared deviations is least."""
    cx, cy, radius, bends = least_squares_circle(x, y, *start_centre(x, y))
    across, up = x - cx, y - cy
    rms = float(np.sqrt(np.mean((np.sqrt(across * across + up * up) - radius) ** 2)))
    told = "the sum of squares is level at this centre" + (", and bends upwards in every direction" if bends else "")
    return Found((cx, cy), radius, rms, told)


def circumscribed(x: Floats, y: Floats) -> Found:
    """MCC: the smallest circle that holds all points."""
    start_centre(x, y)
    basis = np.zeros(3, dtype=np.int64)
    cx, cy, radius, bound, size = smallest_circle(x, y, _tolerance(x, y), basis)
    held = "two contacts are ends of a diameter" if size == 2 else "three contacts stand about the centre"
    told = f"no point lies outside, and {held}: no smaller circle holds these alone"
    return Found((cx, cy), radius, bound, told, basis[:size], np.full(size, True))


def inscribed(x: Floats, y: Floats) -> Found:
    """MIC: the largest circle with no point inside, its centre among the points."""
    tolerance, basis = _tolerance(x, y), np.zeros(4, dtype=np.int64)
    cx, cy, radius, held = empty_circle(x, y, *start_centre(x, y), tolerance, basis)
    outer = extremes(x, y, cx, cy)[1]
    reach = empty_reach(radius, outer, gaps(x, y, cx, cy)[0])
    proved = ball(steepness(x, y, cx, cy, basis, False), radius) if held else 0.0
    told = (
        f"three contacts stand about the centre: no centre within {proved:.3g} mm is better; beyond {reach:.3g} mm all are worse"
    )
    bound = radius
    if reach > proved:
        start, hull = np.array([cx, cy, -radius, held]), ConvexHull(np.column_stack([x, y])).equations
        cx, cy, low, below, free, held = search(x, y, False, start, reach, tolerance, SLACK * outer, WORK, basis, hull)
        radius, bound = -low, -below
        if not held or free < low - SLACK * outer:
            raise ValueError(
                f"points must hold the inscribed circle from all sides; one of {max(radius, -free):.6g} mm can leave by a gap"
            )
        told = _searched(reach, bound - radius)
    return Found((cx, cy), radius, bound, told, basis[:3], np.full(3, False))


def minimum_zone(x: Floats, y: Floats) -> Found:
    """MZC: the two concentric circles, closest together, that hold all points between them."""
    tolerance, basis = _tolerance(x, y), np.zeros(4, dtype=np.int64)
    cx, cy, width, held = zone(x, y, *start_centre(x, y), tolerance, basis)
    inner = extremes(x, y, cx, cy)[3]
    largest, second, _ = gaps(x, y, cx, cy)
    reach = zone_reach(width, inner, largest, second)
    proved = ball(steepness(x, y, cx, cy, basis, True), inner) if held else 0.0
    told = _held("contacts alternate, two outer and two inner", proved, reach)
    bound = width
    if reach > proved:
        start = np.array([cx, cy, width, held])
        cx, cy, width, bound, _, held = search(x, y, True, start, reach, tolerance, SLACK * inner, WORK, basis, np.empty((0, 3)))
        told = _searched(reach, width - bound)
    far, most, near, least = extremes(x, y, cx, cy)
    contacts = basis if held else np.array([far, near])
    outer = np.array([True, True, False, False] if held else [True, False])
    return Found((cx, cy), 0.5 * (most + least), bound, told, contacts, outer)


def _held(how: str, proved: float, reach: float) -> str:
    """What contacts prove."""
    return f"{how}: no centre within {proved:.3g} mm is better; beyond {reach:.3g} mm all are worse"


def _searched(reach: float, left: float) -> str:
    """What a search proves."""
    return f"all centres within {reach:.3g} mm were searched: none is better by more than {left:.2g} mm; beyond all are worse"


def _tolerance(x: Floats, y: Floats) -> float:
    """Rounding of a distance, mm."""
    return ROUNDING * float(np.abs(x).max() + np.abs(y).max())
