"""A planned motion: joints and feed over time, and the quantity nearest to its limit."""

import json
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.interpolate import CubicHermiteSpline

from sdpgrind.base import checks, pictures, stored
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.plans import Plan
from sdpgrind.base.sheets.blocks import AmountTable, figures
from sdpgrind.finishing._problem.joint_runs import least_duration
from sdpgrind.finishing._problem.motion_rows import columns_of
from sdpgrind.finishing._problem.placed import turned
from sdpgrind.finishing._problem.posture import Posture, posture_of_file, written
from sdpgrind.finishing._problem.problem import FinishingProblem, check_pressed
from sdpgrind.finishing._program.program import MotionProgram, program_of
from sdpgrind.finishing.arm._heading import pitch_cosine
from sdpgrind.finishing.arm._robot import Singularity
from sdpgrind.finishing.path._lifted_course import LiftedCourse
from sdpgrind.finishing.timing._violations import Violation

# chosen: relative excess of a limit that is an error; less is within the tolerance of the solvers
EXCEEDED = 1e-3


class MotionState(NamedTuple):
    """State of a motion at one or several times.

    Attributes
    ----------
    joints : array (..., n)
        Joints of the robot, rad or mm; those of a table come last.
    length : array (...)
        Length of path travelled, mm.
    feed_rate : array (...)
        Speed along the path, mm/s.
    """

    joints: Floats
    length: Floats
    feed_rate: Floats


class MotionError(ValueError):
    """A motion that exceeds a limit.

    Attributes
    ----------
    message : str
        Limit, excess and place.
    motion : Motion
        The motion itself (mm, rad, s).
    """

    def __init__(self, message: str, motion: "Motion") -> None:
        super().__init__(message)
        self.message, self.motion = message, motion


class Motion(Plan):
    """A motion along a path as rows over time; immutable. A sharp corner: one row for each feed direction.

    Attributes
    ----------
    problem : FinishingProblem
        The planned problem.
    method : str
        The time law.
    posture : Posture
        Branch, placement (mm, rad) and redundant freedoms (mm, rad).
    worst_violation : Violation
        Quantity nearest to its limit, or farthest beyond it; its time (s) and length (mm) count from the
        start of the motion.
    other_law : str
        Why some run has another time law than the method's; empty where none has.
    dataset : xarray.Dataset
        All rows, with units.
    """

    kind = "finishing.motion"

    def __init__(
        self,
        problem: FinishingProblem,
        method: str,
        posture: Posture,
        worst: Violation,
        data: xr.Dataset,
        other_law: str = "",
    ) -> None:
        self.problem, self.method, self.posture, self.worst_violation = problem, method, posture, worst
        self._data, self.other_law = data, other_law
        for column in data.variables.values():
            if column.dtype.kind == "f":
                column.values.flags.writeable = False

    @property
    def time(self) -> Floats:
        """Times of the rows, s, shape (m,); a sharp corner has the same time twice."""
        return self._own("time")

    @property
    def duration(self) -> float:
        """Duration of the motion, s."""
        return float(self.time[-1])

    @property
    def length(self) -> Floats:
        """Length of path travelled, mm, shape (m,)."""
        return self._own("length")

    @property
    def feed_rate(self) -> Floats:
        """Speed along the path, mm/s, shape (m,)."""
        return self._own("feed_rate")

    @property
    def joints(self) -> Floats:
        """Joints, shape (m, n), rad or mm; those of a table come last."""
        return self._own("joints")

    @property
    def joint_speed(self) -> Floats:
        """Speeds of the joints, shape (m, n), rad/s or mm/s."""
        return self._own("joint_speed")

    @property
    def spin(self) -> Floats:
        """Turn of the tool about its own axis from that of the problem, rad, shape (m,); 0: it is held."""
        return self._own("spin") if "spin" in self._data else np.zeros(len(self.time))

    @property
    def torque_per_force(self) -> Floats:
        """Motor torque per normal force, N m/N, shape (m,); depends on the direction of feed.

        Raises
        ------
        ValueError
            The tool is face-on, with a contact_angle of pi/2 (rad), or turns about its own axis.
        """
        check_pressed(self.problem)
        return self._own("torque_per_force")

    @property
    def contact(self) -> Bools:
        """Whether the tool is on the work in each row, (m,); False (unit 1) in the lifts of a path."""
        if "contact" not in self._data:
            return np.ones(len(self.time), dtype=bool)
        return np.asarray(self._data["contact"].values == 1)

    def _own(self, name: str) -> Floats:
        return np.asarray(self._data[name].values)

    @cached_property
    def poses(self) -> Floats:
        """Poses A_P^B of the tool in the base frame (mm), Wang eq. (1), shape (m, 4, 4)."""
        return lasting(self.problem.robot.forward(self.joints))

    @cached_property
    def points(self) -> Floats:
        """Tool tips by the joints, in the frame of the surface, mm, shape (m, 3)."""
        return lasting(self._tips(self.joints))

    def _tips(self, joints: Floats) -> Floats:
        """Tool tips at `joints` (m, n) in the frame of the surface, mm, shape (m, 3)."""
        poses = self.problem.robot.forward_work(joints)
        x, y, z, *turn = self.posture.placement
        tips: Floats = poses[:, :3, 3] + self.problem.lever_arm * poses[:, :3, 2] - np.array([x, y, z])
        return turned(tips, -turn[0]) if turn else tips

    @cached_property
    def error(self) -> float:
        """Largest distance of the tool tip from the path, in rows and half way between them, mm."""
        middle = self.at((self.time[1:] + self.time[:-1]) / 2)
        tips = self._tips(np.concatenate([self.joints, middle.joints]))
        wanted = self.problem.path.at(np.concatenate([self.length, middle.length])).point
        return float(np.linalg.norm(tips - wanted, axis=1).max())

    @property
    def profile(self) -> Floats:
        """Times (s) and joints (rad, mm) for a robot controller, shape (k, n + 1), each time once."""
        table: Floats = np.column_stack([self.time, self.joints])[self._once]
        return table

    @property
    def profile_speed(self) -> Floats:
        """Speeds of the joints at the times of `profile`, shape (k, n), rad/s or mm/s."""
        return self.joint_speed[self._once]

    @property
    def _once(self) -> Bools:
        """Rows without the second ones of sharp corners."""
        return np.concatenate([[True], np.diff(self.time) > 0])

    @cached_property
    def _splines(self) -> tuple[Any, Any]:
        once = self._once
        t = self.time[once]
        along = CubicHermiteSpline(t, self.length[once], self.feed_rate[once])
        return CubicHermiteSpline(t, self.joints[once], self.joint_speed[once]), along

    def at(self, time: npt.ArrayLike) -> MotionState:
        """Return joints, length and feed rate at `time`, by cubic splines through the rows.

        Parameters
        ----------
        time : float or array
            Times in [0, duration], s.

        Returns
        -------
        MotionState
            Joints (..., n) in rad or mm, length in mm, feed rate in mm/s.

        Raises
        ------
        ValueError
            When a time is outside.
        """
        asked = checks.inside("time", time, 0.0, self.duration, "s")
        joints, along = self._splines
        return MotionState(joints(asked), along(asked), along(asked, 1))

    @property
    def mean_feed_rate(self) -> float:
        """Path length over duration, mm/s."""
        return float(self.length[-1] / self.duration)

    @cached_property
    def lower_bound(self) -> float:
        """Duration that no time law on this path and in this posture is below, s; see `timing.lower_bound`.

        It is proved, and does without limits of jerk and of acceleration along the path: where these rule, it
        is far below what is possible. The joints along the path are found again for it.
        """
        return least_duration(self.problem)

    @property
    def gap(self) -> float:
        """Greatest share of the duration that a faster law could save, unit 1; from `lower_bound`."""
        return 1 - self.lower_bound / self.duration

    @property
    def least_cos_pitch(self) -> float:
        """Least ``|cos phi|`` of the tool axis, unit 1; an arm's q1 turns faster by its inverse."""
        return float(pitch_cosine(self.poses).min())

    @cached_property
    def worst_singularity(self) -> Singularity:
        """Row nearest to a singular pose: distances (unit 1), its time (s) and length (mm)."""
        found = self.problem.robot.singularities(self.joints)
        each = {name: float(np.min(distance)) for name, distance in found.items()}
        name = min(each, key=lambda known: each[known])
        row = int(np.argmin(found[name]))
        return Singularity(name, each[name], float(self.time[row]), float(self.length[row]), each)

    @property
    def status(self) -> str:
        """One sentence: the quantity nearest to its limit, or farthest beyond it (rad, mm, s)."""
        worst = self.worst_violation
        kept = (
            "all limits are held"
            if worst.held
            else "all limits are held to 0.1 %"
            if worst.ratio <= 1 + EXCEEDED
            else ""
        )
        said = f"{kept}, the nearest is the {worst}" if kept else f"exceeded is the {worst}"
        return f"{said}; {self.other_law}" if self.other_law else said

    def program(
        self,
        target: str,
        *,
        deviation: float = 0.02,
        name: str = "finishing",
        timing: bool = False,
        date: str | None = None,
    ) -> MotionProgram:
        """Return the motion as a program of a robot's controller: URScript, RAPID, KRL, ROS, or a table.

        Straight moves of the contact with blends, as few as the deviation allows; they start and end 20 mm
        off the work, no faster than the motion drives on it. Feeds are the planned means of the moves; the
        controller's own law of time applies.
        Times are kept by ``"csv"``, joints at the rows of the motion; by ``"ros"``, joints and their speeds
        at the rows as ``trajectory_msgs/JointTrajectory`` in JSON; by ``"urscript"`` with `timing`, joints
        every 8 ms. No program has been run on a controller; its blends differ from circles.

        Parameters
        ----------
        target : {"urscript", "rapid", "krl", "csv", "ros"}
            Language of the controller; a warning names that of a robot whose maker is known, where another is
            asked for. All but "csv" and "ros" need a `SerialRobot`. Axes that carry the work (`mounted`) are
            external axes of a coordinated unit in "rapid" (six) and "krl" (two), as the head of the program
            says; "urscript" refuses them. ROS knows joints by `robot.names`: those of a URDF, or of
            ``robot.replace(names=...)``.
        deviation : float
            Greatest distance of the contact from the plan, and of a turn of the tool times the lever arm,
            mm; half for chords, half for blends.
        name : str
            Name of the program, in letters, digits and _; at most 24 in KRL, 30 in RAPID.
        timing : bool
            Whether URScript keeps the times.
        date : str, optional
            Date for the head of the program. Default: none, so that equal motions have equal programs.

        Returns
        -------
        MotionProgram
            Program with `text`, `check()` and `save(path)`.

        Raises
        ------
        ValueError
            When there is no such target, the deviation (mm) or the name is not allowed, the robot has no
            known flange, cannot be lifted off the work, or has axes under it that the controller lacks.

        Examples
        --------
        >>> from sdpgrind import finishing
        >>> robot = finishing.robot("ur10").replace(tool=finishing.tool(length=150.0))
        >>> path = finishing.hilbert(finishing.preset("nominal").surface, 2)
        >>> place = (650.0, -25.0, 100.0)  # mm
        >>> motion = finishing.plan(finishing.FinishingProblem(path, robot=robot, placement=place))
        >>> program = motion.program("urscript", name="face1")
        >>> program.text.splitlines()[-4].strip()[:26], program.check().deviation <= 0.02
        ('movel(pose_trans(work, p[0', True)
        """
        return program_of(self, target, deviation, name, timing, date)

    def plot(self) -> Any:
        """Draw the feed (mm/s) along the path and the joints' shares of their limits over time (s)."""
        return pictures.drawn("sdpgrind.finishing._problem.motion_picture:plot", self)

    def _figures(self) -> tuple[AmountTable]:
        rows = (
            ("duration", self.duration, "s"),
            ("length", float(self.length[-1]), "mm"),
            ("mean_feed_rate", self.mean_feed_rate, "mm/s"),
            ("tool_off_the_path", self.error, "mm"),
            ("least_cos_pitch", self.least_cos_pitch, "1"),
            *((("turn of the tool", float(np.ptp(self.spin)), "rad"),) if "spin" in self._data else ()),
            ("nearest singularity", f"{self.worst_singularity}", ""),
            ("nearest limit", f"{self.worst_violation}", ""),
            ("time law", self.method, ""),
        )
        return (figures("The motion", *rows),)

    @property
    def dataset(self) -> xr.Dataset:
        """Rows and problem as labelled arrays: lengths in mm, angles in rad, times in s."""
        told = {"problem": stored.encode(self.problem), "method": self.method}
        if self.other_law:
            told["other_law"] = self.other_law
        told["posture"] = written(self.posture, columns_of(self._data, self.posture.free))
        told["worst_violation"] = json.dumps(self.worst_violation)
        return self._data.assign_attrs(told)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        told = dataset.attrs
        problem, method = stored.decode(told["problem"]), str(told["method"])
        columns = columns_of(dataset, [freedom.name for freedom in problem.robot.redundancy])
        posture = posture_of_file(json.loads(told["posture"]), dataset.sizes["row"], columns)
        worst = Violation(*json.loads(told["worst_violation"]))
        other = str(told.get("other_law", ""))  # not in files of version 0.1.0
        return cls(problem, method, posture, worst, dataset.drop_attrs(deep=False), other)

    def _told(self) -> str:
        way = f"{self.length[-1]:.0f} mm in {self.duration:.2f} s"
        share = 100 * self.mean_feed_rate / self.problem.feed_rate
        air = ", lifts included" if isinstance(self.problem.path, LiftedCourse) else ""
        return f"{way}, {share:.0f} % of the feed rate{air}, {self.method}; {self.status}"
