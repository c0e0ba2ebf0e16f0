"""Distances of points from an axis that may be tilted, and their slopes over the place of the axis."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats


class CylinderPoints(NamedTuple):
    """Points of a cylinder, (n,), mm: x, y, and z from the middle height, with that and half of the length.

    A `place` of an axis is its displacement at the middle height, (x, y), and by its tilt at the upper end,
    (half u, half v): four lengths in mm that move readings alike.
    """

    x: Floats
    y: Floats
    z: Floats
    middle: float
    half: float

    @classmethod
    def of(cls, points: Floats) -> "CylinderPoints":
        """Take points, (n, 3), mm."""
        x, y, z = points.T
        middle, half = float(z.max() + z.min()) / 2, float(np.ptp(z)) / 2
        return cls(x, y, z - middle, middle, half)

    def only(self, kept: npt.NDArray[np.int64]) -> "CylinderPoints":
        """Some of the points."""
        return self._replace(x=self.x[kept], y=self.y[kept], z=self.z[kept])

    def axis_of(self, place: Floats) -> Floats:
        """Axis (x, y, u, v) through (x, y, 0) along (u, v, 1) of a place."""
        tilt = place[2:] / self.half
        return np.concatenate([place[:2] - tilt * self.middle, tilt])

    def place_of(self, axis: Floats) -> Floats:
        """Place of an axis (x, y, u, v)."""
        return np.concatenate([axis[:2] + axis[2:] * self.middle, axis[2:] * self.half])


def axis_distances(points: Floats, axis: Floats) -> Floats:
    """Distances of points, (n, 3), from an axis (x, y, u, v), mm."""
    x, y, z = points.T
    surface = CylinderPoints(x, y, z, 0.0, 1.0)
    return distances(surface, surface.place_of(axis))


def distances(surface: CylinderPoints, place: Floats) -> Floats:
    """Distances of the points from the axis at a place, mm."""
    across, up, along, _ = perpendiculars(surface, place)
    return np.asarray(np.hypot(np.hypot(across, up), along))


def slopes(surface: CylinderPoints, place: Floats) -> tuple[Floats, Floats]:
    """Distances (mm), and their derivatives over the place, (n, 4), unit 1."""
    across, up, along, foot = perpendiculars(surface, place)
    distance = np.hypot(np.hypot(across, up), along)
    level = -np.column_stack([across, up]) / distance[:, np.newaxis]
    return distance, np.column_stack([level, level * (foot / surface.half)[:, np.newaxis]])


def perpendiculars(surface: CylinderPoints, place: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Perpendicular from the axis to each point, (x, y, z), and the height of its foot, mm.

    With a = (x, y) of the point about the axis at its own height and t = (u, v), the foot lies s/D higher,
    s = a t and D = 1 + t t: the perpendicular is (a - t s/D, -s/D).
    """
    u, v = place[2:] / surface.half
    a, b = surface.x - place[0] - u * surface.z, surface.y - place[1] - v * surface.z
    higher = (a * u + b * v) / (1 + u * u + v * v)
    return a - u * higher, b - v * higher, -higher, surface.z + higher
