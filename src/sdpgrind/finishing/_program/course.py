"""Course of the contact for the writers: runs between rests, in the frame of the work, and the frames."""

from typing import Any, NamedTuple, Protocol

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing._program.carriers import alone, carriers, levers
from sdpgrind.finishing._program.turns import inverse, raised, shifted, turns_of
from sdpgrind.finishing.arm._serial import SerialRobot

STEP = 0.02  # mm, chosen: a chord of this on an arc of 0.3 mm radius errs by 0.2 um
_SAME = 1e-9  # mm, chosen: samples nearer than this are one
_AHEAD = 1e-6  # chosen: rounding of an axis of the flange
SINGLE = 1e-6  # derived: greatest error of a feed that a controller keeps in single precision, relative
_PARTS = 32  # chosen: chords of a joint move of 20 mm, shorter than it by 1e-4 of its length or less
_NEAR = 0.6  # rad, chosen: a joint turns less between contact and lift, or the branch is another


class PlannedMotion(Protocol):
    """What a program is made of: a `Motion`, mm, s, rad."""

    @property
    def problem(self) -> Any:
        """The planned problem."""

    @property
    def posture(self) -> Any:
        """Branch and placement, mm, rad."""

    @property
    def time(self) -> Floats:
        """Times of the rows, s; the same twice at a sharp corner."""

    @property
    def length(self) -> Floats:
        """Length of path, mm."""

    @property
    def feed_rate(self) -> Floats:
        """Speed along the path at the rows, mm/s."""

    @property
    def contact(self) -> Bools:
        """Whether the tool is on the work, at the rows."""

    @property
    def joints(self) -> Floats:
        """Joints of the rows, rad or mm."""

    @property
    def spin(self) -> Floats:
        """Turn of the tool about its own axis at the rows, rad."""

    @property
    def profile(self) -> Floats:
        """Times (s) and joints (rad, mm), each time once."""

    @property
    def profile_speed(self) -> Floats:
        """Speeds of the joints at those times, rad/s or mm/s."""

    def at(self, time: Any) -> Any:
        """Joints, length and feed at times, s."""


class Run(NamedTuple):
    """Samples between two rests: time (s), length (mm), contact (m, 3) in the work, mm, turns, joints.

    `carried` (m, e): axes that carry the work, times their greatest levers, mm.
    """

    time: Floats
    length: Floats
    points: Floats
    turns: Floats
    joints: Floats
    carried: Floats


class RobotFrames(NamedTuple):
    """Rigid motions (4, 4), mm: work in the base, its axes at zero; contact in the controller's flange."""

    work: Floats
    tool: Floats


def frames_of(motion: PlannedMotion) -> RobotFrames:
    """Return work in the base, and contact in the flange."""
    x, y, z, *turn = motion.posture.placement
    work = np.eye(4)
    angle = turn[0] if turn else 0.0
    work[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    work[:3, 3] = x, y, z
    robot = alone(motion.problem.robot)
    return RobotFrames(work, inverse(_flange(robot)) @ robot.tool @ shifted(motion.problem.lever_arm))


def _flange(robot: SerialRobot) -> Floats:
    """Flange of a controller, z along the last axis, in the flange of the model, whose x may be along it."""
    axis = robot.links[-1][:3, :3].T[:, 2]
    out = np.eye(4)
    if abs(axis[0] - 1.0) < _AHEAD:  # older ROS-Industrial models
        out[:3, :3] = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
    elif abs(axis[2] - 1.0) >= _AHEAD:
        rule = "a flange whose z or x is along the last axis, as the tool of a controller is from there"
        raise checks.refuse("robot", f"one with {rule}", axis.round(6).tolist())
    return out


def runs_of(motion: PlannedMotion, frames: RobotFrames) -> list[Run]:
    """Return the runs between rests, samples at most `STEP` apart."""
    cuts = np.flatnonzero(np.diff(motion.time) <= 0) + 1
    rows = zip(np.split(motion.time, cuts), np.split(motion.length, cuts), strict=True)
    arms = levers(motion.problem, motion.joints).max(axis=0)
    return [_run(motion, frames, _dense(time, length), arms) for time, length in rows]


def _dense(time: Floats, length: Floats) -> Floats:
    """Times between which the contact moves by `STEP` or so."""
    parts = np.maximum(np.ceil(np.diff(length) / STEP).astype(int), 1)
    row = np.repeat(np.arange(parts.size), parts)
    share = (np.arange(row.size) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[row]
    return np.append(time[row] + share * np.diff(time)[row], time[-1])


def _run(motion: PlannedMotion, frames: RobotFrames, time: Floats, arms: Floats) -> Run:
    state = motion.at(time)
    poses = contacts(motion, frames, state.joints)
    points: Floats = poses[:, :3, 3]
    moved = np.append(True, np.linalg.norm(np.diff(points, axis=0), axis=1) > _SAME)
    moved[-1] = True
    if not moved[:-1].all():  # the last sample stays, one too near before it goes
        moved[np.flatnonzero(~moved[:-1])] = False
    carried = np.ascontiguousarray(carriers(motion.problem.robot, state.joints) * arms)
    every = time, state.length, points, turns_of(poses), state.joints, carried
    return Run(*(each[moved] for each in every))


def contacts(motion: PlannedMotion, frames: RobotFrames, joints: Floats) -> Floats:
    """Return poses of the contact in the work, (m, 4, 4), mm."""
    tips = motion.problem.robot.forward_work(joints) @ shifted(motion.problem.lever_arm)
    out: Floats = inverse(frames.work) @ tips
    return out


def greatest_feed(motion: PlannedMotion) -> float:
    """Return the greatest planned feed on the work, mm/s: that down onto it and off it again.

    It is the feed of the problem where the motion reaches it, and less where joints or corners forbid that.
    """
    planned, asked = float(motion.feed_rate[motion.contact].max()), float(motion.problem.feed_rate)
    return asked if planned >= asked * (1 - SINGLE) else planned


def way_per_turn(motion: PlannedMotion, start: Floats, end: Floats) -> float:
    """Return the greatest way of the contact per turn of the leading joint in a joint move, mm/rad."""
    joints = start + np.linspace(0.0, 1.0, _PARTS + 1)[:, None] * (end - start)
    tips = (motion.problem.robot.forward_work(joints) @ shifted(motion.problem.lever_arm))[:, :3, 3]
    steps = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    return float(steps.max() * _PARTS / np.abs(end - start).max())


def lifted(motion: PlannedMotion, row: int) -> Floats:
    """Return the joints (n,) above those of a row, in the same branch, rad; axes under the work stay."""
    problem, whole = motion.problem, motion.joints[row]
    pose = raised(problem.robot.forward(whole), problem, float(motion.spin[row]))
    robot = alone(problem.robot)
    joints, found = whole[: len(robot.names)], robot.solutions([pose])[0]
    turns = found + 2 * np.pi * np.round((joints - found) / (2 * np.pi))
    away = np.nan_to_num(np.abs(turns - joints).max(axis=1), nan=np.inf)
    nearest: Floats = turns[int(np.argmin(away))]
    low, high = np.array(robot.position_min), np.array(robot.position_max)
    if away.min() > _NEAR or np.any(nearest < low) or np.any(nearest > high):
        raise ValueError(
            "placement must leave room for the lift off the work, 20 mm along its normal (mm); the robot does"
            f" not reach it from joints {np.round(joints, 4).tolist()} in the same branch"
        )
    return np.append(nearest, whole[len(joints) :])
