"""Placement of the surface in the base: a shift, and a turn about z or none."""

import math
from collections.abc import Sequence

import numpy as np

from sdpgrind.base.checks import Floats


def turned(vectors: Floats, angle: float) -> Floats:
    """Return vectors (..., 3), or the columns of rotations, turned about z by an angle, rad."""
    c, s = math.cos(angle), math.sin(angle)
    out: Floats = vectors @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return out


def placed(poses: Floats, placement: Sequence[float]) -> Floats:
    """Return poses (m, 4, 4) in the frame of the surface, mm, as poses in the base."""
    x, y, z, *turn = placement
    out = poses.copy()
    if turn:
        columns = np.swapaxes(poses[:, :3, :], -1, -2)
        out[:, :3, :] = np.swapaxes(turned(columns, turn[0]), -1, -2)
    out[:, :3, 3] += np.array([x, y, z])
    return out
