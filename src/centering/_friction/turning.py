"""A push on a turning table as a push along a line: the tip's speed along the contact normal, the rim's own advance included."""

from math import ceil, cos, hypot, sin, sqrt

import numpy as np

from centering._push.profile import TipProfile
from sdpgrind.base import checks

_TURN = 0.05  # rad of the table, from one piece to the next: the error of a speed is then below 1e-4 of the rim's
_STANDS = 1e-9  # s: after the end the tip stands against the part, or goes on leaving it


def turning_profile(profile: TipProfile, *, offset: float, touch_angle: float, spindle_speed: float, radius: float) -> TipProfile:
    """Return how a tip moves against a part on a turning table, along the contact normal and in the table's frame.

    What `FrictionEstimator` must be given of a push on a table that turns: the table carries the part against the tip, so that it
    is pushed farther and faster than the slide moves. Mears has no such term. Quasi-static: c' = w J c + s n with
    s = -n . w J c - v n_x, c the centre, n the normal from the tip to it; s is the speed that is returned, linear from piece to
    piece. Left out: what the table's turning adds in force, M w^2 offset, and the part's slide ahead of the tip; both are small
    at 20 rpm. After the profile the tip stands against the part, so give it with its way back.

    Parameters
    ----------
    profile : TipProfile
        The slide from first touch on, positive toward the axis (mm, s), as `Push.push_profile`.
    offset : float
        Distance of the part's centre from the axis at first touch, mm.
    touch_angle : float
        Angle by which the centre is before the line of push at first touch, rad, as `Touch.angle`.
    spindle_speed : float
        rad/s.
    radius : float
        Of the part, mm; greater than the offset.

    Raises
    ------
    ValueError, TypeError
        When a value is out of range, or the profile does not begin at first touch.

    Examples
    --------
    >>> push = TipProfile.constant_speed(10.0, 0.1)
    >>> still = turning_profile(push, offset=1.0, touch_angle=0.1, spindle_speed=0.0, radius=89.5)
    >>> turning = turning_profile(push, offset=1.0, touch_angle=0.1, spindle_speed=2.0, radius=89.5)
    >>> round(still.end, 4), round(turning.end, 4)  # mm: the rim comes against the tip before alignment, and recedes behind it
    (1.0, 1.0071)
    """
    checks.kind("profile", profile, TipProfile)
    if profile.start != 0:
        raise checks.refuse("profile.start", "0: it begins at first touch", profile.start, "mm")
    w, r = checks.number("spindle_speed", spindle_speed, "rad/s"), checks.positive("radius", radius, "mm")
    d, angle = checks.nonnegative("offset", offset, "mm"), checks.number("touch_angle", touch_angle, "rad")
    if d >= r:
        raise checks.refuse("offset", f"< the radius of the part = {r:g}", d, "mm")
    x, y = d * cos(angle), -d * sin(angle)
    tip = x + sqrt(r * r - y * y)
    rows: list[tuple[float, float, float]] = []
    for duration, speed, acceleration in profile.segments.tolist():
        pieces = ceil(abs(w) * duration / _TURN) or 1
        step = duration / pieces
        for k in range(pieces):
            v = speed + acceleration * step * k
            x, y, tip, row = _piece(x, y, tip, w, v, acceleration, step)
            rows.append(row)
    rows.append((_STANDS, min(rows[-1][1] + rows[-1][2] * rows[-1][0], 0.0), 0.0))
    return TipProfile(*np.array(rows).T)


def _piece(
    x: float, y: float, tip: float, w: float, v: float, a: float, step: float
) -> tuple[float, float, float, tuple[float, float, float]]:
    """Centre and tip after a step (a midpoint rule), and the piece of the profile."""
    first, u_x, u_y = _closing(x, y, tip, w, v)
    half = 0.5 * step
    middle = tip - v * half - 0.5 * a * half * half
    _, u_x, u_y = _closing(x + half * u_x, y + half * u_y, middle, w, v + a * half)
    x, y, tip = x + step * u_x, y + step * u_y, tip - v * step - 0.5 * a * step * step
    last, _, _ = _closing(x, y, tip, w, v + a * step)
    return x, y, tip, (step, first, (last - first) / step)


def _closing(x: float, y: float, tip: float, w: float, v: float) -> tuple[float, float, float]:
    """Speed of the tip along the normal against the table, and the velocity of a centre that is pushed so."""
    away = hypot(x - tip, y)
    n_x, n_y = (x - tip) / away, y / away
    s = -w * (n_y * x - n_x * y) - v * n_x
    pushed = max(s, 0.0)
    return s, -w * y + pushed * n_x, w * x + pushed * n_y
