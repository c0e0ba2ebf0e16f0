"""The four reference cylinders of points, with what is proved of each."""

import numpy as np

from centering.roundness._cylinder import CYLINDERS, Cylinder
from centering.roundness._cylinder_ls import least_squares
from centering.roundness._cylinder_surface import CylinderPoints, distances
from centering.roundness._cylinder_zone import CURVED, SIDES, zone
from centering.roundness._exchange import LET_PASS
from centering.roundness._sampling import widest_gap
from sdpgrind.base import checks, units
from sdpgrind.base.checks import Floats


def reference_cylinder(points: Floats, kind: str, tip_radius: float) -> Cylinder:
    """Cylinder of a kind about points (n, 3), mm, of a tip's centre; the tip is negative in a bore."""
    checks.one_of("kind", kind, CYLINDERS)
    surface = CylinderPoints.of(points)
    place, radius = least_squares(surface)
    _refuse_arc(surface, place)
    if kind == "LSC":
        return _least_squares(surface, place, radius, points, tip_radius)
    return _extreme(surface, place, kind, points, tip_radius)


def _least_squares(
    surface: CylinderPoints, place: Floats, radius: float, points: Floats, tip_radius: float
) -> Cylinder:
    rms = float(np.sqrt(np.mean((distances(surface, place) - radius) ** 2)))
    return Cylinder(
        "LSC", surface.axis_of(place), radius - tip_radius, np.empty(0, np.int64), np.empty(0, np.bool_),
        rms, 0.0, points, tip_radius, "local: the slope of the sum of squares over the axis is 0 here",
    )  # fmt: skip


def _extreme(
    surface: CylinderPoints, start: Floats, kind: str, points: Floats, tip_radius: float
) -> Cylinder:
    """Minimum zone, circumscribed or inscribed cylinder from the least-squares place on."""
    found, sides = zone(surface, start, kind), SIDES[kind]
    distance = distances(surface, found.place)
    most, least = float(distance.max()), float(distance.min())
    radius = (sides.outer * most + sides.inner * least) / (sides.outer + sides.inner)
    bound = found.bound if kind == "MZC" else abs(found.bound) - tip_radius
    order = np.argsort(found.contacts)
    better = max(sides.width(distance) - found.bound, 0.0) + CURVED
    sentence = (
        f"local, no global proof: while both ends of the axis stay within"
        f" {found.reach / units.um(1.0):.3g} µm, no cylinder is better by more than {better:.2g} mm"
    )
    return Cylinder(
        kind, surface.axis_of(found.place), radius - tip_radius, found.contacts[order], found.outer[order],
        bound, found.reach, points, tip_radius, sentence,
    )  # fmt: skip


def _refuse_arc(surface: CylinderPoints, place: Floats) -> None:
    """Refuse points on less than half a turn about the axis."""
    shift = place[:2, np.newaxis] + place[2:, np.newaxis] * (surface.z / surface.half)
    gap = widest_gap(np.arctan2(surface.y - shift[1], surface.x - shift[0]))
    if gap > np.pi + LET_PASS:
        swept = np.degrees(2 * np.pi - gap)
        raise ValueError(
            f"readings must cover at least 180 deg about their cylinder; they cover {swept:.4g} deg"
        )
