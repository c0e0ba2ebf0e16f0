"""Plane through points, and the least rectangle in it that holds them."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

# of the greatest extent, chosen: less is a line, or what rounding leaves of one
THIN = 1e-6


class Plane(NamedTuple):
    """A corner (3,) and the sides of a rectangle, mm; rows of `axes` (3, 3): along them, and the normal."""

    corner: Floats
    sides: Floats
    axes: Floats

    def parameters(self, points: Floats) -> Floats:
        """Return the places (2, m) of points (m, 3) over the rectangle, each in [0, 1]."""
        at = (self.axes[:2] @ (points - self.corner).T) / self.sides[:, None]
        return np.ascontiguousarray(np.clip(at, 0.0, 1.0))


def plane_of(points: Floats, side: Floats | None) -> Plane:
    """Plane of least squares, with its normal to the side of the tool, and the rectangle of least area."""
    centre = points.mean(axis=0)
    # the triangle of QR has the singular values and axes of all points
    _, extents, axes = np.linalg.svd(np.linalg.qr(points - centre, mode="r"))
    if extents[1] <= THIN * extents[0]:
        raise ValueError(f"points must not lie on a line (mm); they do, near {written(points[0])}")
    normal = _to_the_side(np.cross(axes[0], axes[1]), side)
    across = np.cross(normal, axes[0])
    along = _long_side((points - centre) @ np.stack([axes[0], across]).T)
    frame = np.stack([along[0] * axes[0] + along[1] * across, along[0] * across - along[1] * axes[0], normal])
    at = (points - centre) @ frame[:2].T
    low = at.min(axis=0)
    return Plane(centre + low @ frame[:2], np.ptp(at, axis=0), frame)


def written(point: Floats) -> str:
    """Return a point as a message shows it."""
    return f"({', '.join(f'{x:.6g}' for x in point)})"


def _to_the_side(normal: Floats, side: Floats | None) -> Floats:
    """The normal or its opposite: towards `side`, else upwards, else along the greatest of x and y."""
    if side is None:
        told = normal[2] if abs(normal[2]) > THIN else normal[np.abs(normal).argmax()]
    else:
        told = float(normal @ side)
        if abs(told) <= THIN * np.linalg.norm(side):
            raise checks.refuse(
                "side", f"a direction away from the points' plane, whose normal is {written(normal)}", side
            )
    return normal if told > 0 else -normal


def _long_side(at: Floats) -> Floats:
    """Direction (2,) of the longer side of the least rectangle around points (m, 2); an edge lies on it."""
    hull = at[ConvexHull(at).vertices]
    edges = np.diff(hull, axis=0, append=hull[:1])
    along = edges / np.linalg.norm(edges, axis=1)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    length, width = (np.ptp(each @ hull.T, axis=1) for each in (along, across))
    best = int((length * width).argmin())
    return np.asarray(along[best] if length[best] >= width[best] else across[best])
