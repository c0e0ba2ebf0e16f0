"""Choice of branch, turn of the tool and wrist radius along a path."""

from typing import Any

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._branches import travel_of
from sdpgrind.finishing.arm._choice import RobotChoice
from sdpgrind.finishing.arm._inverse import checked_poses
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
        between = np.stack([np.interp(length, length[chosen], column) for column in values.T], axis=1)
        task = CourseTask(states, given, length, sweep.group)
        course = task.held(between) if held else task.smoothed(between)
        if course is not None and travel_of(robot, course.joints)[1] < 0:
            found.append(_chosen(states, sweep.group, course))
        failed = ValueError("no smooth turn of the tool stays within limits along the path")
    if not found:
        raise failed
    return found


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
    values = states.values[picks]
    if states.around:
        values[:, 0] = np.unwrap(values[:, 0])
    return values


def _chosen(states: SpinStates, group: int, course: SmoothCourse) -> RobotChoice:
    return RobotChoice(group, dict(zip(states.names, course.splines, strict=True)), course.joints)
