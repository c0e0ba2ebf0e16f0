"""Course of a motion: points, normals and directions in the frame of the surface; loop of the table."""

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing._plant import kernels as at
from sdpgrind.finishing._problem.placed import placed, turned
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.path import PathSamples
from sdpgrind.finishing.path._lifted_course import LiftedCourse
from sdpgrind.finishing.timing import TableLoop

ASTRAY = 1.0  # largest distance of a motion from the path, mm; chosen: beyond it is that of another part
_ROUNDING = 1e-6  # relative to a joint's range; chosen: above rounding of plans


def course_of(problem: FinishingProblem, motion: Any, tree: cKDTree, weight: float) -> Floats:
    """Rows of the course of a motion (m, 8), checked; `weight` is the unbalanced torque held level, N m."""
    rows, robot = checks.finite_array("motion", motion, "s, rad, mm"), problem.robot
    count = len(robot.names)
    if rows.ndim != 2 or rows.shape[1] != count + 1 or len(rows) < 2:
        raise ValueError(
            f"motion must be an array (m, {count + 1}) of times and {count} joints, m >= 2; got one of shape"
            f" {rows.shape}"
        )
    if rows[0, 0] != 0.0 or not np.all(np.diff(rows[:, 0]) > 0):
        raise ValueError("times of motion must begin at 0 and rise (s)")
    _check_joints(problem, rows)
    poses, table = robot.forward_work(rows[:, 1:]), _table(robot, rows[:, 1:])
    if problem.turn:  # in the frame of the surface
        poses, table = placed(poses, (0.0, 0.0, 0.0, -problem.turn)), turned(table, -problem.turn)
    course = _course(problem, rows[:, 0], poses, tree.data[0])
    course[:, at.WEIGHT] = _weights(problem, robot.forward(rows[:, 1:]), weight)
    course[:, at.TABLE : at.TABLE + 2] = table[:, :2]
    nearest = _nearest(course, tree)
    if isinstance(problem.path, LiftedCourse):
        course[:, at.CLEARANCE] = problem.path.sample().clearance[nearest]
    return course


def _table(robot: Robot, joints: Floats) -> Floats:
    """Travel of the table that carries the work (m, 3), mm; 0 without one."""
    out = np.zeros((len(joints), 3))
    if isinstance(robot, Arm):
        out[:, :2] = joints[:, -2:]
    return out


def standing(problem: FinishingProblem, first: PathSamples, weight: float) -> Floats:
    """Two rows of a tool that stands at the beginning of the path, `first`."""
    poses = np.repeat(problem.tool_poses(first), 2, axis=0)
    course = _course(problem, np.array([0.0, 1.0]), poses, first.point[0])
    course[:, at.WEIGHT] = _weights(problem, poses, weight)
    course[:, at.CLEARANCE] = first.clearance[0]
    return course


def _weights(problem: FinishingProblem, poses: Floats, weight: float) -> Floats:
    """Torques of the weight at poses in a frame whose z is up, N m; `weight`: that held level, N m."""
    side = 1.0 if problem.pushed else -1.0
    out: Floats = -weight * side * poses[:, 2, 0]
    return out


def _course(problem: FinishingProblem, time: Floats, poses: Floats, start: Floats) -> Floats:
    """Tip, normal and azimuth from tool poses in a frame parallel to the surface's; `start`: of the path."""
    side = 1.0 if problem.pushed else -1.0
    c, s = np.cos(problem.contact_angle), np.sin(problem.contact_angle)
    turn, tip = poses[:, :3, :3], poses[:, :3, 3] + problem.lever_arm * poses[:, :3, 2]
    course = np.zeros((len(time), at.COLUMNS))
    course[:, at.TIME] = time
    course[:, at.TIP : at.TIP + 3] = tip - tip[0] + start
    course[:, at.NORMAL : at.NORMAL + 3] = turn @ np.array([-side * c, 0.0, -s])
    course[:, at.AZIMUTH : at.AZIMUTH + 3] = turn @ np.array([-s, 0.0, side * c])
    course[:, at.AHEAD : at.CLEARANCE] = _directions(tip)
    return course


def _directions(tip: Floats) -> Floats:
    """Direction from each row to the next; without motion, that of the row before."""
    steps = np.diff(tip, axis=0)
    long = np.linalg.norm(steps, axis=1)
    moving = np.maximum.accumulate(np.where(long > 0, np.arange(len(steps)), 0))
    ahead = (steps / np.where(long > 0, long, 1.0)[:, np.newaxis])[moving]
    return np.concatenate([ahead, ahead[-1:]])


def _check_joints(problem: FinishingProblem, rows: Floats) -> None:
    """Refuse a row beyond the range of a joint."""
    robot = problem.robot
    low, high = np.array(robot.position_min), np.array(robot.position_max)
    slack = _ROUNDING * (high - low)
    beyond = (rows[:, 1:] < low - slack) | (rows[:, 1:] > high + slack)
    if beyond.any():
        row, joint = (int(k) for k in np.argwhere(beyond)[0])
        rule = f"in [{low[joint]:g}, {high[joint]:g}]"
        raise checks.refuse(
            f"{robot.names[joint]} in motion at {rows[row, 0]:g} s",
            rule,
            float(rows[row, joint + 1]),
            robot.units[joint],
        )


def _nearest(course: Floats, tree: cKDTree) -> Any:
    """Return the nearest sample of the path for each row; refuse a motion away from it."""
    away, nearest = tree.query(course[:, at.TIP : at.TIP + 3])
    spacing = float(np.max(np.linalg.norm(np.diff(tree.data, axis=0), axis=1)))
    worst = int(np.argmax(away))
    if away[worst] > ASTRAY + spacing:
        raise ValueError(
            "motion must follow the path of the problem; "
            f"at {course[worst, at.TIME]:g} s its tip is {away[worst]:.3g} mm away"
        )
    return nearest


def loop_of(table: TableLoop | None, tick: float) -> Floats:
    """Exact step of a table loop for commands linear in a tick; empty without a loop: no error."""
    return np.empty(0) if table is None else table.sampled(tick).parameters
