"""Minimum-zone, circumscribed and inscribed cylinders: successive linear programs on true distances.

With the axis at a place, a program on linearised distances moves it within a box; true distances decide
whether the step is taken, and how large the next box is. Where they bend too much, a curved step is tried.
A program begins with few points and takes on those that it violates, until there are none.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import linprog

from centering.roundness._cylinder_curved import curved_step
from centering.roundness._cylinder_surface import CylinderPoints, distances, slopes
from sdpgrind.base.checks import Bools, Floats

Indices = npt.NDArray[np.int64]

CURVED = 1e-6  # chosen: mm, second order that the certificate allows; 1 nm is below what a tester shows
_TOLERANCE = 1e-10  # derived: least tolerance that HiGHS takes; lengths are in units of the range about LSC
_VIOLATED = 1e-9  # chosen: the same, of points that are taken on
_ENOUGH = 1e-8  # chosen: improvement that is still sought, in the same unit: 5e-11 mm of 5 um
_ROUNDS, _STEPS = 100, 80  # chosen: programs of one step, and steps, at most; measured: 5 in 4, most 36 in 23
_FIRST = 4.0  # chosen: first box in ranges about the least-squares cylinder; the centre moves by less
_POOR, _GOOD = 0.25, 0.75  # chosen: true over promised improvement below and above which the box changes
_FAR = 0.25  # chosen: move over the radius beyond which nothing holds the cylinder
_FLAT = 1e-9  # chosen: least unit of length over the radius: a perfect cylinder has no range


class Zone(NamedTuple):
    """Place of the axis, bound of the width or radius (mm) within reach (mm), contacts, outer ones."""

    place: Floats
    bound: float
    reach: float
    contacts: Indices
    outer: Bools


class _Sides(NamedTuple):
    """Whether the outer and the inner cylinder count: both for the zone."""

    outer: bool
    inner: bool

    def width(self, distance: Floats) -> float:
        """What is made small, mm: width, outer radius, or the negative inner one."""
        return self.outer * float(distance.max()) - self.inner * float(distance.min())


class _Found(NamedTuple):
    """Step (mm), width that it promises (mm), points that hold it, whether they are outer, their prices."""

    step: Floats
    width: float
    contacts: Indices
    outer: Bools
    prices: Floats


SIDES = {"MZC": _Sides(True, True), "MCC": _Sides(True, False), "MIC": _Sides(False, True)}


def zone(surface: CylinderPoints, place: Floats, kind: str) -> Zone:
    """Cylinder of a kind from the least-squares place on."""
    sides, distance = SIDES[kind], distances(surface, place)
    radius = float(distance.mean())
    unit = max(float(np.ptp(distance)), _FLAT * radius)
    working = _Working(surface, sides, unit)
    place = _descended(working, place, radius)
    reach = reach_of(radius, surface.half)
    last = working.program(place, reach)
    return Zone(place, last.width, reach, last.contacts, last.outer)


def reach_of(radius: float, half: float) -> float:
    """Move of the ends of the axis, mm, at which second order is `CURVED`.

    Seen along the axis, points at r move by d across, |d| <= e, and the other axis is tilted by t <= e/half
    against it: r (1 - t^2/2) <= |r - d| <= r - d_r + e^2/(2 r), to third order. A zone, which has both,
    misses e^2 (1/(2 r) + r/(2 half^2)).
    """
    return float(np.sqrt(CURVED / (0.5 / radius + 0.5 * radius / half**2)))


def _descended(working: "_Working", place: Floats, radius: float) -> Floats:
    """Place from which no program promises more, or the last of many."""
    box, start = _FIRST * working.unit, place
    width = working.width(place)
    for _ in range(_STEPS):
        found = working.program(place, box)
        promised = width - found.width
        if promised <= _ENOUGH * working.unit:
            break
        step, tried = _better_step(working, place, found, width - _GOOD * promised, box)
        gained = (width - tried) / promised
        if gained > 0:
            place, width = place + step, tried
        box *= 0.25 if gained < _POOR else 2.0 if gained > _GOOD else 1.0
        if np.abs(place - start).max() > _FAR * radius:
            raise ValueError("readings must hold the cylinder from all sides; nothing fixes its axis")
    return place


def _better_step(
    working: "_Working", place: Floats, found: _Found, enough: float, box: float
) -> tuple[Floats, float]:
    """Step of a program and its true width (mm); a curved one where that is not enough, and better."""
    tried = working.width(place + found.step)
    if tried <= enough:
        return found.step, tried
    contacts = working.surface.only(found.contacts)
    step = curved_step(contacts, place, found.outer, found.prices, box)
    curved = working.width(place + step)
    return (step, curved) if curved < tried else (found.step, tried)


class _Working:
    """Points of a linear program, kept from step to step."""

    def __init__(self, surface: CylinderPoints, sides: _Sides, unit: float) -> None:
        self.surface, self.sides, self.unit = surface, sides, unit
        self.high = self.low = np.empty(0, dtype=np.int64)
        self._bands = _bands(surface.z)

    def width(self, place: Floats) -> float:
        """True width at a place, mm."""
        return self.sides.width(distances(self.surface, place))

    def program(self, place: Floats, box: float) -> _Found:
        """Best step within a box (mm), with all points."""
        distance, slope = slopes(self.surface, place)
        level = float(distance.mean())
        height = (distance - level) / self.unit
        self._take_on(height, -np.inf, np.inf)
        for _ in range(_ROUNDS):
            x, marginals = self._solved(height, slope, box / self.unit)
            moved, top, bottom = height + slope @ x[:4], x[4], x[5]
            if not self._take_on(moved, top + _VIOLATED, bottom - _VIOLATED):
                break
        width = self.unit * (top * self.sides.outer - bottom * self.sides.inner) + level * (
            self.sides.outer - self.sides.inner
        )
        held = np.flatnonzero(marginals < 0)
        both = np.concatenate([self.high, self.low])
        outer = held < self.high.size
        return _Found(self.unit * x[:4], float(width), both[held], outer, -marginals[held])

    def _take_on(self, height: Floats, top: float, bottom: float) -> bool:
        """Take on the highest and the lowest point of each band beyond the limits; whether there were any."""
        before = self.high.size + self.low.size
        if self.sides.outer:
            self.high = np.union1d(self.high, _beyond(height, top, self._bands))
        if self.sides.inner:
            self.low = np.union1d(self.low, _beyond(-height, -bottom, self._bands))
        return self.high.size + self.low.size > before

    def _solved(self, height: Floats, slope: Floats, box: float) -> tuple[Floats, Floats]:
        """Step, top and bottom of the program with the points at hand, and the prices of its rows."""
        high, low = self.high, self.low
        rows = np.zeros((high.size + low.size, 6))
        rows[: high.size, :4], rows[: high.size, 4] = slope[high], -1.0
        rows[high.size :, :4], rows[high.size :, 5] = -slope[low], 1.0
        limits = np.concatenate([-height[high], height[low]])
        cost = np.array([0.0, 0.0, 0.0, 0.0, float(self.sides.outer), -float(self.sides.inner)])
        free = [(None, None) if each else (0.0, 0.0) for each in self.sides]
        options = {"primal_feasibility_tolerance": _TOLERANCE, "dual_feasibility_tolerance": _TOLERANCE}
        found = linprog(
            cost, rows, limits, bounds=[(-box, box)] * 4 + free, method="highs-ds", options=options
        )
        if found.status != 0:
            raise RuntimeError(f"HiGHS must solve a bounded program; got: {found.message}")
        return found.x, found.ineqlin.marginals


def _bands(z: Floats) -> list[Indices]:
    """Points of bands of height, of about equal numbers."""
    count = min(8, z.size // 6)  # chosen: bands; as many points each way enter a program at once
    return np.array_split(np.argsort(z, kind="stable"), count)


def _beyond(height: Floats, limit: float, bands: list[Indices]) -> Indices:
    """Highest point of each band above a limit."""
    highest = np.array([band[np.argmax(height[band])] for band in bands])
    return np.asarray(highest[height[highest] > limit])
