"""Joints of a robot along a path: branch, placement, smooth runs, and their limits."""

import math
from contextlib import suppress
from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._problem.placed import placed
from sdpgrind.finishing._problem.problem import TABLE_HEIGHT, FinishingProblem
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._branches import TurnError
from sdpgrind.finishing.arm._choice import RobotChoice, choose
from sdpgrind.finishing.arm._heading import check_corners, corner_jumps
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.arm._spin_choice import spun_choices
from sdpgrind.finishing.arm._spin_states import spins_of
from sdpgrind.finishing.path._lifted_course import LiftedCourse
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._samples import PathSamples
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._limits import JointLimits
from sdpgrind.finishing.timing._lower_bound import lower_bound

ENDLESS = 1e6  # mm, chosen: half the travel of a table without limits, far beyond any arm
# Least samples of a leg, and mm between them; chosen: a spline through the joints follows the path.
FEWEST, STEP = 8, 0.25
STILL = 1e-6  # mm and 1, chosen: change of a pose between two runs that is none


class PostureError(ValueError):
    """No branch of the robot takes the path where it is; another placement may."""


class CoarsePosesError(PostureError):
    """No branch takes the path, one because of a turn between neighbouring samples: closer ones may do."""


def limits_of(problem: FinishingProblem, method: str) -> tuple[JointLimits, float | None]:
    """Limits of the joints for a time law, and of acceleration along the path, mm/s^2 (None: no limit)."""
    robot = problem.robot
    limits = JointLimits(
        robot.names,
        speed_max=robot.speed_max,
        acceleration_max=robot.acceleration_max,
        jerk_max=robot.jerk_max if method == "min_time" else None,
    )
    return limits, problem.acceleration if method == "trapezoid" else None


def least_duration(problem: FinishingProblem) -> float:
    """Duration, s, that no law on the path of a problem is below, resting at its sharp corners."""
    samples = samples_of(problem.path)
    limits, _ = limits_of(problem, "min_time")
    runs = runs_of(samples, posture_of(problem, samples)[0].joints)
    return lower_bound(runs, limits, feed_rate=feeds_of(problem, samples))


def feeds_of(problem: FinishingProblem, samples: PathSamples) -> float | list[float]:
    """Greatest feed of the process, or of each run where some are through the air, mm/s."""
    path = problem.path
    if not isinstance(path, LiftedCourse):
        return problem.feed_rate
    on_work = [bool(piece.any()) for piece in np.split(samples.contact, _cuts(samples))]
    return [problem.feed_rate if each else path.lift.air_feed for each in on_work]


def samples_of(path: Path | LiftedCourse) -> PathSamples:
    """Samples at most `STEP` mm apart; the joints are smooth only between knots of the surface."""
    longest = float(np.diff(path.sample(per_leg=1).length).max())
    return path.sample(per_leg=max(FEWEST, math.ceil(longest / STEP)))


def posture_of(problem: FinishingProblem, samples: PathSamples) -> tuple[RobotChoice, tuple[float, ...]]:
    """Return branch and joints of the robot at every sample, and the placement (mm, rad)."""
    poses = problem.tool_poses(samples)
    if problem.heading == "feed_aligned":
        _refuse_corners(problem, np.split(poses, _turns(samples, poses)))
    place = problem.placement if problem.placement is not None else _centred(problem, poses)
    if chosen_along(problem):
        return _along(problem, placed(poses, place), samples), place
    return _chosen(problem, problem.robot, placed(poses, place)), place


def check_ends(problem: FinishingProblem) -> None:
    """Raise where ends of legs are out of reach or limits, before the long sampling."""
    if problem.heading == "fixed" and not chosen_along(problem):
        with suppress(CoarsePosesError):
            posture_of(problem, problem.path.sample(per_leg=1))


def chosen_along(problem: FinishingProblem) -> bool:
    """Whether freedoms are chosen from pose to pose: turns of the tool, positions of axes under the work."""
    return problem.spin != () or isinstance(problem.robot, MountedRobot)


def _along(problem: FinishingProblem, poses: Floats, samples: PathSamples) -> RobotChoice:
    """Branch and redundant freedoms: changing along the path, or held if that is faster.

    Compared are bounds without limits of jerk: where a freedom changes with less travel, a joint may have to
    accelerate more.
    """
    spins = spins_of(problem.spin or (0.0,))
    try:
        found = spun_choices(problem.robot, poses, samples.length, spins)
    except ValueError as error:
        what = "spin" if problem.spin != () else "candidates of the axes"
        raise PostureError(f"{what} must leave the robot a way: try another placement ({error})") from None
    limits, feeds = limits_of(problem, "min_time")[0], feeds_of(problem, samples)
    best = found[0]
    if len(found) > 1:
        best = min(
            found, key=lambda each: lower_bound(runs_of(samples, each.joints), limits, feed_rate=feeds)
        )
    if problem.spin == ():
        return best._replace(free={name: value for name, value in best.free.items() if name != "spin"})
    return best


def _chosen(problem: FinishingProblem, robot: Robot, poses: Floats) -> RobotChoice:
    """Branch and redundant freedoms for the whole path."""
    try:
        return choose(robot, poses)
    except ValueError as error:
        kind = CoarsePosesError if isinstance(error, TurnError) else PostureError
        raise kind(f"{_advice(problem)} ({error})") from None


def _advice(problem: FinishingProblem) -> str:
    """Advice where no posture of the robot reaches the whole path."""
    azimuth = f"azimuth (now {problem.azimuth:.4g} rad)"
    if not isinstance(problem.robot, Arm):
        return f"the robot must reach the path: try another placement or {azimuth}"
    if problem.path.frames()[:, 2, 2].mean() < 0:
        return "surface must have its outward normals up; outward=-1 turns them"
    if problem.heading == "feed_aligned":
        return (
            "without wrist yaw q1 turns with the path where heading is 'feed_aligned'; take heading='fixed'"
        )
    return f"the arm must reach the path: try another {azimuth}, placement or wrist_radius"


def _centred(problem: FinishingProblem, poses: Floats) -> tuple[float, float, float]:
    """Placement of the surface (mm) that centres the travel of a table without limits."""
    arm, raised = problem.robot, poses.copy()
    if not isinstance(arm, Arm):
        raise ValueError(
            "placement must be given for a robot without a table: x, y, z (mm), and a turn about z (rad);"
            " got None"
        )
    raised[:, 2, 3] += TABLE_HEIGHT
    endless = arm.replace(
        position_min=(*arm.position_min[:5], -ENDLESS, -ENDLESS),
        position_max=(*arm.position_max[:5], ENDLESS, ENDLESS),
    )
    table = _chosen(problem, endless, raised).joints[:, 5:]
    middle = (table.max(axis=0) + table.min(axis=0)) / 2
    centre = (np.array(arm.position_max[5:]) + np.array(arm.position_min[5:])) / 2
    return (*(middle - centre).tolist(), TABLE_HEIGHT)


def _refuse_corners(problem: FinishingProblem, runs: list[Floats]) -> None:
    """Raise where a tool turned into the feed would have to turn at a sharp corner, and the work with it."""
    if len(runs) == 1:
        return
    arm = problem.robot
    if not isinstance(arm, Arm):
        raise ValueError(
            "path must be without sharp corners where heading is 'feed_aligned', as the tool would turn there"
            f" in contact; got {len(runs) - 1} of them; take path.blended() or a fixed heading"
        )
    jumps = corner_jumps(arm, runs, wrist_radius=arm.wrist_radii[0])
    check_corners(arm, jumps)
    k = int(np.argmax(np.abs(jumps.turn)))
    raise ValueError(
        f"path must be without sharp corners where heading is 'feed_aligned': at corner {k} q1 would turn by"
        f" {jumps.turn[k]:.3g} rad and the table jump by {np.hypot(*jumps.table[k]):.4g} mm; take"
        " path.blended() or a fixed heading"
    )


def _cuts(samples: PathSamples) -> Any:
    """Indices of the starts of new runs."""
    return np.flatnonzero(np.diff(samples.run)) + 1


def _turns(samples: PathSamples, poses: Floats) -> Any:
    """Indices of the starts of runs at which the tool turns; in the air it rests there without."""
    cuts = _cuts(samples)
    return cuts[np.abs(poses[cuts] - poses[cuts - 1]).max(axis=(1, 2)) > STILL]


def runs_of(samples: PathSamples, joints: Floats) -> list[JointPath]:
    """Return the smooth runs between sharp corners."""
    cuts = _cuts(samples)
    pieces = zip(np.split(samples.length, cuts), np.split(joints, cuts), strict=True)
    return [JointPath(length, values) for length, values in pieces]
