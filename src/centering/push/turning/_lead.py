"""Lead of the slide's start before the offset is on the push line, Mears (5.1) to (5.17)."""

from collections.abc import Callable
from math import floor, pi
from typing import NamedTuple

from scipy.optimize import brentq

from centering.push.turning._rim_kernels import advance
from sdpgrind.base import checks

TURN = 2.0 * pi
_ANGLE = 1e-12  # rad, chosen: accuracy of a lead, four digits below 1e-6 deg


class TooFastError(ValueError):
    """Table too fast for a push: the rim arrives first, or the ring slides off. A slower table helps."""


def too_fast(name: str, rule: str, value: float, unit: str) -> TooFastError:
    """Return the error of a value that a slower table allows, in the words of `checks.refuse`."""
    return TooFastError(str(checks.refuse(name, rule, value, unit)))


class Lead(NamedTuple):
    """Start of the slide, and its travel before the push.

    Attributes
    ----------
    lead_angle : float
        Angle from the start of the slide to the offset's alignment with the push line, rad; may exceed pi.
    lead_distance : float
        Advance of the rim toward the tip during the lead, d_lead of Mears (5.5), mm.
    rough : float
        Travel of the rapid approach, mm.
    turns : int
        Whole turns of waiting beyond the next half turn; 0 where lead_angle <= pi.
    """

    lead_angle: float
    lead_distance: float
    rough: float
    turns: int


def rim_advance(angle: float, *, offset: float, radius: float) -> float:
    """Return the advance of the rim toward the axis-side tip until alignment, d_lead of Mears (5.5), mm.

    Parameters
    ----------
    angle : float
        Angle until the offset is on the push line, rad.
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
    """Solve lead = speed x (time of the approach, which depends on the lead) + `after` (rad).

    `room` (mm) is the travel of the approach for a rim at rest. The difference of both sides rises with the
    lead up to half a turn: at most one root, found by bracketing. Beyond, the rim recedes again, and the part
    waits for its next turn.
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
    """Lead at which the rim leaves nothing to approach, at most pi, rad."""
    if room < 0.0:
        raise TooFastError(
            f"rough must be >= 0 (mm); got {room:.4g} for a rim that stands still: open the gap"
        )
    if advance(pi, d, r) <= room:
        return pi
    return _root(lambda alpha: advance(alpha, d, r) - room, 0.0, pi)


def _late(most: float, offset: float) -> str:
    return (
        f"less at an offset of {offset:g} mm, where no lead up to {most * 180 / pi:.4g} deg leaves room for"
        " the approach: the rim arrives before the push; slow the spindle or open the gap"
    )
