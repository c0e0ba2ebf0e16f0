"""A planned motion: where the tool and every joint is when, and what comes nearest to a limit."""

import json
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.interpolate import CubicHermiteSpline

from sdpgrind.base import checks, pictures, stored
from sdpgrind.base.arrays import lasting
from sdpgrind.base.checks import Floats
from sdpgrind.base.plans import Plan
from sdpgrind.finishing._problem.problem import FinishingProblem
from sdpgrind.finishing.arm._heading import pitch_cosine
from sdpgrind.finishing.timing._violations import Violation

EXCEEDED = 1e-3
"""Of a limit: what is beyond it by more is an error."""


class Posture(NamedTuple):
    """How the arm is held all along.

    Attributes
    ----------
    wrist_radius : float
        Distance of the wrist from the first joint's axis, mm.
    branch : int
        0 to 3, see `Arm.inverse`.
    placement : (float, float, float)
        Origin of the surface over the base with the table at zero, mm.
    """

    wrist_radius: float
    branch: int
    placement: tuple[float, float, float]


class MotionState(NamedTuple):
    """A motion at one time, or at several.

    Attributes
    ----------
    joints : array (..., 7)
        Five joints of the arm in rad, two of the table in mm.
    length : array (...)
        Length of path behind, mm.
    feed_rate : array (...)
        Along the path, mm/s.
    """

    joints: Floats
    length: Floats
    feed_rate: Floats


class MotionError(ValueError):
    """A motion that exceeds a limit.

    Attributes
    ----------
    message : str
        Which, by how much and where.
    motion : Motion
        The motion itself (mm, rad, s).
    """

    def __init__(self, message: str, motion: "Motion") -> None:
        super().__init__(message)
        self.message, self.motion = message, motion


class Motion(Plan):
    """A motion along a path, row by row in time; immutable. At a sharp corner there are two rows, for both directions of feed.

    Attributes
    ----------
    problem : FinishingProblem
        What was planned.
    method : str
        The time law.
    posture : Posture
        Wrist radius (mm), branch and placement (mm).
    worst_violation : Violation
        What comes nearest to its limit, or exceeds it: quantity, joint, ratio, run, time (s) and length (mm) of the whole motion.
    dataset : xarray.Dataset
        All rows, with units.
    """

    kind = "finishing.motion"

    def __init__(
        self, problem: FinishingProblem, method: str, posture: Posture, worst: Violation, data: xr.Dataset
    ) -> None:
        self.problem, self.method, self.posture, self.worst_violation = problem, method, posture, worst
        self._data = data
        for column in data.variables.values():
            if column.dtype.kind == "f":
                column.values.flags.writeable = False

    @property
    def time(self) -> Floats:
        """Times of the rows, s, shape (m,); twice the same at a sharp corner."""
        return self._own("time")

    @property
    def duration(self) -> float:
        """Of the whole motion, s."""
        return float(self.time[-1])

    @property
    def length(self) -> Floats:
        """Length of path behind, mm, shape (m,)."""
        return self._own("length")

    @property
    def feed_rate(self) -> Floats:
        """Along the path, mm/s, shape (m,)."""
        return self._own("feed_rate")

    @property
    def joints(self) -> Floats:
        """Joints, shape (m, 7): five of the arm in rad, two of the table in mm."""
        return self._own("joints")

    @property
    def joint_speed(self) -> Floats:
        """Speeds of the joints, shape (m, 7): rad/s and mm/s."""
        return self._own("joint_speed")

    @property
    def torque_per_force(self) -> Floats:
        """Torque of the motor for each N of normal force, N m/N, shape (m,): it changes with the direction of feed."""
        return self._own("torque_per_force")

    def _own(self, name: str) -> Floats:
        return np.asarray(self._data[name].values)

    @cached_property
    def poses(self) -> Floats:
        """Poses A_P^B of the tool over the base (mm), with the table where it is: Wang (1); shape (m, 4, 4)."""
        return lasting(self.problem.arm.forward(self.joints))

    @cached_property
    def points(self) -> Floats:
        """Contact points in the frame of the surface, mm, shape (m, 3): where the joints put the tip of the tool."""
        return lasting(self._tips(self.joints))

    def _tips(self, joints: Floats) -> Floats:
        """Where joints put the tip of the tool, in the frame of the surface, mm."""
        poses = self.problem.arm.forward_work(joints)
        tips: Floats = (
            poses[:, :3, 3] + self.problem.lever_arm * poses[:, :3, 2] - np.array(self.posture.placement)
        )
        return tips

    @cached_property
    def error(self) -> float:
        """Largest distance between where the joints put the tip and the path, rows and between them, mm."""
        middle = self.at((self.time[1:] + self.time[:-1]) / 2)
        tips = self._tips(np.concatenate([self.joints, middle.joints]))
        wanted = self.problem.path.at(np.concatenate([self.length, middle.length])).point
        return float(np.linalg.norm(tips - wanted, axis=1).max())

    @property
    def profile(self) -> Floats:
        """Times (s) and joints (rad, mm), shape (k, 8), each time once: what a robot is given to play."""
        once = np.concatenate([[True], np.diff(self.time) > 0])
        table: Floats = np.column_stack([self.time, self.joints])[once]
        return table

    @cached_property
    def _splines(self) -> tuple[Any, Any]:
        once = np.concatenate([[True], np.diff(self.time) > 0])
        t = self.time[once]
        along = CubicHermiteSpline(t, self.length[once], self.feed_rate[once])
        return CubicHermiteSpline(t, self.joints[once], self.joint_speed[once]), along

    def at(self, time: npt.ArrayLike) -> MotionState:
        """Return joints, length and feed rate at any time.

        Parameters
        ----------
        time : float or array
            s, within 0 and the duration.

        Returns
        -------
        MotionState
            Joints (..., 7) in rad and mm, length in mm, feed rate in mm/s: that of a spline through the rows.

        Raises
        ------
        ValueError
            When a time is outside.
        """
        asked = checks.finite_array("time", time, "s")
        outside = (asked < 0) | (asked > self.duration)
        if np.any(outside):
            raise checks.refuse("time", f"in [0, {self.duration:g}]", float(asked[outside].flat[0]), "s")
        joints, along = self._splines
        return MotionState(joints(asked), along(asked), along(asked, 1))

    @property
    def mean_feed_rate(self) -> float:
        """Length of the path over the duration, mm/s."""
        return float(self.length[-1] / self.duration)

    @property
    def least_cos_pitch(self) -> float:
        """Least ``|cos phi|`` of the tool axis, unit 1: the first joint's speed grows like its inverse."""
        return float(pitch_cosine(self.poses).min())

    @property
    def status(self) -> str:
        """One sentence: what comes nearest to its limit, or exceeds it (rad, mm, s)."""
        worst = self.worst_violation
        kept = (
            "all limits are held"
            if worst.held
            else "all limits are held to 0.1 %"
            if worst.ratio <= 1 + EXCEEDED
            else ""
        )
        return f"{kept}, the nearest is the {worst}" if kept else f"exceeded is the {worst}"

    def plot(self) -> Any:
        """Draw feed (mm/s) along the path, and how much of their limits the joints use over time (s); return the figure."""
        return pictures.drawn("sdpgrind.finishing._problem.motion_picture:plot", self)

    @property
    def dataset(self) -> xr.Dataset:
        """All of it as labelled arrays: lengths in mm, angles in rad, times in s."""
        told = {"problem": stored.encode(self.problem), "method": self.method}
        told["posture"], told["worst_violation"] = json.dumps(self.posture), json.dumps(self.worst_violation)
        return self._data.assign_attrs(told)

    @classmethod
    def restored(cls, dataset: xr.Dataset) -> Self:
        told = dataset.attrs
        radius, branch, place = json.loads(told["posture"])
        worst = Violation(*json.loads(told["worst_violation"]))
        problem, method = stored.decode(told["problem"]), str(told["method"])
        return cls(
            problem, method, Posture(radius, branch, tuple(place)), worst, dataset.drop_attrs(deep=False)
        )

    def _told(self) -> str:
        way = f"{self.length[-1]:.0f} mm in {self.duration:.2f} s"
        share = 100 * self.mean_feed_rate / self.problem.feed_rate
        return f"{way}, {share:.0f} % of the feed rate, {self.method}; {self.status}"
