"""Robots with axes that carry the work, and a ring around a cylinder on a turntable."""

from functools import cache

import numpy as np
from robot_twins import UR10, about

from sdpgrind import finishing

TABLE = finishing.arm.Turntable(
    (1050.0, 0.0, 300.0), (0, 1, 0), speed_max=1.0, acceleration_max=5.0, jerk_max=50.0
)
RAIL = finishing.arm.LinearTable(
    (0, 1, 0), (-400.0, 400.0), speed_max=400.0, acceleration_max=2000.0, jerk_max=2e4
)
STAND = finishing.arm.Turntable(
    (650.0, 40.0, 80.0), (0.2, -0.3, 0.9), speed_max=1.0, acceleration_max=5.0, jerk_max=50.0
)
HELD = UR10.replace(tool=finishing.tool(length=150.0))
PLACE = (1050.0, -6.0, 300.0)  # mm: the axis of the cylinder is that of the turntable


def all_round(radius, width):
    """A whole cylinder about y, seam at +x."""
    corner, s = np.array([1, 1, 0, -1, -1, -1, 0, 1, 1]), 0.5**0.5
    side = np.array([0, 1, 1, 1, 0, -1, -1, -1, 0])
    weights = np.array([1, s, 1, s, 1, s, 1, s, 1])
    net = [[[radius * x, y, radius * z] for y in (0.0, width)] for x, z in zip(corner, side, strict=True)]
    knots = [0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1], [0, 0, 1, 1]
    return finishing.Surface.nurbs(net, np.stack([weights, weights], axis=1), (2, 1), knots, outward=-1)


@cache
def ring(robot=None, radius=20.0, **changes):
    """Two passes around a cylinder 12 mm long, on the turntable but for another robot."""
    robot = finishing.arm.mounted(HELD, turntable=TABLE) if robot is None else robot
    fields = {"azimuth": np.pi / 2, "placement": PLACE, "feed_rate": 50.0} | changes
    path = finishing.zigzag(all_round(radius, 12.0), pitch=11.9)
    return finishing.FinishingProblem(path, robot=robot, **fields)


@cache
def planned(method="min_time", **changes):
    return finishing.plan(ring(**changes), method=method)


def moved(axis, value):
    """Motion of the work by one axis, as a product of shifts and a turn."""
    out = np.eye(4)
    if isinstance(axis, finishing.arm.LinearTable):
        way = np.array(axis.direction)
        out[:3, 3] = value * way / np.linalg.norm(way)
        return out
    to, back = np.eye(4), np.eye(4)
    to[:3, 3], back[:3, 3] = axis.origin, -np.array(axis.origin)
    out[:3, :3] = about(axis.axis, value)
    return to @ out @ back
