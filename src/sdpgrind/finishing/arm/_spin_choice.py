"""Choice of branch, turn of the tool and wrist radius along a path."""

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._choice import RobotChoice
from sdpgrind.finishing.arm._inverse import checked_poses
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.arm._spin_course import CourseTask, SmoothCourse
from sdpgrind.finishing.arm._spin_states import Spins, SpinStates, states_of
from sdpgrind.finishing.arm._spin_sweep import swept


def choose_spun(robot: Robot, poses: Floats, length: Floats, spins: Spins) -> RobotChoice:
    """Return the smooth course of a robot whose tool may turn, near that of least travel.

    Where no smooth one near it stays within the limits, near that of the best turn that is held. ValueError
    where there is none.
    """
    states, given = states_of(robot, spins), checked_poses(poses)
    for held in (False, True):
        found = swept(states, given, held=held)
        course = CourseTask(states, given, length, found.group).smoothed(unwound(states, found.picks))
        if course is not None:
            return _chosen(states, found.group, course)
    raise ValueError("no smooth turn of the tool stays within limits along the path")


def unwound(states: SpinStates, picks: Floats) -> Floats:
    """Values (m, f) of picked candidates, turns in sequence."""
    values = states.values[picks]
    if states.around:
        values[:, 0] = np.unwrap(values[:, 0])
    return values


def _chosen(states: SpinStates, group: int, course: SmoothCourse) -> RobotChoice:
    return RobotChoice(group, dict(zip(states.names, course.splines, strict=True)), course.joints)
