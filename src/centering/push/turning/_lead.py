"""When the slide must start so that the offset is on the push line in time: lead and approach, Mears (5.1) to (5.17)."""

from collections.abc import Callable
from math import floor, pi
from typing import NamedTuple

from scipy.optimize import brentq

from centering.push.turning._rim_kernels import advance
from sdpgrind.base import checks

TURN = 2.0 * pi
_ANGLE = 1e-12  # rad, chosen: below the asked 1e-6 deg by four digits


class TooFastError(ValueError):
    """The table is too fast for a push: the rim arrives first, or the ring slides off. A slower one cures it."""


def too_fast(name: str, rule: str, value: float, unit: str) -> TooFastError:
    """Return the refusal of a value that a slower table cures, as `checks.refuse` words it."""
    return TooFastError(str(checks.refuse(name, rule, value, unit)))


class Lead(NamedTuple):
    """When the slide starts, and how far it goes before the push.

    Attributes
    ----------
    lead_angle : float
        From the start of the slide until the offset is on the push line, rad; beyond pi the start is so long before.
    lead_distance : float
        Advance of the rim toward the tip in that time, d_lead of Mears (5.5), mm.
    rough : float
        Travel of the rapid approach, mm.
    turns : int
        Whole turns to wait beyond the next half turn: 0 where lead_angle <= pi.
    """

    lead_angle: float
    lead_distance: float
    rough: float
    turns: int


def rim_advance(angle: float, *, offset: float, radius: float) -> float:
    """Return how far the rim comes toward the axis-side tip until the offset is on the push line, d_lead of Mears (5.5), mm.

    Parameters
    ----------
    angle : float
        From now until then, rad.
    offset, radius : float
        Of the part, mm; the offset is the smaller.

    Raises
    ------
    ValueError
        When the offset is not in [0, radius).

    Examples
    --------
    >>> from math import radians
    >>> round(rim_advance(radians(30.0), offset=10.0, radius=61.94), 4)  # mm
    1.5419
    """
    d, r = checks.nonnegative("offset", offset, "mm"), checks.positive("radius", radius, "mm")
    if d >= r:
        raise checks.refuse("offset", f"< radius = {r:g}", d, "mm")
    return float(advance(checks.number("angle", angle, "rad"), d, r))


def find_lead(
    rough_time: Callable[[float], float],
    after: float,
    *,
    offset: float,
    radius: float,
    room: float,
    spindle_speed: float,
) -> Lead:
    """Solve lead = speed x (time of the approach, which depends on the lead) + `after` (rad) by a bracketed root; `room` in mm.

    `room` is the travel of the approach for a rim that does not come nearer. The difference of both sides grows with the lead up
    to half a turn, so that there is one root at most; beyond, the rim recedes again, and the part waits for its next turn.
    """
    w = spindle_speed

    def late(alpha: float) -> float:
        return alpha - w * rough_time(max(room - advance(alpha, offset, radius), 0.0)) - after

    most = _greatest_lead(offset, radius, room)
    if late(most) >= 0.0:
        alpha = _root(late, 0.0, most)
    elif most < pi:
        raise too_fast("spindle_speed", _late(most, offset), w, "rad/s")
    else:
        alpha = _root(late, pi, after + w * rough_time(room))
    lead = float(advance(alpha, offset, radius))
    return Lead(alpha, lead, max(room - lead, 0.0), floor((alpha + pi) / TURN) if alpha > pi else 0)


def _root(f: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(f, low, high, xtol=_ANGLE, rtol=1e-14))


def _greatest_lead(d: float, r: float, room: float) -> float:
    """Lead at which the rim has come so near that nothing is left to approach, at most pi, rad."""
    if room < 0.0:
        raise TooFastError(
            f"rough must be >= 0 (mm); got {room:.4g} for a rim that stands still: open the gap"
        )
    if advance(pi, d, r) <= room:
        return pi
    return _root(lambda alpha: advance(alpha, d, r) - room, 0.0, pi)


def _late(most: float, offset: float) -> str:
    return (
        f"less at an offset of {offset:g} mm, where no lead up to {most * 180 / pi:.4g} deg leaves room for the approach:"
        " the rim arrives before the push; slow the spindle or open the gap"
    )
