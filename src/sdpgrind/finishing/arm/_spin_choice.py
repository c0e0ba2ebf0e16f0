"""Choice of branch, turn of the tool and wrist radius along a path."""

from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._branches import travel_of
from sdpgrind.finishing.arm._choice import RobotChoice
from sdpgrind.finishing.arm._inverse import checked_poses
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.arm._spin_course import CourseTask, SmoothCourse
from sdpgrind.finishing.arm._spin_states import Spins, SpinStates, states_of
from sdpgrind.finishing.arm._spin_sweep import swept

APART, TURNED = 1.0, 0.1  # mm, rad, chosen: a step of the turn of 15 deg leaves the joints 5 deg for the path


def spun_choices(robot: Robot, poses: Floats, length: Floats, spins: Spins) -> list[RobotChoice]:
    """Return two ways of a robot whose tool may turn along a path: held at the best turn, and turning.

    Turning: the smooth course near that of least travel. One of both where the other leaves the limits;
    ValueError where there is none.
    """
    states, given = states_of(robot, spins), checked_poses(poses)
    chosen, found = stations(given, length), []
    for held in (True, False) if len(states.values) > 1 else (True,):
        try:
            sweep = swept(states, given[chosen], held=held)
        except ValueError as error:
            failed = error
            continue
        values = unwound(states, sweep.picks)
        task = CourseTask(states, given, length, sweep.group)
        course = _course(states, task, values, length[chosen], held)
        if course is not None and travel_of(robot, course.joints)[1] < 0:
            found.append(_chosen(states, sweep.group, course))
        failed = ValueError(f"no smooth {states.told} stays within limits along the path")
    if not found:
        raise failed
    return found


def _course(
    states: SpinStates, task: CourseTask, values: Floats, places: Floats, held: bool
) -> SmoothCourse | None:
    """Course through values (m, f) at places along the path, mm; None: there is none within limits.

    Axes that carry the work move far in few steps, so that the smooth course begins between the steps: from
    the steps themselves it often ends at once, next to a singular pose.
    """
    if held:
        return task.held(_between(task.length, places, values))
    if isinstance(states.robot, MountedRobot):
        found = task.smoothed(_between(task.length, places, evened(values)))
        if found is not None:
            return found
    return task.smoothed(_between(task.length, places, values))


def _between(length: Floats, places: Floats, values: Floats) -> Floats:
    """Values (k, f) at lengths, by straight lines between those (m, f) at places, mm."""
    return np.stack([np.interp(length, places, column) for column in values.T], axis=1)


def evened(values: Floats) -> Floats:
    """Values (m, f) averaged over two steps of theirs, which become straight lines; ends go on as inside."""
    out = values.copy()
    for column in out.T:
        steps = int(np.count_nonzero(np.diff(column)))
        half = min(len(column) // (steps + 1), len(column) - 1) if steps else 0
        if half:
            before, after = 2 * column[0] - column[half:0:-1], 2 * column[-1] - column[-2 : -half - 2 : -1]
            padded = np.concatenate([before, column, after])
            column[:] = np.convolve(padded, np.full(2 * half + 1, 1 / (2 * half + 1)), "valid")
    return out


def stations(poses: Floats, length: Floats) -> Any:
    """Indices of poses for the sweep: every `APART` mm or `TURNED` rad, the first and the last.

    Near poses leave a joint no time to hide a step of the turn behind the motion of the others.
    """
    dots = np.einsum("mij,mij->m", poses[1:, :3, :3], poses[:-1, :3, :3])
    turns = np.arccos(np.clip(0.5 * (dots - 1.0), -1.0, 1.0))
    way = (length - length[0]) / APART + np.append(0.0, np.cumsum(turns)) / TURNED
    kept = np.unique(np.floor(way), return_index=True)[1]
    return np.union1d(kept, [0, len(poses) - 1])


def unwound(states: SpinStates, picks: Floats) -> Floats:
    """Values (m, f) of picked candidates, turns in sequence."""
    values: Floats = states.values[picks]
    turns = np.flatnonzero(states.around)
    values[:, turns] = np.unwrap(values[:, turns], axis=0)
    return values


def _chosen(states: SpinStates, group: int, course: SmoothCourse) -> RobotChoice:
    return RobotChoice(group, dict(zip(states.names, course.splines, strict=True)), course.joints)
