"""A robot whose work is carried by axes of its own: turntables, sliding tables."""

import math
from collections.abc import Mapping
from dataclasses import KW_ONLY
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import Described, custom, described
from sdpgrind.finishing.arm._carriers import MOST, LinearTable, Turntable
from sdpgrind.finishing.arm._inverse import checked_poses
from sdpgrind.finishing.arm._robot import Redundancy, Robot
from sdpgrind.finishing.arm._serial import SerialRobot

_TAKEN = ("spin", "wrist_radius")  # other freedoms of `Posture.free`


def _inner(name: str, value: Any) -> Robot:
    """Check a robot, which has an inverse and no carried work yet."""
    if not isinstance(value, Robot):
        raise TypeError(
            f"{name} must be a robot: an Arm, a SerialRobot, or of the protocol finishing.Robot;"
            f" got {checks.shown(value)}"
        )
    if isinstance(value, MountedRobot):
        raise ValueError(
            f"{name} must have no axes yet; finishing.arm.mounted adds to those of a MountedRobot"
        )
    if isinstance(value, SerialRobot):
        _ = value.closed_form  # refused where there is none
    return value


def _carriers(name: str, value: Any) -> tuple[Turntable | LinearTable, ...]:
    found = tuple(value)
    if not found:
        raise ValueError(f"{name} must be one or more: a Turntable or a LinearTable; got none")
    for k, each in enumerate(found):
        if not isinstance(each, Turntable | LinearTable):
            raise TypeError(f"{name}[{k}] must be a Turntable or a LinearTable; got {checks.shown(each)}")
    return found


@described("finishing.mounted_robot")
class MountedRobot(Described):
    """A robot with axes that carry the work, its last joints; `mounted` makes it.

    Parameters
    ----------
    robot : Robot
        The robot, mm, rad.
    axes : tuple of Turntable or LinearTable
        The first stands in the base (on the table of an `Arm`), the next on it; the work on the last.
    axis_names : tuple of str
        Names of the joints that they are.

    Raises
    ------
    ValueError
        As of `mounted`.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> rail = finishing.arm.LinearTable((0, 1, 0), (-500, 500), speed_max=400.0, acceleration_max=2000.0)
    >>> robot = finishing.robot("ur10").replace(jerk_max=None)
    >>> cell = finishing.arm.MountedRobot(robot, axes=(rail,), axis_names=("rail",))
    >>> joints = [0.3, -1.5, 1.8, -1.8, -1.5, 0.1, 20.0]
    >>> (cell.forward(joints) - cell.forward_work(joints))[:3, 3].round(9).tolist()  # mm
    [0.0, 20.0, 0.0]
    """

    robot: Robot = custom(_inner)
    _: KW_ONLY
    axes: tuple[Turntable | LinearTable, ...] = custom(_carriers)
    axis_names: tuple[str, ...] = custom(lambda name, value: tuple(value))

    def _check(self) -> None:
        if len(self.axis_names) != len(self.axes):
            raise ValueError(
                f"axis_names must be one for each of the {len(self.axes)} axes; got {len(self.axis_names)}"
            )
        checks.unique("names of the joints", self.names)
        for name in self.axis_names:
            if name in _TAKEN:
                raise ValueError(f"name of an axis must not be that of another freedom; got {name!r}")
        if self.combinations > MOST:
            raise ValueError(
                f"candidates of the axes must be at most {MOST} together; got {self.combinations}"
            )
        self._check_jerks()

    def _check_jerks(self) -> None:
        """Refuse limits of jerk that only some of robot and axes have."""
        jerks = [self.robot.jerk_max, *(axis.jerk_max for axis in self.axes)]
        named = zip(("the robot", *self.axis_names), jerks, strict=True)
        lacks = [name for name, jerk in named if jerk is None]
        if 0 < len(lacks) < len(jerks):
            raise ValueError(
                "jerk_max must be given for the robot and all axes (rad/s^3, mm/s^3), or for none; it is"
                f" None for {', '.join(lacks)}"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints, (n,); the axes come last, that of the work at the end."""
        return (*self.robot.names, *self.axis_names)

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the joints, (n,): "rad" or "mm"."""
        return (*self.robot.units, *(axis.unit for axis in self.axes))

    @property
    def position_min(self) -> tuple[float, ...]:
        """Least positions, (n,), rad or mm."""
        return self._limits("position_min")

    @property
    def position_max(self) -> tuple[float, ...]:
        """Greatest positions, (n,), rad or mm."""
        return self._limits("position_max")

    @property
    def speed_max(self) -> tuple[float, ...]:
        """Greatest speeds, (n,), rad/s or mm/s."""
        return self._limits("speed_max")

    @property
    def acceleration_max(self) -> tuple[float, ...]:
        """Greatest accelerations, (n,), rad/s^2 or mm/s^2."""
        return self._limits("acceleration_max")

    @property
    def jerk_max(self) -> tuple[float, ...] | None:
        """Greatest jerks, (n,), rad/s^3 or mm/s^3. None: no limit."""
        return None if self.robot.jerk_max is None else self._limits("jerk_max")

    def _limits(self, name: str) -> tuple[float, ...]:
        return (
            *map(float, getattr(self.robot, name)),
            *(float(getattr(axis, name)) for axis in self.axes),
        )

    @property
    def redundancy(self) -> tuple[Redundancy, ...]:
        """Freedoms that a pose leaves, rad or mm: a position of each axis, then those of the robot."""
        each = zip(self.axis_names, self.axes, strict=True)
        return (*(Redundancy(name, axis.candidates) for name, axis in each), *self.robot.redundancy)

    @property
    def combinations(self) -> int:
        """Number of combinations of the axes' candidates, unit 1."""
        return math.prod(len(axis.candidates) for axis in self.axes)

    def _split(self, joints: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Joints of the robot (..., n - e), and positions of the axes (..., e)."""
        found, count = checks.finite_array("joints", joints, "rad, mm"), len(self.names)
        if found.ndim == 0 or found.shape[-1] != count:
            raise ValueError(f"joints must be of shape (..., {count}) (rad, mm); got {found.shape}")
        cut = count - len(self.axes)
        return found[..., :cut], found[..., cut:]

    def forward(self, joints: npt.ArrayLike) -> Floats:
        """Return the poses of the tool in the base, whatever the axes.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.

        Returns
        -------
        array (..., 4, 4)
            Positions in mm.
        """
        return self.robot.forward(self._split(joints)[0])

    def forward_work(self, joints: npt.ArrayLike) -> Floats:
        """Return the poses of the tool as the work sees it, moved back by the axes that carry it.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.

        Returns
        -------
        array (..., 4, 4)
            Positions in mm.
        """
        own, values = self._split(joints)
        return _back(self.carriage(values), self.robot.forward_work(own))

    def carriage(self, values: npt.ArrayLike) -> Floats:
        """Return the motions of the work from its place with all axes at zero.

        Parameters
        ----------
        values : array_like (..., e)
            Positions of the axes, rad or mm.

        Returns
        -------
        array (..., 4, 4)
            Rigid motions, mm.
        """
        given = np.asarray(values, dtype=float)
        out = self.axes[0].motions(given[..., 0])
        for k, axis in enumerate(self.axes[1:], start=1):
            out = out @ axis.motions(given[..., k])
        return out

    def jacobian(self, joints: npt.ArrayLike) -> Floats:
        """Return the Jacobian of the pose of the tool in the work, from those of robot and axes.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.

        Returns
        -------
        array (..., 6, n)
            Velocity (mm/s) and angular velocity (rad/s) in the axes of the work, per rad/s or mm/s of a
            joint.
        """
        own, values = self._split(joints)
        poses, slopes = self.robot.forward_work(own), self.robot.jacobian(own)
        for k, axis in enumerate(self.axes):
            slopes = np.concatenate([slopes, axis.drift(poses)[..., None]], axis=-1)
            motion = axis.motions(values[..., k])
            poses, turn = _back(motion, poses), np.swapaxes(motion[..., :3, :3], -1, -2)
            slopes = np.concatenate([turn @ slopes[..., :3, :], turn @ slopes[..., 3:, :]], axis=-2)
        return slopes

    def ways(self, joints: npt.ArrayLike, shift: Floats) -> Floats:
        """Return the ways (..., e) of the work at the tool per rad, or mm, of each axis, mm.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.
        shift : array (4, 4)
            The place in the frame of the tool, mm.
        """
        own, values = self._split(joints)
        poses, out = self.robot.forward_work(own) @ shift, np.empty(values.shape)
        for k, axis in enumerate(self.axes):
            out[..., k] = np.linalg.norm(axis.drift(poses)[..., :3], axis=-1)
            poses = _back(axis.motions(values[..., k]), poses)
        return out

    def solutions(self, poses: npt.ArrayLike) -> Floats:
        """Return the joints of every branch of the robot at all candidates of the axes.

        Parameters
        ----------
        poses : array_like (m, 4, 4)
            Poses of the tool as the work sees it, mm.

        Returns
        -------
        array (m, c b, n)
            Joints, rad or mm: all b branches at the first of c combinations of candidates, then at the next;
            the first axis varies slowest. NaN where a branch does not reach the pose.
        """
        given = checked_poses(poses)
        every = np.array(list(product(*(axis.candidates for axis in self.axes))))
        parts = []
        for values in every:
            found = np.asarray(self.robot.solutions(self.carriage(values) @ given), dtype=float)
            parts.append(self.with_axes(found, np.broadcast_to(values, (len(given), values.size))))
        return np.concatenate(parts, axis=1)

    def with_axes(self, joints: Floats, values: Floats) -> Floats:
        """Return joints (m, b, n) of robot and axes; NaN where there are none of the robot, rad or mm.

        Parameters
        ----------
        joints : array (m, b, n - e)
            Joints of the robot, rad or mm.
        values : array (m, e)
            Positions of the axes, rad or mm.
        """
        there = ~np.isnan(joints).any(axis=-1, keepdims=True)
        carried = np.where(there, values[:, None, :], np.nan)
        return np.concatenate([joints, carried], axis=-1)

    def singularities(self, joints: npt.ArrayLike) -> Mapping[str, Floats]:
        """Return the distances of the robot from its singular poses, unit 1.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.

        Returns
        -------
        dict
            Name -> array (...).
        """
        return self.robot.singularities(self._split(joints)[0])


def _back(motions: Floats, poses: Floats) -> Floats:
    """Poses (..., 4, 4) as seen from what was moved by rigid motions."""
    out = np.empty(np.broadcast_shapes(motions.shape, poses.shape))
    turn = np.swapaxes(motions[..., :3, :3], -1, -2)
    out[..., :3, :3] = turn @ poses[..., :3, :3]
    out[..., :3, 3] = (turn @ (poses[..., :3, 3] - motions[..., :3, 3])[..., None])[..., 0]
    out[..., 3, :] = 0.0, 0.0, 0.0, 1.0
    return out


def mounted(robot: Robot, **axes: Turntable | LinearTable) -> MountedRobot:
    """Return a robot whose work lies on axes that carry it: turntables, sliding tables.

    The axes become its last joints, the work on the last of them. The planner chooses their positions along a
    path from their candidates, together with the branch of the robot, and makes them smooth; or holds them
    where that is faster. The time that the choice takes grows by the square of the number of candidates,
    those of all axes and turns of the tool multiplied.

    Programs in "csv" and "ros" tell the axes as joints; in "rapid" and "krl" they are external axes of a unit
    that moves the work object, coordinated with the robot. In RAPID the unit has the name of the last axis,
    on which the work lies.

    Parameters
    ----------
    robot : Robot
        The robot; of one that has such axes, more of them stand on those.
    **axes : Turntable or LinearTable
        Name of a joint -> axis, mm, rad, s; the first stands in the base, the next on it.

    Returns
    -------
    MountedRobot
        Robot of the joints of both, rad or mm.

    Raises
    ------
    ValueError
        When there is no axis, or two joints have one name; when only some have a limit of jerk; or when the
        robot has no inverse.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> table = finishing.arm.Turntable((800, 0, 100), speed_max=2.0, acceleration_max=5.0, jerk_max=50.0)
    >>> cell = finishing.arm.mounted(finishing.robot("ur10"), turntable=table)
    >>> cell.names[-1], cell.units[-1], len(cell.redundancy[0].values)
    ('turntable', 'rad', 24)
    >>> joints = [0.3, -1.5, 1.8, -1.8, -1.5, 0.1, 0.7]
    >>> found = cell.replace(axes=(table.replace(angles=(0.7,)),)).solutions([cell.forward_work(joints)])[0]
    >>> bool(abs(found - joints).max(axis=1).min() < 1e-9)
    True
    """
    if not isinstance(robot, MountedRobot):
        return MountedRobot(robot, axes=tuple(axes.values()), axis_names=tuple(axes))
    both = (*robot.axes, *axes.values())
    return robot.replace(axes=both, axis_names=(*robot.axis_names, *axes))
