"""Ring that slides and spins to rest, and the initial speeds for a wanted place, Mears (2.6) to (2.9).

The ring rests on the table with even pressure along its circle. Friction of size mu_k against the local slip
gives a force and a moment that depend only on the ratio of sliding and spinning: derivatives of the mean slip
speed, which is a complete elliptic integral.
"""

from functools import cache
from math import atan2, ceil, cos, exp, hypot, log, pi, sin, sqrt, tan
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1

from centering._problem.model import GRAVITY, PushModel
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

_SMALL = 0.02  # chosen: speed ratio below which the closed form loses digits and the series is exact
_SERIES = (0.5, 1.0 / 16.0, 3.0 / 128.0, 25.0 / 2048.0)  # derived: expansion of the elliptic integrals
_LOCKED = 1e-8  # rad, chosen: distance from equal speeds, the end of every slide, at which integration ends
_PIECE, _PLACES = 20.0, 96  # chosen: longest piece of u and its places; leave 1e-12 of a slide
_EDGE = 1e-9  # rad, chosen: distance from a pure slide and a pure spin at which the search ends


class RingFriction(NamedTuple):
    """Friction of a ring that slides and spins.

    Attributes
    ----------
    force, moment : float
        Against the slide, over mu M g; against the spin, over mu M g R; dimensionless.
    """

    force: float
    moment: float


class RingSlide(NamedTuple):
    """Motion of a ring until it rests, Mears (2.8) and (2.9).

    Attributes
    ----------
    distance, turn, time : float
        Of the slide, mm, rad, s.
    """

    distance: float
    turn: float
    time: float


class RingLaunch(NamedTuple):
    """Initial speeds of a slide.

    Attributes
    ----------
    speed, spin : float
        Of the centre, mm/s; angular, rad/s.
    """

    speed: float
    spin: float


def ring_friction(speed: float, rim_speed: float) -> RingFriction:
    """Return force and moment of friction of a ring that slides and spins.

    Parameters
    ----------
    speed, rim_speed : float
        Speed of the centre, and radius times spin, mm/s; >= 0 and not both 0. Only their ratio matters.

    Raises
    ------
    ValueError
        When a speed is < 0 or both are 0.

    Examples
    --------
    >>> ring_friction(1.0, 0.0), [round(share, 6) for share in ring_friction(1.0, 1.0)]
    (RingFriction(force=1.0, moment=0.0), [0.63662, 0.63662])
    """
    v, s = checks.nonnegative("speed", speed, "mm/s"), checks.nonnegative("rim_speed", rim_speed, "mm/s")
    if v == 0.0 and s == 0.0:
        raise checks.refuse("speed", "> 0 where the ring does not spin", v, "mm/s")
    faster = max(v, s)
    return RingFriction(*_shares(v / faster, s / faster))


def slide_to_rest(model: PushModel, *, speed: float, spin: float) -> RingSlide:
    """Return the motion to rest of a thin ring that slides and spins freely, Mears (2.6) to (2.9).

    Viscous friction is left out.

    Parameters
    ----------
    model : PushModel
        Kinetic friction and radius.
    speed, spin : float
        Initial speeds, mm/s and rad/s.

    Raises
    ------
    ValueError
        When the speed is < 0.

    Examples
    --------
    >>> from centering import preset
    >>> model = preset("printed").model
    >>> slide_to_rest(model, speed=100.0, spin=0.0).distance == 100.0**2 / (2 * 0.15 * 9807.0)
    True
    >>> round(slide_to_rest(model, speed=100.0, spin=2.0).distance, 4)  # mm
    8.732
    """
    checks.kind("model", model, PushModel)
    v, w = checks.nonnegative("speed", speed, "mm/s"), checks.number("spin", spin, "rad/s")
    braking, r = model.mu_kinetic * GRAVITY, model.part.radius
    rim = abs(w) * r
    if rim == 0.0 or v == 0.0:
        return RingSlide(v * v / (2 * braking), w * abs(w) * r / (2 * braking), (v + rim) / braking)
    size = hypot(v, rim)
    distance, turn, time = _unit_slide(v / size, rim / size)
    way = size * size / braking
    return RingSlide(distance * way, float(np.sign(w)) * turn * way / r, time * size / braking)


def launch_for(model: PushModel, *, distance: float, turn: float) -> RingLaunch:
    """Return the speeds with which a thin ring slides a distance and turns by an angle.

    Parameters
    ----------
    model : PushModel
        Kinetic friction and radius.
    distance, turn : float
        Wanted distance and angle, mm and rad.

    Raises
    ------
    ValueError
        When the distance is < 0.

    Examples
    --------
    >>> from centering import preset
    >>> model = preset("printed").model
    >>> launch = launch_for(model, distance=5.0, turn=0.05)
    >>> slide = slide_to_rest(model, speed=launch.speed, spin=launch.spin)
    >>> round(slide.distance, 9), round(slide.turn, 9)
    (5.0, 0.05)
    """
    checks.kind("model", model, PushModel)
    x, theta = checks.nonnegative("distance", distance, "mm"), checks.number("turn", turn, "rad")
    braking, r = model.mu_kinetic * GRAVITY, model.part.radius
    along = abs(theta) * r
    if along == 0.0 or x == 0.0:
        return RingLaunch((2 * braking * x) ** 0.5, float(np.sign(theta)) * (2 * braking * along) ** 0.5 / r)

    def off(angle: float) -> float:
        far, turned, _ = _unit_slide(cos(angle), sin(angle))
        return turned * x - far * along

    angle = (
        float(brentq(off, _EDGE, pi / 2 - _EDGE, xtol=1e-14))
        if off(_EDGE) < 0 < off(pi / 2 - _EDGE)
        else _nearest(x, along)
    )
    far, turned, _ = _unit_slide(cos(angle), sin(angle))
    size = (braking * hypot(x, along) / hypot(far, turned)) ** 0.5
    less = x * turned / (far * along)  # than the root gives, of a motion that is small and goes as its speed
    v, s = (cos(angle) * less, sin(angle)) if x < along else (cos(angle), sin(angle) / less)
    return RingLaunch(size * v, float(np.sign(theta)) * size * s / r)


def _nearest(x: float, along: float) -> float:
    """Angle of the speed ratio where one of both motions nearly vanishes."""
    return _EDGE if along < x else pi / 2 - _EDGE


def _shares(v: float, s: float) -> tuple[float, float]:
    """Derivatives of the mean slip speed by both speeds."""
    if v <= _SMALL * s:
        return _series(v / s), (_mean(v, s) - v * _series(v / s)) / s
    if s <= _SMALL * v:
        return (_mean(v, s) - s * _series(s / v)) / v, _series(s / v)
    mean, apart = _mean(v, s), (v - s) * (v + s)
    inverse = 2.0 / (pi * (v + s)) * float(ellipkm1(((v - s) / (v + s)) ** 2)) if apart else 0.0
    return (mean + apart * inverse) / (2.0 * v), (mean - apart * inverse) / (2.0 * s)


def _mean(v: float, s: float) -> float:
    """Mean slip speed along the ring."""
    parameter = min(4.0 * v * s / (v + s) ** 2, 1.0)  # rounding makes it more where both are nearly equal
    return 2.0 / pi * (v + s) * float(ellipe(parameter))


def _series(e: float) -> float:
    return e * (_SERIES[0] + e * e * (_SERIES[1] + e * e * (_SERIES[2] + e * e * _SERIES[3])))


def _unit_slide(v: float, s: float) -> tuple[float, float, float]:
    """Distance, rim's turn and time of a slide with v^2 + s^2 = 1 and friction deceleration 1.

    The angle of (v, s) tends to 45 degrees from any start. The slide is integrated over u = ln tan(2 angle),
    along which all slopes are smooth, from nearly pure to equal speeds; it ends in a straight line.
    """
    if s > v:
        turn, distance, time = _unit_slide(s, v)
        return distance, turn, time
    y, angle = np.zeros(4), atan2(s, v)
    if angle < pi / 4 - _LOCKED:
        y = _to_equal_speeds(log(tan(2.0 * angle)))
    size, mean = exp(y[0]), _mean(sqrt(0.5), sqrt(0.5))
    rest = size * size * sqrt(0.5) / (2.0 * mean)
    return float(y[1] + rest), float(y[2] + rest), float(y[3] + size / mean)


def _to_equal_speeds(start: float) -> Floats:
    """Changes of log speed, distance, turn and time from one u to nearly equal speeds, piece by piece."""
    end, y = log(tan(pi / 2 - 2.0 * _LOCKED)), np.zeros(4)
    ends = np.linspace(start, end, ceil((end - start) / _PIECE) + 1)
    for first, last in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        size = exp(y[0])
        y += np.array([1.0, size * size, size * size, size]) * _changes(first, last)
    return y


def _changes(first: float, last: float) -> Floats:
    """Changes of log speed, distance, turn and time over a piece of u, for a first speed of 1."""
    places, running = _integration()
    half = 0.5 * (last - first)
    angle = np.arctan(np.exp(first + half * (places + 1.0))) / 2.0
    c, s = np.cos(angle), np.sin(angle)
    force, moment = np.array([_shares(*each) for each in zip(c.tolist(), s.tolist(), strict=True)]).T
    stretch = half * np.sin(4.0 * angle) / (4.0 * (force * s - moment * c))
    slower = running @ (-(force * c + moment * s) * stretch)
    passed = np.exp(slower) * stretch
    moved = running[-1] @ np.stack([passed * np.exp(slower) * c, passed * np.exp(slower) * s, passed], axis=1)
    return np.array([slower[-1], *moved])


@cache
def _integration() -> tuple[Floats, Floats]:
    """Chebyshev places in [-1, 1], and the matrix of integrals of a function from -1 to each of them."""
    places = -np.cos(pi * np.arange(_PLACES + 1) / _PLACES)
    integrals = chebyshev.chebval(places, chebyshev.chebint(np.eye(_PLACES + 1), lbnd=-1))
    return places, integrals.T @ np.linalg.inv(chebyshev.chebvander(places, _PLACES))
