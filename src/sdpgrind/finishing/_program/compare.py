"""Comparison of a program with its motion: places, turns of the tool, feeds."""

from typing import Any, NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.carriers import alone, carriers, levers
from sdpgrind.finishing._program.configuration import STEP, check_configuration
from sdpgrind.finishing._program.course import PlannedMotion, frames_of, greatest_feed, way_per_turn
from sdpgrind.finishing._program.follow import PLACES, FollowedPath, followed
from sdpgrind.finishing._program.joint_cubics import JointCubics
from sdpgrind.finishing._program.matching_kernels import match
from sdpgrind.finishing._program.turns import angle_between, between, raised, shifted, turns_of

_REST = 1e-6  # rad/s, mm/s, chosen: rounding; a controller refuses a trajectory that ends in motion


class MotionCheck(NamedTuple):
    """What a program does, read back from its text.

    Attributes
    ----------
    deviation : float
        Greatest distance of the contact from the planned path, or of a turn of the tool times the lever arm,
        mm. Each planned place is compared with the nearest one of the program: of a program that is off by
        more than the stated deviation, as in another work frame, the turn is that at another place of the
        path, and both numbers are upper bounds.
    angle_deviation : float
        Greatest turn of the tool from the planned one, rad.
    feed_excess : float
        Greatest feed of a move beyond the planned feed there, mm/s; <= 0: none. Of a program that tells times
        and speeds, greatest speed of the contact along its cubics beyond that of the motion at the same time;
        0 where it tells times without speeds, which are compared, but for the joint moves that lead onto the
        work and off it.
    joint_speed_excess : float
        Greatest speed of a joint beyond its limit, and beyond that of the motion at the same time, as a share
        of the limit, unit 1; <= 0: none. 0 where the program tells no speeds of joints.
    axis_deviation : float
        Greatest deviation of axes that carry the work from the planned ones at the same place of the path,
        times the distance of the contact from the axis of a turntable, mm; of several axes the sum. It counts
        in `deviation`. 0 where the work rests, and in "csv" and "ros".
    """

    deviation: float
    angle_deviation: float
    feed_excess: float
    joint_speed_excess: float = 0.0
    axis_deviation: float = 0.0


class Planned(NamedTuple):
    """Places (n, 3) of the contact in the work, mm, quaternions, feeds (mm/s), joints (n, j).

    The work is where it lies in the base with the axes that carry it at zero.
    """

    places: Floats
    turns: Floats
    feeds: Floats
    joints: Floats


def check_lines(path: Any, motion: PlannedMotion) -> MotionCheck:
    """Compare straight moves with a motion, with lifts before and after it."""
    problem, plan = motion.problem, _planned(motion)
    if path.retract.size:
        raise ValueError(f"text must end after its straight moves; got {len(path.retract)} of the joints")
    there = followed(path, problem.robot, frames_of(motion).tool, problem.lever_arm)
    count = len(plan.places)
    segment, share, away = np.empty(count, dtype=np.int64), np.empty(count), np.empty(count)
    match(there.nodes, plan.places, segment, share, away)
    told = between(there.turns[segment], there.turns[segment + 1], share)
    angle = float(angle_between(told, plan.turns).max())
    end = float(np.linalg.norm(there.nodes[-1] - plan.places[-1]))
    after = np.clip(np.searchsorted(segment + share, np.arange(len(there.nodes))), 1, count - 1)
    passed = _passed(there.nodes, plan.places, after)
    check_configuration(path, plan.joints, there.blocks[segment], motion.posture.branch)
    lifts, ends = _on_lifts(after, count - 1)
    angle = max(angle, float(angle_between(there.turns[lifts], plan.turns[ends]).max()))
    off = _axes_off(there, plan, problem, (segment, share), (lifts, ends))
    return MotionCheck(
        max(float(away.max()), end, passed, angle * problem.lever_arm, off),
        angle,
        _excess(path.feeds, plan.feeds, there.blocks[segment]),
        axis_deviation=off,
    )


def _on_lifts(after: Any, last: int) -> tuple[Any, Any]:
    """Nodes before the second and after the last but one of the planned places, and the place at their end.

    Between these two the plan has no places; neither the tool turns there nor do axes under the work move.
    """
    lifts = np.flatnonzero((after == 1) | (after == last))
    return lifts, np.where(after[lifts] == 1, 0, last)


def _axes_off(there: FollowedPath, plan: Planned, problem: Any, matched: Any, lifts: Any) -> float:
    """Greatest deviation of the axes that carry the work, times their levers, mm; at matches and on lifts."""
    if not there.axes.shape[1]:
        return 0.0
    (segment, share), (nodes, ends) = matched, lifts
    told = there.axes[segment] + share[:, None] * (there.axes[segment + 1] - there.axes[segment])
    planned, arms = carriers(problem.robot, plan.joints), levers(problem, plan.joints)
    found = [(told - planned) * arms, (there.axes[nodes] - planned[ends]) * arms[ends]]
    return float(np.abs(np.vstack(found)).sum(axis=1).max())


def _planned(motion: PlannedMotion) -> Planned:
    """Motion at places at most `STEP` apart, lifted off before and after."""
    time, length = motion.profile[:, 0], motion.at(motion.profile[:, 0]).length
    parts = np.maximum(np.ceil(np.diff(length) / STEP), 1.0)
    where = np.interp(np.arange(parts.sum() + 1), np.append(0.0, np.cumsum(parts)), time)
    state, problem = motion.at(where), motion.problem
    poses = problem.robot.forward_work(state.joints)
    ends = _raised_ends(motion, poses[[0, -1]])
    tips = np.concatenate([[ends[0]], poses, [ends[1]]]) @ shifted(problem.lever_arm)
    feeds = np.concatenate([[greatest_feed(motion)], state.feed_rate, [greatest_feed(motion)]])
    joints = np.vstack([_off_the_work(motion, 0), state.joints, _off_the_work(motion, -1)])
    return Planned(np.ascontiguousarray(tips[:, :3, 3]), turns_of(tips), feeds, joints)


def _raised_ends(motion: PlannedMotion, poses: Floats) -> list[Floats]:
    """First and last pose (2, 4, 4) of the tool, lifted off."""
    return [
        raised(pose, motion.problem, spin)
        for pose, spin in zip(poses, motion.spin[[0, -1]].tolist(), strict=True)
    ]


def _off_the_work(motion: PlannedMotion, row: int) -> Floats:
    """Joints (n,) at the lifted end of a program beside the first or last row, in the same branch."""
    problem, here = motion.problem, motion.joints[row]
    robot, pose = alone(problem.robot), problem.robot.forward(here)
    count = len(robot.names)
    found = robot.solutions([raised(pose, problem, float(motion.spin[row]))])[0]
    away = np.remainder(found - here[:count] + np.pi, 2 * np.pi) - np.pi
    nearest = np.nan_to_num(np.abs(away), nan=np.inf).max(axis=1).argmin()
    return np.append(here[:count] + away[nearest], here[count:])


def _passed(nodes: Floats, places: Floats, after: Any) -> float:
    """Greatest distance of nodes from the planned line between the places before and `after` them."""
    a, b = places[after - 1], places[after]
    along = b - a
    square = np.maximum(np.sum(along**2, axis=1), 1e-300)
    u = np.clip(np.sum((nodes - a) * along, axis=1) / square, 0.0, 1.0)
    return float(np.linalg.norm(nodes - a - u[:, None] * along, axis=1).max())


def _excess(feeds: Floats, planned: Floats, block: Any) -> float:
    """Greatest feed of a move beyond the greatest planned one along it."""
    most = np.zeros(len(feeds))
    near = np.maximum(planned, np.maximum(np.roll(planned, 1), np.roll(planned, -1)))
    np.maximum.at(most, block, near)
    told = most > 0.0  # a move shorter than the step of the places may have none
    return float((feeds - most)[told].max())


def check_table(path: Any, motion: PlannedMotion) -> MotionCheck:
    """Compare joints over time with a motion at the same times."""
    robot, lever = motion.problem.robot, motion.problem.lever_arm
    if path.joints.shape[1] != len(robot.names):
        raise ValueError(f"text must have {len(robot.names)} joints a row; got {path.joints.shape[1]}")
    if path.names and tuple(path.names) != tuple(robot.names):
        raise ValueError(f"text must have the joints {', '.join(robot.names)}; got {', '.join(path.names)}")
    if path.speeds.size and np.abs(path.speeds[[0, -1]]).max() > _REST:
        raise ValueError(f"text must begin and end at rest, within {_REST:g} rad/s or mm/s")
    share = np.arange(PLACES) / PLACES
    inner = (path.time[:-1, None] + share * np.diff(path.time)[:, None]).ravel()
    time = np.union1d(np.append(inner, path.time[-1]), motion.time)
    cubics = JointCubics(path.time, path.joints, path.speeds) if path.speeds.size else None
    told = _straight(path, time) if cubics is None else cubics.at(time)
    planned = motion.at(np.clip(time, 0.0, motion.time[-1])).joints
    here, wanted = robot.forward_work(told), robot.forward_work(planned)
    if path.approach.size:
        lifts = _lifts(path, motion)
        here, wanted = np.concatenate([here, lifts[0]]), np.concatenate([wanted, lifts[1]])
    here, wanted = here @ shifted(lever), wanted @ shifted(lever)
    off = np.linalg.norm(here[:, :3, 3] - wanted[:, :3, 3], axis=1)
    angle = float(angle_between(turns_of(here), turns_of(wanted)).max())
    excess = (_lift_excess(path, motion), 0.0) if cubics is None else _speed_excess(cubics, motion, time)
    return MotionCheck(max(float(off.max()), lever * angle), angle, *excess)


def _straight(path: Any, time: Floats) -> Floats:
    """Joints at times, on straight lines: the program tells no speeds."""
    return np.stack([np.interp(time, path.time, column) for column in path.joints.T], axis=1)


def _speed_excess(told: JointCubics, motion: PlannedMotion, time: Floats) -> tuple[float, float]:
    """Greatest excess of the speed of the contact, mm/s, and of a joint, share of its limit; see above."""
    problem, profile = motion.problem, motion.profile
    plan = JointCubics(profile[:, 0], profile[:, 1:], motion.profile_speed)
    contact = [each.contact_speed(problem.robot, problem.lever_arm, time) for each in (told, plan)]
    told_share, planned = (np.abs(each.speed(time)) / problem.robot.speed_max for each in (told, plan))
    over = told_share - np.maximum(planned, 1.0)
    return float((contact[0] - contact[1]).max()), float(over.max())


def _lift_excess(path: Any, motion: PlannedMotion) -> float:
    """Greatest excess of the contact in joint moves onto the work and off it, mm/s; 0: there are none."""
    if not path.approach.size:
        return 0.0
    ends = path.approach, np.stack([path.joints[-1], path.retract[0]])
    fast = (way_per_turn(motion, *each) * pace for each, pace in zip(ends, path.paces[1:], strict=True))
    return float(max(fast)) - greatest_feed(motion)


def _lifts(path: Any, motion: PlannedMotion) -> tuple[Floats, Floats]:
    """Poses of the joint moves around a stream, and those that lead off the work."""
    if (len(path.approach), len(path.retract)) != (2, 1):
        raise ValueError(
            "text must have two moves of the joints before the stream and one after it;"
            f" got {len(path.approach)} and {len(path.retract)}"
        )
    problem = motion.problem
    ends = problem.robot.forward(motion.profile[[0, -1], 1:])
    above = _raised_ends(motion, ends)
    told = problem.robot.forward(np.array([path.approach[0], path.retract[0]]))
    return told, np.array(above)
