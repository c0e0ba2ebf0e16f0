"""Picture of a placement: robot and path from above and from the side, and what the joints take."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sdpgrind.base import pictures
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.arm._robot import Robot, angular
from sdpgrind.finishing.arm._serial import SerialRobot
from sdpgrind.finishing.placement._worth import margins, stations, turned_by

if TYPE_CHECKING:
    from sdpgrind.finishing.placement._placement import Placement
    from sdpgrind.finishing.placement._proof import Proof

ROBOT = "0.35"
# chosen: postures of the robot that are drawn, at the start, in the middle and at the end of the path
LIMBS = 3


def plot(placement: "Placement") -> Any:
    """Draw a placement, or the numbers of a proof; return the figure."""
    if placement.proof is not None:
        return _draw_proof(placement.proof)
    poses, tips = _along(placement.best)
    joints = _joints(placement.best.robot, poses)
    figure, (above, beside, shares) = pictures.subplots(1, 3, (13.0, 4.6), width_ratios=(1, 1, 0.9))
    for axis, first, second in ((above, "x", "y"), (beside, "x", "z")):
        _draw_view(axis, placement.best, joints, tips, "xyz".index(second))
        axis.set_xlabel(pictures.label(f"{first} of the base", "mm"))
        axis.set_ylabel(pictures.label(f"{second} of the base", "mm"))
    above.set_title("from above", fontsize=10)
    beside.set_title("from the side", fontsize=10)
    pictures.legend(above, loc="best")
    _draw_shares(shares, placement.best.robot, joints)
    words = f"worth {placement.worth:.3g}" if placement.found else f"not found; worth {placement.worth:.3g}"
    figure.suptitle(f"{words}; collisions are not looked at", fontsize=10)
    return figure


def _draw_proof(proof: "Proof") -> Any:
    figure, axis = pictures.subplots(1, 1, (6.0, 2.2))
    axis.barh(
        ["needed", "available"], [proof.needed, proof.available], color=[pictures.LIMIT, pictures.ACTUAL]
    )
    axis.set_xlabel(pictures.label(proof.condition, proof.unit))
    axis.set_title("no placement exists", fontsize=10)
    pictures.opened([axis])
    return figure


def _along(problem: Any) -> tuple[Floats, Floats]:
    """Poses of the tool (m, 4, 4) and its tips (m, 3) at the nodes of the path, in the base, mm."""
    x, y, z, *turn = problem.placement
    poses = problem.tool_poses(problem.path.sample(per_leg=1))
    poses = turned_by(poses[None], np.array(turn or [0.0]))[0]
    poses[:, :3, 3] += [x, y, z]
    return poses, poses[:, :3, 3] + problem.lever_arm * poses[:, :3, 2]


def _joints(robot: Robot, poses: Floats) -> Floats:
    """Joints (m, n) along the poses in the branch of widest margin; NaN where a pose is out of reach."""
    found = robot.solutions(poses)
    if isinstance(robot, MountedRobot):
        found = _carried(robot, found)
    joints: Floats = found[:, int(margins(robot, found[None])[0].argmax())].copy()
    turning = np.flatnonzero(angular(robot))
    known = ~np.isnan(joints).any(axis=1)
    joints[np.ix_(known, turning)] = np.unwrap(joints[np.ix_(known, turning)], axis=0)
    return joints


def _carried(robot: MountedRobot, found: Floats) -> Floats:
    """Joints (m, b, n) of every branch with the axes where their margin is widest at each pose."""
    each = found.reshape(len(found), stations(robot), -1, found.shape[2])
    worth = margins(robot, found[:, None]).reshape(each.shape[:3])
    best: Floats = np.take_along_axis(each, worth.argmax(axis=1)[:, None, :, None], axis=1)[:, 0]
    return best


def _draw_view(axis: Any, problem: Any, joints: Floats, tips: Floats, up: int) -> None:
    """Draw robot and path over x and one other axis of the base."""
    robot: Robot = problem.robot
    carried = isinstance(robot, MountedRobot)
    table = ", table at zero" if isinstance(robot, Arm) else ", axes at zero" if carried else ""
    known = joints[~np.isnan(joints).any(axis=1)]
    for k in np.linspace(0, len(known) - 1, min(LIMBS, len(known))).round().astype(int):
        pose = robot.forward(known[k])
        contact = pose[:3, 3] + problem.lever_arm * pose[:3, 2]
        bones = np.vstack([_bones(robot, known[k]), contact])
        axis.plot(bones[:, 0], bones[:, up], color=ROBOT, lw=1.6, marker="o", ms=3, alpha=0.7)
    axis.plot(tips[:, 0], tips[:, up], color=pictures.ACTUAL, lw=1.0, label=f"path{table}")
    axis.plot(0.0, 0.0, color=pictures.LIMIT, marker="s", ms=6, ls="", label="base")
    axis.plot([], [], color=ROBOT, marker="o", ms=3, label="robot, tool")
    axis.set_aspect("equal", adjustable="datalim")
    pictures.opened([axis])


def _bones(robot: Robot, joints: Floats) -> Floats:
    """Points (k, 3) on the robot from the base to the tool, mm; of a kind that is not known, both ends."""
    if isinstance(robot, MountedRobot):
        return _bones(robot.robot, joints[: len(robot.robot.names)])
    if isinstance(robot, SerialRobot):
        return _bones_of_chain(robot, joints)
    tool = robot.forward(joints)[:3, 3]
    if not isinstance(robot, Arm):
        return np.stack([np.zeros(3), tool])
    q1, q2, q3 = joints[:3].tolist()
    ahead = np.array([math.cos(q1), math.sin(q1), 0.0])
    shoulder = np.array([0.0, 0.0, robot.d1])
    elbow = shoulder + robot.a2 * (math.cos(q2) * ahead + np.array([0.0, 0.0, math.sin(q2)]))
    wrist = elbow + robot.a3 * (math.cos(q2 + q3) * ahead + np.array([0.0, 0.0, math.sin(q2 + q3)]))
    return np.stack([np.zeros(3), shoulder, elbow, wrist, tool])


def _bones_of_chain(robot: SerialRobot, joints: Floats) -> Floats:
    here, bones = np.eye(4), [np.zeros(3)]
    for link, slides, joint in zip(robot._chain, robot.sliding, joints.tolist(), strict=False):
        here = here @ link
        bones.append(here[:3, 3])
        here = here @ _moved(slides, joint)
    bones.append((here @ robot._chain[-1])[:3, 3])
    return np.array(bones)


def _moved(slides: bool, joint: float) -> Floats:
    out = np.eye(4)
    if slides:
        out[2, 3] = joint
        return out
    c, s = math.cos(joint), math.sin(joint)
    out[:2, :2] = [[c, -s], [s, c]]
    return out


def _draw_shares(axis: Any, robot: Robot, joints: Floats) -> None:
    """Draw what each joint takes of its range, in percent."""
    low, high = np.array(robot.position_min), np.array(robot.position_max)
    least, most = (100 * (end - low) / (high - low) for end in (np.nanmin(joints, 0), np.nanmax(joints, 0)))
    rows = np.arange(len(low))
    axis.barh(rows, 100.0, color="0.92", height=0.6)
    axis.barh(rows, np.maximum(most - least, 0.8), left=least, color=pictures.ACTUAL, height=0.6)
    axis.set_yticks(rows, list(robot.names))
    axis.invert_yaxis()
    axis.axvline(0.0, color=pictures.LIMIT, lw=1)
    axis.axvline(100.0, color=pictures.LIMIT, lw=1)
    axis.set_xlabel(pictures.label("share of the range of each joint", "%"))
    pictures.opened([axis], grid=False)
