"""Exact transformation of the tip's centre from the spindle frame to the part frame and back.

The tip radius is negative for a bore read from within: the tip's centre is then nearer to the axis than the
surface.
"""

import numpy as np

from centering.circle._fit.estimate import CircleEstimate
from centering.circle._fit.fit import fit_circle
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


def circle_of(angle: Floats, reading: Floats, tip_radius: float) -> CircleEstimate:
    """The part's circle; in a bore the path of the tip's centre is smaller by the tip's radius."""
    if tip_radius >= 0:
        return fit_circle(angle, reading, tip_radius=tip_radius)
    if reading.min() <= -tip_radius:
        raise checks.refuse(
            "tip_radius", f"< {reading.min():.6g}, the smallest reading in a bore", -tip_radius, "mm"
        )
    inner = fit_circle(angle, reading + tip_radius)
    return inner.replace(value=inner.value - np.array([tip_radius, 0.0, 0.0]), tip_radius=tip_radius)


def tip_centers(angle: Floats, reading: Floats, tip_radius: float) -> Floats:
    """Centres of the tip about the spindle, (n, 2), mm."""
    return np.asarray((reading + tip_radius)[:, np.newaxis] * np.column_stack([np.cos(angle), np.sin(angle)]))


def into_part(angle: Floats, reading: Floats, tip_radius: float, center: Floats) -> tuple[Floats, Floats]:
    """Part angle (rad, turns kept) and distance (mm) of the tip's centre from the part's `center`."""
    x, y = (tip_centers(angle, reading, tip_radius) - center).T
    return _near(np.arctan2(y, x), angle), np.hypot(x, y)


def from_part(
    part_angle: Floats, distance: Floats, tip_radius: float, center: Floats
) -> tuple[Floats, Floats]:
    """Spindle angle (rad, turns kept) and reading (mm) of a tip's centre; inverse of `into_part`."""
    x = center[0] + distance * np.cos(part_angle)
    y = center[1] + distance * np.sin(part_angle)
    return _near(np.arctan2(y, x), part_angle), np.hypot(x, y) - tip_radius


def _near(direction: Floats, angle: Floats) -> Floats:
    """The direction plus the whole turns that bring it nearest to the angle."""
    return np.asarray(angle + np.remainder(direction - angle + np.pi, 2 * np.pi) - np.pi)
