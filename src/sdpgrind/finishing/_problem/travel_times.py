"""Times that a robot needs at least between the pieces of a path, in the air."""

from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._problem.joint_runs import posture_of, samples_of
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.path._sequenced_path import SequencedPath, travels


def travel_times(problem: FinishingProblem, path: SequencedPath) -> Floats:
    """Return the least time from each state of a piece to each other one, (2 n, 2 n), s.

    That of the slowest, from rest to rest: the contact along the straight line, within the feed of the air
    and the acceleration along the path; each joint, within its speed and acceleration, by the shorter way
    round where it may turn once or more. `path` is in the sequence as given. The robot has one branch for the
    pieces forward and backwards, done one after the other.
    """
    count = len(path.order)
    twice = path.replace(
        paths=path.paths * 2, order=tuple(range(2 * count)), backwards=(False,) * count + (True,) * count
    )
    joints = _over(problem, twice).reshape(2, count, 2, -1).swapaxes(0, 1)
    starts, ends = (joints[:, :, k].reshape(2 * count, -1) for k in (0, 1))
    robot, apart = problem.robot, np.abs(ends[:, None] - starts)
    whole = _whole_turns(robot)
    apart[..., whole] = np.abs(np.remainder(apart[..., whole] + np.pi, 2 * np.pi) - np.pi)
    slowest = rest_to_rest(apart, robot.speed_max, robot.acceleration_max).max(axis=-1)
    way = travels(path.pieces, path.lift)
    return np.asarray(np.maximum(slowest, rest_to_rest(way, path.lift.air_feed, problem.acceleration)))


def _over(problem: FinishingProblem, path: SequencedPath) -> Floats:
    """Joints (n, 2, j) over start and end of each piece."""
    samples = samples_of(path)
    chosen, _ = posture_of(problem.replace(path=path), samples)
    there = np.abs(samples.length - path.over[..., None]).argmin(axis=-1)
    return np.asarray(chosen.joints[there])


def _whole_turns(robot: Any) -> npt.NDArray[np.bool_]:
    """Which joints may turn once or more."""
    span = np.asarray(robot.position_max) - np.asarray(robot.position_min)
    return np.asarray((np.array(robot.units) == "rad") & (span >= 2 * np.pi))


def rest_to_rest(way: npt.ArrayLike, speed: npt.ArrayLike, acceleration: npt.ArrayLike) -> Floats:
    """Return the least time of a way from rest to rest within speed and acceleration, s."""
    way, speed, acceleration = (np.asarray(each, dtype=float) for each in (way, speed, acceleration))
    cruise = way / speed + speed / acceleration
    return np.asarray(np.where(way * acceleration >= speed**2, cruise, 2 * np.sqrt(way / acceleration)))
