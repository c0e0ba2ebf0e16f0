"""What a contact asks of a robot, wherever in a box the origin of the work lies, and however it is turned.

A place s in the frame of the surface lies on a circle about z, whatever the turn: at the distance |s_xy| from
the origin, at its height. From an origin at the distance g from axis 1 it gets as near to the axis as
``| g - |s_xy| |``. Over a box g takes all values from its least to its greatest.
"""

import math
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.placement._azimuths import AzimuthRange, SweptVectors
from sdpgrind.finishing.placement._proof import Shortfall
from sdpgrind.finishing.placement._reach import Reach, wrist_arms
from sdpgrind.finishing.placement._table import arm_vectors, wrist_heights, wrist_travels
from sdpgrind.finishing.placement._task import PlacingTask
from sdpgrind.finishing.placement._worth import Sides


class _Ring(NamedTuple):
    """Least and greatest distance of a rectangle from a point, mm."""

    inner: float
    outer: float


def _ring(sides: tuple[tuple[float, float], ...], point: Floats) -> _Ring:
    near = [max(low - at, at - high, 0.0) for (low, high), at in zip(sides, point, strict=False)]
    far = [max(abs(low - at), abs(high - at)) for (low, high), at in zip(sides, point, strict=False)]
    return _Ring(math.hypot(*near), math.hypot(*far))


def wrist_from_box(reach: Reach, sides: Sides, task: PlacingTask, over: AzimuthRange) -> Shortfall:
    """Distance of the wrist from the foot on axis 1 at the worst contact, at least, against the reach, mm."""
    arms = wrist_arms(task, over, reach.point)
    places, off = _placed(task, over, arms)
    across = _across(np.hypot(places[:, 0], places[:, 1]), _ring(sides[:2], reach.foot[:2]), off)
    height = places[:, 2] - reach.foot[2]
    low, high = sides[2]
    away = np.maximum(0.0, np.maximum(low + height - off, -(high + height + off)))
    return Shortfall(float(np.hypot(across, away).max()), reach.distance)


def _placed(task: PlacingTask, over: AzimuthRange, arms: SweptVectors) -> tuple[Floats, Floats]:
    """Contacts with a vector each (m, 3) in the frame of the surface, and their greatest error, mm."""
    c, s = math.cos(over.centre), math.sin(over.centre)
    turned = arms.vectors @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    level = np.hypot(arms.vectors[:, 0], arms.vectors[:, 1])
    return task.point + turned, arms.off + 2 * math.sin(over.half / 2) * level


def _across(level: Floats, ring: _Ring, off: Floats) -> Floats:
    """Least distance from the axis of places at a distance `level` from an origin within a ring, mm."""
    out: Floats = np.maximum(0.0, np.maximum(ring.inner - level, level - ring.outer) - off)
    return out


def table_from_box(arm: Arm, sides: Sides, task: PlacingTask, over: AzimuthRange) -> Shortfall:
    """Distance of the table's place from its travel, moved by the box, at the worst contact, mm.

    `Shortfall.needed`: that distance; there is none to spare.
    """
    travel = zip(sides[:2], arm.position_min[5:], arm.position_max[5:], strict=True)
    ring = _ring(tuple((low + least, high + most) for (low, high), least, most in travel), np.zeros(2))
    found = []
    for radius in (*arm.wrist_radii, *(-radius for radius in arm.wrist_radii)):
        vectors, off = arm_vectors(arm, task, over, radius)
        arms = SweptVectors(np.column_stack([vectors, np.zeros(len(vectors))]), off)
        places, error = _placed(task._replace(point=-task.point), over, arms)
        found.append(float(_across(np.hypot(places[:, 0], places[:, 1]), ring, error).max()))
    return Shortfall(min(found), 0.0, "X, Y")


def height_from_box(arm: Arm, sides: Sides, task: PlacingTask, over: AzimuthRange) -> Shortfall:
    """Distance of the wrist's height from its travel, moved by the box, at the worst contact, mm."""
    heights, off = wrist_heights(arm, task, over)
    low, high = sides[2]
    found = []
    for least, most in wrist_travels(arm):
        over_it = low + heights - off - (arm.d1 + most)
        under_it = arm.d1 + least - (high + heights + off)
        found.append(max(0.0, float(np.maximum(over_it, under_it).max())))
    return Shortfall(min(found), 0.0, "z")
