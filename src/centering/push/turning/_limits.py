"""Limits of speed and acceleration of the table with an offset ring on it, Mears (3.1) to (3.9)."""

from collections.abc import Callable, Mapping
from math import cos, hypot, inf, pi, sin, sqrt
from typing import NamedTuple

from scipy.optimize import brentq

from centering._problem.model import GRAVITY
from centering._problem.problem import CenteringProblem
from centering.push._profile.timing import rest_to_rest
from centering.push.turning._lead import too_fast
from centering.push.turning._rim_kernels import advance, greatest, motion
from centering.push.turning._sliding import ring_friction
from sdpgrind.base import checks
from sdpgrind.base.quantities import forgotten

_SLOWEST = 0.01  # chosen: share of the greatest speed; a converted speed below it was not meant
_PLACES = 24  # chosen: samples of the search for a minimum; the functions have one or two in the interval
_GOLDEN = (sqrt(5.0) - 1.0) / 2.0  # derived: golden section
_SECTIONS = 36  # chosen: golden sections; they give the place to 1e-8 of a step, the value to rounding
_ROUNDING = 1e-9  # chosen: relative excess of a speed over its limit that is rounding
_SAMPLES = 60  # chosen: readings per turn; they give the offset to a few percent of a reading's noise


class SpeedLimit(NamedTuple):
    """Greatest speed of the table, and its cause.

    Attributes
    ----------
    value : float
        Greatest speed, rad/s.
    reason : str
        Key in `all` of the smallest limit.
    all : mapping
        Limits, rad/s: ``friction`` (the ring would slide, Mears (3.8)), ``slide_speed`` and
        ``slide_acceleration`` (of following the rim), ``samples`` (in a turn), ``push`` (the rim would arrive
        before the push), ``table``.
    """

    value: float
    reason: str
    all: Mapping[str, float]


class RimMotion(NamedTuple):
    """Distance of the rim from the axis on the push line, with its derivatives by the angle of the table.

    Attributes
    ----------
    distance, slope, curvature : float
        Mears (3.1), mm; mm/rad, times the spindle speed the speed, Mears (3.2); mm/rad^2.
    """

    distance: float
    slope: float
    curvature: float


def rim_motion(angle: float, *, offset: float, radius: float) -> RimMotion:
    """Return distance, slope and curvature of the rim on the push line, Mears (3.1) and (3.2).

    Parameters
    ----------
    angle : float
        Angle of the table since the offset was on the push line, rad.
    offset, radius : float
        Of the ring, mm; the offset is the smaller.

    Raises
    ------
    ValueError
        When the offset is not in [0, radius).

    Examples
    --------
    >>> rim_motion(0.0, offset=10.0, radius=50.0)
    RimMotion(distance=60.0, slope=-0.0, curvature=-12.0)
    """
    d, r = _offset(offset, radius)
    return RimMotion(*motion(checks.number("angle", angle, "rad"), d, r))


def max_rim_slope(*, offset: float, radius: float) -> float:
    """Return the greatest speed of the rim per speed of the table, mm; it exceeds the offset, Mears (3.3).

    Parameters
    ----------
    offset, radius : float
        Of the ring, mm; the offset is the smaller.

    Raises
    ------
    ValueError
        When the offset is not in [0, radius).

    Examples
    --------
    >>> from sdpgrind import units
    >>> slope = max_rim_slope(offset=25.0, radius=30.0)
    >>> round(slope, 5), round(slope * units.rpm(42.2916), 2)  # mm, mm/s
    (34.861, 154.39)
    """
    d, r = _offset(offset, radius)
    return float(greatest(d, r, 1))


def closing_distance(
    *, offset: float, radius: float, spindle_speed: float, slide_speed: float, acceleration: float
) -> float:
    """Return the loss of distance to the rim while an approaching slide brakes and withdraws, mm.

    The worst phase of the rim counts. Mears (3.5) brakes the sum of both speeds at the slide's acceleration
    (`stopping_way`), as if the slide could withdraw as fast as the rim comes: too large where it can, too
    small where its speed is lower.

    Parameters
    ----------
    offset, radius, spindle_speed : float
        Of the ring, mm; speed of the table, rad/s.
    slide_speed, acceleration : float
        Speed of the approach and greatest one of the withdrawal, mm/s; acceleration of the slide, mm/s^2.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from sdpgrind import units
    >>> speed = units.rpm(42.2916)
    >>> slide = {"slide_speed": 120.0, "acceleration": 2560.0}  # mm/s, mm/s^2
    >>> round(closing_distance(offset=25.0, radius=30.0, spindle_speed=speed, **slide), 3)  # mm
    15.586
    """
    d, r = _offset(offset, radius)
    w = checks.positive("spindle_speed", spindle_speed, "rad/s")
    v = checks.positive("slide_speed", slide_speed, "mm/s")
    a = checks.positive("acceleration", acceleration, "mm/s^2")

    def slide(t: float) -> float:
        turned = min(t, 2.0 * v / a)
        return v * turned - a * turned * turned / 2.0 - v * (t - turned)

    def nearest(start: float) -> float:
        begin = advance(start, d, r)
        return _least(lambda t: advance(start + w * t, d, r) - begin - slide(t), 0.0, pi / w)

    return -_least(nearest, -pi, pi)


def spindle_speed_limit(
    problem: CenteringProblem,
    *,
    offset: float,
    samples_per_turn: int = _SAMPLES,
    push_speed: float | None = None,
    follow_gap: float | None = None,
) -> SpeedLimit:
    """Return the greatest speed of the table with an offset ring, Mears (3.7) to (3.9) and more.

    Parameters
    ----------
    problem : CenteringProblem
        Model and limits.
    offset : float
        Offset of the ring, mm.
    samples_per_turn : int
        Least number of readings in a turn.
    push_speed : float, optional
        Speed of a push, mm/s, that must begin in time from `follow_gap`. None: no such limit.
    follow_gap : float, optional
        Distance from the rim to the pusher tip, mm. Default: that of the limits.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from centering import preset
    >>> limit = spindle_speed_limit(preset("printed").replace(mu_static=0.06, mu_kinetic=0.05), offset=25.0)
    >>> limit.reason, round(limit.value * 60 / (2 * pi), 2), round(limit.all["slide_speed"], 3)  # rpm, rad/s
    ('slide_speed', 44.14, 4.622)
    """
    checks.kind("problem", problem, CenteringProblem)
    d, r = _offset(offset, problem.model.part.radius)
    limits = problem.limits
    turn = 2.0 * pi / (checks.count("samples_per_turn", samples_per_turn) * limits.sample_time)
    every = {
        "table": limits.spindle_speed_max,
        "samples": turn,
        "friction": friction_limit(problem.model.mu_static, d),
    }
    every["slide_speed"] = limits.slide_speed_max / greatest(d, r, 1) if d else inf
    every["slide_acceleration"] = sqrt(limits.acceleration_max / greatest(d, r, 2)) if d else inf
    if push_speed is not None:
        gap = limits.follow_gap if follow_gap is None else checks.positive("follow_gap", follow_gap, "mm")
        every["push"] = _push_limit(
            problem, d, gap - limits.safety, checks.positive("push_speed", push_speed, "mm/s")
        )
    reason = min(every, key=lambda name: every[name])
    return SpeedLimit(every[reason], reason, every)


def friction_limit(mu: float, d: float) -> float:
    """Speed at which a ring at an offset `d` would slide off, Mears (3.8), rad/s."""
    return sqrt(mu * GRAVITY / d) if d else inf


def check_speed(problem: CenteringProblem, offset: float, spindle_speed: float) -> None:
    """Refuse a table that is too fast for the offset."""
    limit = spindle_speed_limit(problem, offset=offset)
    if spindle_speed > limit.value * (1.0 + _ROUNDING):
        rule = f"<= {limit.value:.5g} at an offset of {offset:g} mm ({limit.reason.replace('_', ' ')})"
        meant = forgotten(spindle_speed, "rad/s", (_SLOWEST * limit.value, limit.value), limit.value)
        raise too_fast("spindle_speed", rule, spindle_speed, f"rad/s{meant}")


def spindle_acceleration_limit(problem: CenteringProblem, *, offset: float, spindle_speed: float) -> float:
    """Return the greatest acceleration of the table without slip of an offset ring, rad/s^2.

    0: the ring slips already. The table gives the ring's centre the acceleration hypot(w^2 d, alpha d), and
    the ring, of inertia M R^2, the angular acceleration alpha. A ring of even pressure bears a force F and a
    moment T up to the curve of `ring_friction`; it slips when (hypot(w^2 d, alpha d), alpha R)/(mu_s g) is on
    the curve. For a ring near the axis that is alpha = mu_s g/R.

    Parameters
    ----------
    problem : CenteringProblem
        Its model: friction and part.
    offset, spindle_speed : float
        Of ring and table, mm, rad/s.

    Raises
    ------
    ValueError
        When a value is out of range.

    Examples
    --------
    >>> from centering import preset
    >>> problem = preset("printed")
    >>> round(spindle_acceleration_limit(problem, offset=0.0, spindle_speed=5.0), 3)  # 0.2 x 9807/89.5
    21.915
    >>> round(spindle_acceleration_limit(problem, offset=10.0, spindle_speed=10.0), 3)
    16.457
    """
    checks.kind("problem", problem, CenteringProblem)
    d, r = _offset(offset, problem.model.part.radius)
    w, most = checks.nonnegative("spindle_speed", spindle_speed, "rad/s"), problem.model.mu_static * GRAVITY
    if w * w * d >= most:
        return 0.0

    def beyond(slip: float) -> float:
        friction = ring_friction(cos(slip), sin(slip))
        alpha = friction.moment * most / r
        return hypot(w * w * d, alpha * d) / most - friction.force

    if beyond(pi / 2) <= 0.0:
        return most / r
    slip = float(brentq(beyond, 0.0, pi / 2, xtol=1e-12))
    return ring_friction(cos(slip), sin(slip)).moment * most / r


def _offset(offset: float, radius: float) -> tuple[float, float]:
    d, r = checks.nonnegative("offset", offset, "mm"), checks.positive("radius", radius, "mm")
    if d >= r:
        raise checks.refuse("offset", f"< radius = {r:g}, or the probe finds no part", d, "mm")
    return d, r


def _least(f: Callable[[float], float], low: float, high: float) -> float:
    """Least value in an interval: the best of 25 samples, refined by golden sections."""
    step = (high - low) / _PLACES
    best = min((f(low + k * step), low + k * step) for k in range(_PLACES + 1))[1]
    a, b = max(best - step, low), min(best + step, high)
    c, d = b - _GOLDEN * (b - a), a + _GOLDEN * (b - a)
    at_c, at_d = f(c), f(d)
    for _ in range(_SECTIONS):
        if at_c < at_d:
            b, d, at_d = d, c, at_c
            c = b - _GOLDEN * (b - a)
            at_c = f(c)
        else:
            a, c, at_c = c, d, at_d
            d = a + _GOLDEN * (b - a)
            at_d = f(d)
    return min(at_c, at_d, f(best))


def _push_limit(problem: CenteringProblem, d: float, room: float, v: float) -> float:
    """Speed at which a push aligned at its end leaves the approach no room, rad/s."""
    limits = problem.limits
    if room < 0.0 or advance(pi, d, problem.model.part.radius) <= room:
        return inf if room >= 0.0 else 0.0
    most = float(
        brentq(lambda angle: advance(angle, d, problem.model.part.radius) - room, 0.0, pi, xtol=1e-12)
    )
    return most / (limits.settle_time + rest_to_rest(d + limits.safety, v, limits.acceleration_max))
