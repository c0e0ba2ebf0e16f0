"""Minimum-zone, circumscribed and inscribed cylinders: successive linear programs on true distances.

With the axis at a place, a program on linearised distances moves it within a box; true distances decide
whether the step is taken, and how large the next box is. Where they bend too much, a curved step is tried.
A program begins with few points and takes on those that it violates, until there are none.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from centering.roundness._cylinder_curved import curved_step
from centering.roundness._cylinder_surface import CylinderPoints, distances, slopes
from centering.roundness._program_kernels import program
from sdpgrind.base.checks import Bools, Floats

Indices = npt.NDArray[np.int64]

CURVED = 1e-6  # chosen: mm, second order that the certificate allows; 1 nm is below what a tester shows
_ENOUGH = 1e-8  # chosen: improvement that is still sought over the range about LSC: 5e-11 mm of 5 um
_STEPS = 80  # chosen: steps at most; measured: 4, most 32
_HOLDS = 1e-9  # chosen: least price of a point that holds the cylinder; all of one side add up to 1
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


class _Working(NamedTuple):
    """Points, sides that count, and the unit of length of programs, mm."""

    surface: CylinderPoints
    sides: _Sides
    unit: float

    def width(self, place: Floats) -> float:
        """True width at a place, mm."""
        return self.sides.width(distances(self.surface, place))

    def program(self, place: Floats, box: float) -> _Found:
        """Best step within a box (mm), with all points."""
        distance, slope = slopes(self.surface, place)
        level, sides, rows = float(distance.mean()), self.sides, np.empty(6, dtype=np.int64)
        height = (distance - level) / self.unit
        x, prices, solved = program(height, slope, box / self.unit, *sides, rows)
        if not solved:
            raise RuntimeError("the linear program of a cylinder must end; its rows say nothing new")
        width = self.unit * (x[4] * sides.outer - x[5] * sides.inner) + level * (sides.outer - sides.inner)
        held = (rows < 2 * height.size) & (prices > _HOLDS)
        contacts, outer = rows[held] % height.size, rows[held] < height.size
        return _Found(self.unit * x[:4], float(width), contacts, outer, prices[held])
