"""How far the wrist of a robot gets from a point on its first axis, and what a path asks of it.

Behind the first joint the wrist of a robot in closed form lies at (rho, z) in the plane of the arm, at the
constant offset e across, with |(rho - a1, z)| <= a2 + a3: so it is at most hypot(|a1| + a2 + a3, e) from the
foot of axis 2 on axis 1. With parallel axes (UR) the point where axes 5 and 6 meet is two perpendicular links
a4 and d5 farther in that plane: hypot(a4, d5) more. No other chain, nor one that is only near a closed form,
reaches farther than its links are long.

The point is fixed in the tool, so that the path tells all places of it up to the placement, which turns and
shifts them together. In a ball of that reach fits only what has a smallest ball of no greater radius.
"""

import math
from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._closed_form import ClosedForm, inverted
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.arm._serial import SerialRobot
from sdpgrind.finishing.placement._azimuths import AzimuthRange, SweptVectors, swept
from sdpgrind.finishing.placement._enclosing_ball import enclosing_ball
from sdpgrind.finishing.placement._proof import Shortfall
from sdpgrind.finishing.placement._task import PlacingTask

SLACK = 1e-6  # mm, chosen: far more than rounding, far less than a user minds
UPRIGHT = 1e-9  # chosen: tilt of axis 1 of a robot that stands upright


class Reach(NamedTuple):
    """A point of the tool frame (3,) that stays within a distance of a point in the base (3,), mm."""

    point: Floats
    foot: Floats
    distance: float
    upright: bool


def reach_of(robot: Robot) -> Reach | None:
    """Return the reach of a robot; None: it is not known."""
    if not isinstance(robot, SerialRobot):
        return None
    form = robot._form
    if isinstance(form, ClosedForm) and not form.near:
        a1, a2, a3, a4, offset, d5 = form.lengths
        links = abs(a1) + a2 + a3 + (0.0 if form.wrist else math.hypot(a4, d5))
        point = (inverted(robot.tool) @ form.behind)[:3, 3]
        upright = bool(abs(form.before[2, 2]) > 1 - UPRIGHT)
        return Reach(point, inverted(form.before)[:3, 3], math.hypot(links, offset) + SLACK, upright)
    links = sum(float(np.linalg.norm(link[:3, 3])) for link in robot._chain[1:])
    slides = np.maximum(np.abs(robot.position_min), np.abs(robot.position_max))[np.array(robot.sliding)]
    first = robot.links[0]
    upright = bool(abs(first[2, 2]) > 1 - UPRIGHT and not robot.sliding[0])
    return Reach(np.zeros(3), first[:3, 3], links + float(slides.sum()) + SLACK, upright)


def wrist_arms(task: PlacingTask, over: AzimuthRange, point: Floats) -> SweptVectors:
    """Vectors from the contacts to a point of the tool; one that spins has it on a circle about its axis."""
    arm = point - np.array([0.0, 0.0, task.hold.lever_arm])
    if not task.hold.spins:
        return swept(task, over, arm)
    found = swept(task, over, np.array([0.0, 0.0, arm[2]]))
    return SweptVectors(found.vectors, found.off + math.hypot(arm[0], arm[1]))


def wrist_points(task: PlacingTask, over: AzimuthRange, point: Floats) -> tuple[Floats, Floats]:
    """Places of a point of the tool (m, 3) in the frame of the surface, and their greatest error, mm.

    The error leaves out a motion of all places together.
    """
    arms = wrist_arms(task, over, point)
    middle = arms.vectors.mean(axis=0)
    away = arms.vectors - middle
    off = arms.off + 2 * math.sin(over.half / 2) * np.hypot(away[:, 0], away[:, 1])
    c, s = math.cos(over.centre), math.sin(over.centre)
    turned = away @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return task.point + turned, off


def ball_needed(reach: Reach, task: PlacingTask, over: AzimuthRange) -> Shortfall:
    """Radius of the smallest ball around the wrist along the path, against the reach, mm.

    For azimuths of a range each place of the wrist is off by some amount at most; then some of the points
    that carry the ball is still as far from any place as their `proved` distance less the greatest of theirs.
    """
    points, off = wrist_points(task, over, reach.point)
    ball = enclosing_ball(points)
    needed = ball.proved(points) - float(off[list(ball.support)].max())
    return Shortfall(needed, reach.distance)
