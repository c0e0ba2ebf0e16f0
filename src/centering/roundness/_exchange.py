"""Reference circles with certificates: exchange, proof by contacts, search where these prove too little."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from centering.roundness._branch_kernels import ALIKE, search
from centering.roundness._direction_kernels import gaps
from centering.roundness._distance_kernels import extremes
from centering.roundness._lsc_kernels import algebraic_centre, least_squares_circle
from centering.roundness._mcc_kernels import smallest_circle
from centering.roundness._mic_kernels import empty_circle
from centering.roundness._mzc_kernels import zone
from centering.roundness._proof_kernels import ball, empty_reach, steepness, zone_reach
from sdpgrind.base.checks import Bools, Floats

Indices = npt.NDArray[np.int64]

ROUNDING = 16 * float(np.finfo(float).eps)
"""Rounding of a distance, relative to the size of the profile; chosen: some operations of half a unit
each."""
SLACK = 1e-12  # chosen: improvement, relative to the radius, that a search excludes
COARSE = 1e-5  # chosen: the same of a second search, where ties make the first one too long
WORK, ZONE_WORK, COARSE_WORK = 100_000, 1_000_000, 600_000
"""Largest number of points evaluated in a search; measured: some 20 to 100 ms."""
LET_PASS = np.radians(1.0)
"""Arc, rad, that may be missing from half a turn, as form and noise shift the centre; chosen."""
FORM = 6.0  # chosen: the same, in widths of the profile over its radius; without form nothing may be missing
_APART = 1e-3  # chosen: distance of equally good optima, over the radius, that the certificate mentions


class ExchangeFound(NamedTuple):
    """Circle about the mean of the points (mm), bound (mm), certificate, contacts, flags of outer ones."""

    center: tuple[float, float]
    radius: float
    bound: float
    certificate: str
    contacts: Indices = np.empty(0, dtype=np.int64)
    outer: Bools = np.empty(0, dtype=bool)


def rounding(x: Floats, y: Floats) -> float:
    """Rounding of a distance, mm."""
    return ROUNDING * float(np.abs(x).max() + np.abs(y).max())


def start_centre(x: Floats, y: Floats) -> tuple[float, float]:
    """First centre (mm); raises for points on a line or on less than half a turn about it."""
    cx, cy = algebraic_centre(x, y)
    if np.isinf(cx):
        raise ValueError("points must go around a circle; they lie on a line")
    gap = gaps(x, y, cx, cy)[0]
    if gap > np.pi * (1 + 1e-9):
        _, most, _, least = extremes(x, y, cx, cy)
        if gap > np.pi * (1 + 1e-9) + min(FORM * (most - least) / most, LET_PASS):
            swept = np.degrees(2 * np.pi - gap)
            raise ValueError(
                f"points must cover at least 180 deg about their circle; they cover {swept:.4g} deg"
            )
    return cx, cy


def least_squares(x: Floats, y: Floats) -> ExchangeFound:
    """LSC: least sum of squared deviations."""
    cx, cy, radius, bends = least_squares_circle(x, y, *start_centre(x, y))
    across, up = x - cx, y - cy
    rms = float(np.sqrt(np.mean((np.sqrt(across * across + up * up) - radius) ** 2)))
    sentence = (
        "no centre beside this one has a smaller sum of squares: its slope is 0 here, and it rises in every"
        " direction"
        if bends
        else "the slope of the sum of squares over the place of the centre is 0 here"
    )
    return ExchangeFound((cx, cy), radius, rms, sentence)


def circumscribed(x: Floats, y: Floats) -> ExchangeFound:
    """MCC: smallest circle that contains all points."""
    start_centre(x, y)
    basis = np.zeros(3, dtype=np.int64)
    cx, cy, radius, bound, size = smallest_circle(x, y, rounding(x, y), basis)
    held = "two contacts are ends of a diameter" if size == 2 else "three contacts stand about the centre"
    sentence = f"no point lies outside, and {held}: no smaller circle holds these alone"
    return ExchangeFound((cx, cy), radius, bound, sentence, basis[:size], np.full(size, True))


def inscribed(x: Floats, y: Floats) -> ExchangeFound:
    """MIC: largest circle without a point inside, its centre among the points."""
    tolerance, basis = rounding(x, y), np.zeros(4, dtype=np.int64)
    cx, cy, radius, held = empty_circle(x, y, *start_centre(x, y), tolerance, basis)
    outer = extremes(x, y, cx, cy)[1]
    reach = empty_reach(radius, outer, gaps(x, y, cx, cy)[0])
    proved = ball(steepness(x, y, cx, cy, basis, False), radius) if held else 0.0
    sentence = (
        f"three contacts stand about the centre: no centre within {proved:.3g} mm is better;"
        f" beyond {reach:.3g} mm all among the points are worse"
    )
    bound = radius
    if reach > proved:
        start, hull = np.array([cx, cy, -radius, held, outer]), ConvexHull(np.column_stack([x, y])).equations
        best = _search(x, y, False, start, reach, basis, hull)
        (cx, cy), radius, bound = best.center, -best.height, -best.below
        if not best.held or best.free < best.height - SLACK * outer:
            freed = max(radius, -best.free)
            hold = "points must hold the inscribed circle from all sides"
            raise ValueError(f"{hold}; one of {freed:.6g} mm can leave by a gap")
        searched = f"all centres within {reach:.3g} mm were searched"
        sentence = f"{searched}: {best.sentence}; beyond all among the points are worse"
    return ExchangeFound((cx, cy), radius, bound, sentence, basis[:3], np.full(3, False))


def minimum_zone(x: Floats, y: Floats) -> ExchangeFound:
    """MZC: two concentric circles, closest together, with all points between them."""
    tolerance, basis = rounding(x, y), np.zeros(4, dtype=np.int64)
    cx, cy, width, held = zone(x, y, *start_centre(x, y), tolerance, basis)
    inner = extremes(x, y, cx, cy)[3]
    largest, second, _ = gaps(x, y, cx, cy)
    reach = zone_reach(width, inner, largest, second)
    proved = ball(steepness(x, y, cx, cy, basis, True), inner) if held else 0.0
    within = f"{0.5 * inner:.3g} mm, half the inner radius"
    sentence = f"contacts alternate, two outer and two inner: no centre within {within}, is better"
    bound = width
    if reach > proved:
        best = _search(x, y, True, np.array([cx, cy, width, held, inner]), reach, basis, np.empty((0, 3)))
        (cx, cy), width, bound, held = best.center, best.height, best.below, best.held
        sentence = f"all centres within {within}, were searched or are worse: {best.sentence}"
    far, most, near, least = extremes(x, y, cx, cy)
    contacts = basis if held else np.array([far, near])
    outer = np.array([True, True, False, False] if held else [True, False])
    return ExchangeFound((cx, cy), 0.5 * (most + least), bound, sentence, contacts, outer)


class _Best(NamedTuple):
    """Best centre (mm) of a search: height, lower bound, least height of a free circle, held, sentence."""

    center: tuple[float, float]
    height: float
    below: float
    free: float
    held: bool
    sentence: str


def _search(
    x: Floats, y: Floats, zone: bool, start: Floats, reach: float, basis: Indices, hull: Floats
) -> _Best:
    """Search all centres within reach, and again coarsely where ties make that too long."""
    tolerance, size = rounding(x, y), start[4]
    found = search(
        x, y, zone, start, reach, tolerance, SLACK * size, ZONE_WORK if zone else WORK, basis, hull
    )
    apart = float(np.hypot(found[7] - found[6], found[9] - found[8]))
    if found[2] - found[3] > 2 * SLACK * size:
        again = np.array([*found[:3], found[5], size])
        wider = reach + float(np.hypot(*(found[:2] - start[:2])))
        once_more = search(x, y, zone, again, wider, tolerance, COARSE * size, COARSE_WORK, basis, hull)
        once_more[3] = min(max(once_more[3], found[3]), once_more[2])
        found = once_more
    cx, cy, height, below, free, held = found[:6].tolist()
    below = max(below, 0.0 if zone else -size)
    sentence = f"none is better by more than {height - below:.2g} mm"
    if apart > _APART * size:
        alike = f"others up to {apart:.3g} mm apart are as good to {ALIKE * size:.1g} mm"
        sentence = f"{sentence}; {alike}, so that nothing fixes the centre"
    return _Best((cx, cy), height, below, free, bool(held), sentence)
