"""Plan a finishing motion: tool poses, robot joints and time law."""

import math
from typing import Any

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.progress import ProgressOption, portion, reporting
from sdpgrind.finishing._problem.motion import EXCEEDED, Motion, MotionError, Posture
from sdpgrind.finishing._problem.motion_rows import rows
from sdpgrind.finishing._problem.placed import placed
from sdpgrind.finishing._problem.problem import TABLE_HEIGHT, FinishingProblem
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._choice import RobotChoice, choose
from sdpgrind.finishing.arm._heading import check_corners, corner_jumps
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.path._lifted_path import LiftedPath
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._samples import PathSamples
from sdpgrind.finishing.timing._joint_path import JointPath
from sdpgrind.finishing.timing._laws import time_laws
from sdpgrind.finishing.timing._limits import JointLimits
from sdpgrind.finishing.timing._violations import worst_violation

METHODS = ("trapezoid", "toppra", "min_time")
ENDLESS = 1e6  # mm, chosen: half the travel of a table without limits, far beyond any arm
# Least samples of a leg, and mm between them; chosen: a spline through the joints follows the path.
FEWEST, STEP = 8, 0.25
STILL = 1e-6  # mm and 1, chosen: change of a pose between two runs that is none
JOINTS_SHARE = 0.3  # chosen: portion of progress for the joints; with "trapezoid" they take most of the time


@reporting
def plan(
    problem: FinishingProblem,
    *,
    method: str = "trapezoid",
    throw: bool = True,
    progress: ProgressOption = None,
) -> Motion:
    """Plan the motion along a path: poses, joints in closed form, and a time law within the limits.

    ``"trapezoid"``: rest at every sharp corner, in between a trapezoid of feed (Wang, figure 9), slower where
    a joint needs it; its acceleration jumps. ``"toppra"``: fastest law under the limits of speed and
    acceleration, by the package toppra (extra ``toppra``). ``"min_time"``: fastest law under the limits of
    speed, acceleration and jerk; slower than a trapezoid (no limit of jerk) where there are many corners;
    ``jerk_max=None``: no limit of jerk. All three rest at sharp corners; ``path.blended()`` has none, and
    suits the last two. Straight lines of a lift are runs at its ``air_feed``; the limits hold there, too.

    Parameters
    ----------
    problem : FinishingProblem
        Path, robot and tool.
    method : {"trapezoid", "toppra", "min_time"}
        The time law.
    throw : bool
        Whether a limit exceeded by more than 0.1 % is an error. False: only the status of the motion says so.
    progress : callable(share, text), True or None
        True: a line with the time left. Default: a line on standard error when it takes long.

    Returns
    -------
    Motion
        Poses (mm) and joints (rad, mm) over time (s), with the quantity nearest to its limit.

    Raises
    ------
    ValueError
        When a pose is out of reach or a joint out of its range, with the place; or a limit is exceeded
        (`MotionError`).

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> path = finishing.hilbert(finishing.preset("nominal").surface, 3)
    >>> motion = finishing.plan(finishing.FinishingProblem(path))
    >>> motion.worst_violation.held, round(motion.mean_feed_rate / motion.problem.feed_rate, 2)
    (True, 0.67)
    """
    assert callable(progress)  # made by the decorator
    checks.kind("problem", problem, FinishingProblem, " (see finishing.preset)")
    checks.one_of("method", method, METHODS)
    if problem.heading == "fixed":  # ends of legs show what is out of reach, before the long sampling
        posture_of(problem, problem.path.sample(per_leg=1))
    progress(0.0, "joints along the path")
    samples = problem.path.sample(per_leg=_per_leg(problem.path))
    chosen, place = posture_of(problem, samples)
    robot = problem.robot
    limits = JointLimits(
        robot.names,
        speed_max=robot.speed_max,
        acceleration_max=robot.acceleration_max,
        jerk_max=robot.jerk_max if method == "min_time" else None,
    )
    pace = problem.acceleration if method == "trapezoid" else None
    runs, feeds = runs_of(samples, chosen.joints), _feeds(problem, samples)
    laws = time_laws(
        runs,
        limits,
        feed_rate=feeds,
        acceleration=pace,
        method=method,
        progress=portion(progress, JOINTS_SHARE, 1.0),
    )
    worst = worst_violation(runs, laws, limits=limits, feed_rate=feeds)
    begun = sum(law.duration for law in laws[: worst.run])
    table = rows(problem, runs, laws)
    free = {name: np.full(table.sizes["row"], value) for name, value in chosen.free.items()}
    posture = Posture(chosen.branch, place, free)
    motion = Motion(problem, method, posture, worst._replace(time=begun + worst.time), table)
    if throw and worst.ratio > 1 + EXCEEDED:
        raise MotionError(
            f"a limit is exceeded: {motion.worst_violation}; try a lower feed_rate or another method", motion
        )
    return motion


def _feeds(problem: FinishingProblem, samples: PathSamples) -> float | list[float]:
    """Greatest feed of the process, or of each run where some are through the air, mm/s."""
    path = problem.path
    if not isinstance(path, LiftedPath):
        return problem.feed_rate
    on_work = [bool(piece.any()) for piece in np.split(samples.contact, _cuts(samples))]
    return [problem.feed_rate if each else path.lift.air_feed for each in on_work]


def _per_leg(path: Path | LiftedPath) -> int:
    """Samples of a leg, at most `STEP` mm apart; the joints are smooth only between knots of the surface."""
    longest = float(np.diff(path.sample(per_leg=1).length).max())
    return max(FEWEST, math.ceil(longest / STEP))


def posture_of(problem: FinishingProblem, samples: PathSamples) -> tuple[RobotChoice, tuple[float, ...]]:
    """Return branch and joints of the robot at every sample, and the placement (mm, rad)."""
    poses = problem.tool_poses(samples)
    if problem.heading == "feed_aligned":
        _refuse_corners(problem, np.split(poses, _turns(samples, poses)))
    place = problem.placement if problem.placement is not None else _centred(problem, poses)
    return _chosen(problem, problem.robot, placed(poses, place)), place


def _chosen(problem: FinishingProblem, robot: Robot, poses: Floats) -> RobotChoice:
    """Branch and redundant freedoms for the whole path."""
    try:
        return choose(robot, poses)
    except ValueError as error:
        raise ValueError(f"{_advice(problem)} ({error})") from None


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
