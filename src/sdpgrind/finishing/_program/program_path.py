"""Path that a controller makes of a program: its moves, as a reader finds them."""

from dataclasses import dataclass, field

import numpy as np

from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.compare import MotionCheck, check_lines, check_table
from sdpgrind.finishing._program.course import PlannedMotion


def _none(*shape: int) -> Floats:
    return np.empty(shape)


@dataclass(frozen=True, eq=False, repr=False)
class ProgramPath(ByValue):
    """Moves of a program of a robot, read back from its text; see `read_program`.

    Attributes
    ----------
    target : {"urscript", "rapid", "krl", "csv", "ros"}
        Language.
    name : str
        Name of the program; "" of a table and of ROS.
    approach : array (a, n)
        Joint moves before the rest, rad.
    time : array (m,)
        Times of `joints`, s; empty where the program does not tell them.
    joints : array (m, n)
        Joints over time, rad or mm.
    speeds : array (m, n)
        Their speeds, rad/s or mm/s: cubics between the rows. Empty: straight lines.
    names : tuple of str
        Names of these joints, where the program tells them.
    retract : array (b, n)
        Joint moves after the rest, rad.
    paces : array (a + b,)
        Greatest speeds of the leading joint in these moves, rad/s (URScript); else empty.
    points : array (k, 3)
        Ends of straight moves of the contact in the work, mm.
    turns : array (k, 4)
        Turns there, as quaternions x, y, z, w.
    feeds : array (k,)
        Feeds of the moves, mm/s.
    radii : array (k,)
        Length before each end at which a blend begins, mm. 0: exact.
    work, tool : array (4, 4)
        Work in the base, or in the frame of the unit that moves it; contact in the flange, mm.
    configuration : array (k, c)
        What the moves say about joints: quarters of a turn of axes 1, 4, 6 and the number of the branch
        (RAPID); status and turn (KRL).
    unit : str
        Unit that moves the work: its name (RAPID) or index (KRL); "": the work is at rest.
    begun : array (e,)
        External axes at the last of `approach`, as the text tells them: deg or mm, which it does not say.
    axes : array (k, e)
        External axes at the ends of straight moves, likewise in deg or mm.
    """

    target: str
    name: str = ""
    approach: Floats = field(default_factory=lambda: _none(0, 6))
    time: Floats = field(default_factory=lambda: _none(0))
    joints: Floats = field(default_factory=lambda: _none(0, 6))
    speeds: Floats = field(default_factory=lambda: _none(0, 6))
    names: tuple[str, ...] = ()
    retract: Floats = field(default_factory=lambda: _none(0, 6))
    paces: Floats = field(default_factory=lambda: _none(0))
    points: Floats = field(default_factory=lambda: _none(0, 3))
    turns: Floats = field(default_factory=lambda: _none(0, 4))
    feeds: Floats = field(default_factory=lambda: _none(0))
    radii: Floats = field(default_factory=lambda: _none(0))
    work: Floats = field(default_factory=lambda: np.eye(4))
    tool: Floats = field(default_factory=lambda: np.eye(4))
    configuration: Floats = field(default_factory=lambda: _none(0, 0))
    unit: str = ""
    begun: Floats = field(default_factory=lambda: _none(0))
    axes: Floats = field(default_factory=lambda: _none(0, 0))

    def check(self, motion: PlannedMotion) -> MotionCheck:
        """Follow the moves and compare them with a motion, at ten places a move and densely along the motion.

        Parameters
        ----------
        motion : Motion
            The plan, mm, s, rad.

        Returns
        -------
        MotionCheck
            `deviation`: greatest distance of the contact from the plan, or of a turn of the tool times the
            lever arm, mm; `angle_deviation`, rad; `feed_excess`: greatest feed beyond the planned one, mm/s;
            `joint_speed_excess`: greatest speed of a joint beyond its limit, share of it.

        Raises
        ------
        ValueError
            When blends overlap, or a move names another branch or turn of the joints (rad) than the motion's.
        """
        return check_table(self, motion) if self.time.size else check_lines(self, motion)

    def __repr__(self) -> str:
        count = self.time.size or self.feeds.size
        return f"ProgramPath({self.target} {self.name}, {count} {'rows' if self.time.size else 'moves'})"
