"""Rotations of the table in measurements by the filter of the controller: before a push, and at the end."""

from copy import deepcopy
from functools import lru_cache
from math import ceil, cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from centering._problem.problem import CenteringProblem, PushScatter
from centering.cycle._measuring.form import RingFilter
from centering.cycle._measuring.settings import CycleSettings
from sdpgrind.base.checks import Floats

FEWEST = 4  # derived: three readings fix a circle, a fourth its uncertainty
USUAL = CycleSettings()
SEEMS = 2.0  # chosen: tolerances within which a part looks as if it were centred
_BETWEEN = pi  # rad, derived: mean rotation from a push to the next, whose direction is uniform
_LONGEST = 2.0 * pi * USUAL.turns_in_doubt  # rad, derived: then a part in doubt is pushed
_EVERY = 4  # chosen: readings between two looks at what they say, once there are many
_MANY = 12  # chosen: readings below which each is looked at; fewer delay the first answer, more cost time
_MOST = 1000  # chosen: readings of a place; more take long, and the filter keeps a quarter of them
_USUAL_START = 0.5  # derived: mean offset of parts before the first push, over the greatest
_ASIDE = 0.25 * pi  # rad, derived: direction of a part at first where errors of the angle count by their mean
_ENDS = 9  # chosen: offsets of a centred part in a table


class PlaceErrors(NamedTuple):
    """Errors of a place by the rotation of the table since a push, for as many pushes as there were before.

    Attributes
    ----------
    arc : array, (A,)
        Rotation, rad.
    sd, band : array, (A,)
        Standard deviation of the centre, and half width of its 99.9 % interval, mm; they fall.
    """

    arc: Floats
    sd: Floats
    band: Floats

    def until_known(self, wanted: Floats) -> Floats:
        """Return the rotations (rad) after which the standard deviation is as small as wanted (mm)."""
        return _until(self.arc, self.sd, wanted)

    def until_outside(self, beyond: Floats) -> Floats:
        """Return the rotations (rad) after which parts so far beyond the tolerance (mm) certainly are so."""
        return _until(self.arc, USUAL.doubt * self.band, beyond)

    def until_centred(self, offset: float, tolerance: float) -> float:
        """Return the rotation (rad) after which a part at an offset (mm) is certainly within a tolerance, mm.

        Its measured offset is longer on average, by the error of the centre.
        """
        told = np.hypot(offset, self.sd) + USUAL.doubt * self.band
        return float(_until(self.arc, told, np.array([tolerance]))[0])


def _until(arc: Floats, error: Floats, wanted: Floats) -> Floats:
    """Rotations at the first look at which an error is as small as wanted; the longest one where none is."""
    first = np.searchsorted(-np.minimum.accumulate(error), -wanted)
    return np.asarray(arc[np.minimum(first, arc.size - 1)])


def looks(samples: int, looked: int) -> bool:
    """Return whether to look at what so many samples say, of which so many had been looked at."""
    return samples >= FEWEST and (samples < _MANY or samples - looked >= _EVERY)


def push_scatter(scatter: PushScatter, offset: Floats | float) -> Floats:
    """Return the scatter (sd, mm) of a push at an offset (mm): a part known as well is pushed."""
    own = np.hypot(scatter.stop_sd, scatter.measuring_sd)
    return np.asarray(np.hypot(scatter.direction_sd * np.asarray(offset), own))


def push_arcs(problem: CenteringProblem, offsets: Floats, measured: PlaceErrors) -> Floats:
    """Return the rotations (rad) before a push of parts at offsets (mm).

    The place is known as well as the push needs, and the part is certainly out of the tolerance.
    """
    known = measured.until_known(push_scatter(problem.scatter, offsets))
    doubt = measured.until_outside(np.abs(offsets - problem.tolerance))
    return np.maximum(known, np.where(offsets <= SEEMS * problem.tolerance, doubt, 0.0))


def final_arcs(problem: CenteringProblem, finish: float, measured: PlaceErrors) -> Floats:
    """Return the rotations (rad) after which parts at offsets of 0 to `finish` (mm) certainly are centred."""
    ends = np.linspace(0.0, finish, _ENDS).tolist()
    return np.array([measured.until_centred(offset, problem.tolerance) for offset in ends])


@lru_cache(maxsize=64)
def places(
    problem: CenteringProblem, speed: float, rate: float, first: float, pushes: int
) -> tuple[PlaceErrors, ...]:
    """Return errors after 0 to `pushes` pushes; radius and form become known from place to place.

    The table runs up at a rate (rad/s^2) to a speed (rad/s); it turns by `first` (rad) until the first push.
    Kept for further plans of a problem, and for those from files: each asks eight times, which takes 0.2 s of
    CPU time (measured).
    """
    noise = max(problem.scatter.measuring_sd, USUAL.noise_sd)
    radius, prior = problem.model.part.radius, (USUAL.radius_sd, USUAL.form_sd)
    ring = RingFilter(radius, *prior, noise, USUAL.angle_sd, USUAL.tip_radius)
    sample = problem.limits.sample_time
    even = speed * sample * _thinned(_LONGEST / (speed * sample))
    run_up = _run_up(speed, rate, sample)
    found, offset = [], _USUAL_START * problem.offset_max
    for n in range(pushes + 1):
        arcs, ends = (run_up, first) if n == 0 else (even, _BETWEEN)
        readings = _PlaceReadings.of(n * _BETWEEN + arcs, offset, radius, noise)
        place, ring = _place(ring, readings, ends)
        found.append(place)
        offset = float(push_scatter(problem.scatter, offset))
    return tuple(found)


class _PlaceReadings(NamedTuple):
    """Readings of a place: angles (rad), rims (mm), and the centre (mm)."""

    angle: Floats
    rim: Floats
    center: tuple[float, float]

    @classmethod
    def of(cls, angle: Floats, offset: float, radius: float, noise: float) -> "_PlaceReadings":
        """Readings of a part at an offset (mm), whose errors alternate; those of the angle are among them."""
        direction = angle[0] + _ASIDE
        along, across = offset * np.cos(angle - direction), offset * np.sin(angle - direction)
        rolled = radius + USUAL.tip_radius
        error = np.hypot(noise, USUAL.angle_sd * across)
        error[1::2] *= -1.0
        rim = along + np.sqrt(rolled**2 - across**2) - USUAL.tip_radius - error
        return cls(angle, rim, (offset * cos(direction), offset * sin(direction)))


def _run_up(speed: float, rate: float, sample: float) -> Floats:
    """Angles (rad) of readings while a table runs up from rest at a rate (rad/s^2) to a speed (rad/s)."""
    ramp = speed / rate
    reached = 0.5 * speed * ramp < _LONGEST
    until = 0.5 * ramp + _LONGEST / speed if reached else sqrt(2.0 * _LONGEST / rate)
    times = sample * _thinned(until / sample)
    return np.where(times < ramp, 0.5 * rate * times**2, speed * (times - 0.5 * ramp))


def _thinned(count: float) -> Floats:
    """Numbers of so many readings, of which each n-th is taken."""
    return np.arange(0.0, count, ceil(count / _MOST))


def _place(ring: RingFilter, readings: _PlaceReadings, ends: float) -> tuple[PlaceErrors, RingFilter]:
    """Errors of one place by its readings, and the filter moved where a rotation ends."""
    angles, looked, rows, later = readings.angle, 0, [], ring
    last = int(np.searchsorted(angles, angles[0] + ends))
    for k, (angle, rim) in enumerate(zip(angles.tolist(), readings.rim.tolist(), strict=True)):
        ring.take(angle, rim, True)
        if looks(k + 1, looked):
            looked = k + 1
            ring.look(readings.center)
            turned = angle - angles[0] if looked > FEWEST else 0.0  # the fewest readings take time, no angle
            rows.append((turned, ring.sd, ring.band))
        if k == last:
            ring.look()
            later = deepcopy(ring)
            later.moved()
    return PlaceErrors(*np.array(rows).T), later
