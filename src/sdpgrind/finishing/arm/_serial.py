"""A robot of joints in series, from its Denavit-Hartenberg rows or its URDF."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.arrays import ByValue
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.quantities import Described, array, custom, described
from sdpgrind.finishing.arm import _links
from sdpgrind.finishing.arm import _serial_kernels as kernels
from sdpgrind.finishing.arm._chain_checks import (
    CROOKED,
    UNITS,
    check_links,
    check_range,
    check_rigid,
    for_each,
    limit_units,
    numbers,
    rigid,
)
from sdpgrind.finishing.arm._chain_form import form_of
from sdpgrind.finishing.arm._closed_form import ClosedForm, inverted
from sdpgrind.finishing.arm._inverse import checked_poses
from sdpgrind.finishing.arm._mount import across, axis_on
from sdpgrind.finishing.arm._polish import solve_near
from sdpgrind.finishing.arm._robot import Redundancy, middle
from sdpgrind.finishing.arm._urdf import read_chain


@described("finishing.serial_robot", eq=False)
class SerialRobot(ByValue, Described):
    """A robot of joints in series, such as an industrial arm of six joints; work and base are at rest.

    The chain is ``links[0] J_1 links[1] ... J_n links[n] tool``; J_i is a turn about z by joint i, or a shift
    along z. `from_dh` and `from_urdf` make it. Poses, Jacobian and limits are those of any such chain. To
    plan with it, its inverse must have a closed form, which is found from the axes of its joints: a spherical
    wrist (axes 4, 5, 6 meet in a point; axes 2 and 3 are parallel), or axes 2, 3, 4 parallel (UR); or they
    are as near to one as a calibration leaves them, and the inverse is numeric.

    Parameters
    ----------
    names : sequence of str, (n,)
        Names of the joints.
    links : array_like, (n + 1, 4, 4)
        Rigid motions between the joints, the last one to the flange, mm.
    position_min, position_max : sequence of float, (n,)
        Limits of the joints, rad, mm; at most two turns.
    speed_max, acceleration_max, jerk_max : sequence of float, (n,)
        In rad/s, mm/s; in rad/s^2, mm/s^2; in rad/s^3, mm/s^3. jerk_max None: no limit.
    sliding : sequence of bool, (n,)
        Whether a joint slides. Default: all turn.
    tool : array_like, (4, 4)
        Frame P of the tool in the flange, mm; see `tool`. Default: P is the flange.

    Raises
    ------
    ValueError
        When there is not one limit for each joint, limits cross, one is not > 0 or in another unit, a motion
        is not rigid, or the reach is not that of a robot in mm.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> robot = finishing.robot("irb2400")
    >>> robot.forward([0.3, 0.2, -0.4, 0.5, 0.6, -0.7])[:3, 3].round(3)  # mm
    array([ 977.497,  326.461, 1560.909])
    >>> robot.closed_form
    'spherical wrist'
    """

    names: tuple[str, ...] = custom(lambda name, value: checks.unique(name, tuple(value)))
    links: Floats = array("mm")
    _: KW_ONLY
    position_min: tuple[float, ...] = custom(numbers, "rad, mm")
    position_max: tuple[float, ...] = custom(numbers, "rad, mm")
    speed_max: tuple[float, ...] = custom(numbers, "rad/s, mm/s")
    acceleration_max: tuple[float, ...] = custom(numbers, "rad/s^2, mm/s^2")
    jerk_max: tuple[float, ...] | None = custom(numbers, "rad/s^3, mm/s^3", default=None)
    sliding: tuple[bool, ...] = custom(lambda name, value: tuple(map(bool, value)), default=())
    tool: Floats = custom(rigid, "mm", default_factory=lambda: np.eye(4))

    def _check(self) -> None:
        if not self.sliding:
            object.__setattr__(self, "sliding", (False,) * len(self.names))
        check_links(self.links, len(self.names))
        for name in ("position_min", "position_max", *UNITS, "sliding"):
            value = getattr(self, name)
            if value is not None and len(value) != len(self.names):
                raise ValueError(
                    f"{name} must be one for each of the {len(self.names)} joints; got {len(value)}"
                )
        self._check_limits()

    @property
    def flange_axis(self) -> str:
        """Axis of the flange on that of the last joint, no unit: "x", "y" or "z"; "" where none is."""
        return axis_on(self.links[-1][2, :3])

    @property
    def tool_across(self) -> str:
        """What a plan warns of where the tool stands across the last axis, mm; "" where it does not."""
        return across(self.tool, self.links[-1][2, :3], self.flange_axis)

    def _field_units(self) -> dict[str, str]:
        return super()._field_units() | limit_units(self.units)

    def _check_limits(self) -> None:
        for row in zip(self.names, self.units, self.position_min, self.position_max, strict=True):
            check_range(*row)
        for name, per in UNITS.items():
            for joint, unit, value in zip(self.names, self.units, getattr(self, name) or (), strict=False):
                checks.positive(f"{name} of {joint}", value, unit + per)

    @classmethod
    def from_dh(
        cls,
        rows: npt.ArrayLike,
        *,
        position_min: Sequence[float],
        position_max: Sequence[float],
        speed_max: Sequence[float],
        acceleration_max: Sequence[float],
        jerk_max: Sequence[float] | None = None,
        names: Sequence[str] | None = None,
        tool: npt.ArrayLike | None = None,
    ) -> Self:
        """Return a robot of turning joints from standard Denavit-Hartenberg rows, T = Rz Tz Tx Rx.

        Parameters
        ----------
        rows : array_like, (n, 4)
            Offset of theta (rad), d (mm), a (mm), alpha (rad) of each link.
        position_min, position_max, speed_max, acceleration_max, jerk_max
            Limits, rad and s, see `SerialRobot`.
        names : sequence of str, optional
            Names of the joints. Default: q1, q2, ...
        tool : array_like, (4, 4), optional
            Frame of the tool in the flange, mm.

        Raises
        ------
        ValueError
            When a row is not four numbers, an angle is in degrees, or as of `SerialRobot`.

        Examples
        --------
        >>> import numpy as np
        >>> from sdpgrind import finishing
        >>> rows = [(0, 89.2, 0, np.pi / 2), (0, 0, -425, 0), (0, 0, -392.3, 0), (0, 109, 0, np.pi / 2),
        ...         (0, 93, 0, -np.pi / 2), (0, 82, 0, 0)]  # UR5
        >>> limits = dict(position_min=[-6.28] * 6, position_max=[6.28] * 6, speed_max=[3.14] * 6)
        >>> robot = finishing.SerialRobot.from_dh(rows, **limits, acceleration_max=[10.0] * 6)
        >>> robot.closed_form, robot.solutions(robot.forward([[0.1, -1.0, 1.2, 0.3, 0.8, 0.0]])).shape
        ('axes 2, 3, 4 parallel', (1, 8, 6))
        """
        links = _links.of_rows(rows)
        return cls(
            tuple(f"q{k}" for k in range(1, len(links))) if names is None else tuple(names),
            links,
            position_min=tuple(position_min),
            position_max=tuple(position_max),
            speed_max=tuple(speed_max),
            acceleration_max=tuple(acceleration_max),
            jerk_max=None if jerk_max is None else tuple(jerk_max),
            tool=np.eye(4) if tool is None else np.asarray(tool),
        )

    @classmethod
    def from_urdf(
        cls,
        path: str | os.PathLike[str],
        *,
        base: str,
        tip: str,
        acceleration_max: float | Sequence[float],
        jerk_max: float | Sequence[float] | None = None,
    ) -> Self:
        """Return the robot between two links of a URDF file, whose metres become mm.

        Read are joints (revolute, continuous, prismatic, fixed) with origin, axis and limits; meshes, masses
        and transmissions are skipped. A continuous joint gets two turns either way.

        Parameters
        ----------
        path : str or path
            The file.
        base, tip : str
            Names of the first and the last link of the chain.
        acceleration_max, jerk_max : float or sequence of float
            Limits that URDF does not have, for all joints or one for each: rad/s^2, mm/s^2; rad/s^3, mm/s^3.
            jerk_max None: no limit.

        Raises
        ------
        ValueError
            When the file is no URDF, has no such chain or several, a joint on it has no limits, follows
            another, or has no kind that is read (with its name); or as of `SerialRobot`.

        Examples
        --------
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> from sdpgrind import finishing
        >>> joint = (
        ...     '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><axis xyz="0 0 1"/>'
        ...     '<origin xyz="0.3 0 0"/><limit lower="-2" upper="2" velocity="1.5"/></joint>'
        ... )
        >>> text = '<robot name="two"><link name="a"/><link name="b"/><link name="c"/>{}{}</robot>'
        >>> with TemporaryDirectory() as folder:
        ...     path = Path(folder) / "two.urdf"
        ...     _ = path.write_text(text.format(joint.format("q", "a", "b"), joint.format("r", "b", "c")))
        ...     robot = finishing.SerialRobot.from_urdf(path, base="a", tip="c", acceleration_max=10.0)
        >>> robot.names, robot.forward([0.0, 0.0])[:3, 3].tolist()  # mm
        (('q', 'r'), [600.0, 0.0, 0.0])
        """
        chain = read_chain(path, base, tip)
        return cls(
            chain.names,
            _links.of_frames(chain.frames, chain.axes, chain.flange),
            position_min=chain.position_min,
            position_max=chain.position_max,
            speed_max=chain.speed_max,
            acceleration_max=for_each("acceleration_max", acceleration_max, chain.sliding),
            jerk_max=None if jerk_max is None else for_each("jerk_max", jerk_max, chain.sliding),
            sliding=chain.sliding,
        )

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the joints, (n,): "rad", or "mm" of those that slide."""
        return tuple("mm" if slides else "rad" for slides in self.sliding)

    @property
    def redundancy(self) -> tuple[Redundancy, ...]:
        """Freedoms (mm, rad) that a pose leaves: none."""
        return ()

    @cached_property
    def _slides(self) -> Bools:
        return np.array(self.sliding, dtype=np.bool_)

    @cached_property
    def _chain(self) -> Floats:
        """Links with the tool in the last one."""
        out = self.links.copy()
        out[-1] = out[-1] @ self.tool
        return out

    def forward(self, joints: npt.ArrayLike) -> Floats:
        """Return the poses of the tool in the base frame.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.

        Returns
        -------
        array (..., 4, 4)
            Positions in mm.
        """
        return self._poses(self._checked(joints))

    def _poses(self, joints: Floats) -> Floats:
        rows = np.ascontiguousarray(joints.reshape(-1, len(self.names)))
        out = np.empty((len(rows), 4, 4))
        kernels.forward(self._chain, self._slides, rows, out)
        return out.reshape(*joints.shape[:-1], 4, 4)

    def forward_work(self, joints: npt.ArrayLike) -> Floats:
        """Return the poses of the tool in the frame of the work, which is at rest: as `forward`.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.

        Returns
        -------
        array (..., 4, 4)
            Positions in mm.
        """
        return self.forward(joints)

    def jacobian(self, joints: npt.ArrayLike) -> Floats:
        """Return the Jacobian of the pose of the tool, in closed form.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.

        Returns
        -------
        array (..., 6, n)
            Velocity (mm/s) and angular velocity (rad/s) in the axes of the base, per rad/s or mm/s of a
            joint.
        """
        given = self._checked(joints)
        rows = np.ascontiguousarray(given.reshape(-1, len(self.names)))
        out, poses = np.empty((len(rows), 6, len(self.names))), np.empty((len(rows), 4, 4))
        kernels.forward(self._chain, self._slides, rows, poses)
        kernels.jacobian(self._chain, self._slides, rows, poses, out)
        return out.reshape(*given.shape[:-1], 6, len(self.names))

    def _checked(self, joints: npt.ArrayLike) -> Floats:
        found = checks.finite_array("joints", joints, "rad, mm")
        if found.ndim == 0 or found.shape[-1] != len(self.names):
            raise ValueError(f"joints must be of shape (..., {len(self.names)}) (rad, mm); got {found.shape}")
        return found

    @cached_property
    def _form(self) -> ClosedForm | str:
        """Closed form of the inverse, or the sentence that says why there is none."""
        return form_of(self)

    def _inverse(self) -> ClosedForm:
        if isinstance(self._form, str):
            raise ValueError(self._form)
        return self._form

    @property
    def closed_form(self) -> str:
        """Closed form of the inverse: "spherical wrist" or "axes 2, 3, 4 parallel".

        "near ..." of a robot whose axes keep that to 2e-4 rad and 0.2 mm, as files with few decimals leave
        them; "..., calibrated: numeric" to 5e-3 rad and 5 mm, as calibrations leave them. Solutions of the
        robot nearby, `nearest_closed_form`, are polished on the robot's own chain then.

        Raises
        ------
        ValueError
            When the robot is near none, with the axes that break both (off by mm, rad).
        """
        form = self._inverse()
        name = "spherical wrist" if form.wrist else "axes 2, 3, 4 parallel"
        if form.calibrated:
            return f"{name}, calibrated: numeric"
        return f"near {name}" if form.near else name

    @property
    def nearest_closed_form(self) -> Self:
        """Robot in closed form whose axes (rad) and lengths (mm) are next to this one's.

        Its pose at joints of zero is this one's. Names, limits and tool are kept. A robot that has a closed
        form is its own.

        Raises
        ------
        ValueError
            When the robot is near none, with the axes that break both.

        Examples
        --------
        >>> import numpy as np
        >>> from sdpgrind import finishing
        >>> links = finishing.robot("ur10").links.copy()
        >>> links[2, :3, 3] += [0.4, -0.3, 0.5]  # mm
        >>> links[5, :3, 3] += [0.2, 0.6, -0.7]
        >>> robot = finishing.robot("ur10").replace(links=links)
        >>> robot.closed_form, robot.nearest_closed_form.closed_form
        ('axes 2, 3, 4 parallel, calibrated: numeric', 'axes 2, 3, 4 parallel')
        """
        form = self._inverse()
        return self.replace(links=form.links()) if form.near else self

    def solutions(self, poses: npt.ArrayLike) -> Floats:
        """Return the joints of all eight branches, in closed form or from that of the robot nearby.

        Each angle is the turn nearest to the middle of its limits, within them or not. Branch 4 k + 2 w + e:
        k, w and e are 0 or 1 for the positive or negative shoulder (side of axis 1 on which the wrist is),
        wrist (sine of joint 5) and elbow (sine of joint 3, both counted from the stretched pose).

        Where the sine of joint 5 is below 1e-12, joint 4 of a spherical wrist, or joint 6 of parallel axes,
        is 0 and the other takes the rest; where the wrist is within 1e-9 mm of axis 1 so is the angle of the
        plane of the arm. Cosines up to 1 + 1e-12 are taken as rounding of 1.

        Where the closed form is that of a robot nearby (see `closed_form`), damped least squares take each of
        its solutions to 1e-9 mm on the chain; a branch that is lost begins again from its joints at the pose
        before, where that is within 50 mm (and rad times 100 mm). A branch that is still lost, or ends where
        another does, is NaN: so may be those within some mm of the end of reach, or near singular sets.

        Parameters
        ----------
        poses : array_like (m, 4, 4)
            Poses of the tool in the base, mm.

        Returns
        -------
        array (m, 8, 6)
            Joints, rad; NaN where a branch does not reach the pose.

        Raises
        ------
        ValueError
            When a pose is no rigid motion, or the robot has no closed form, with the axes that break it.

        Examples
        --------
        >>> import numpy as np
        >>> from sdpgrind import finishing
        >>> robot, joints = finishing.robot("ur10"), [0.3, -1.5, 1.8, -1.8, -1.5, 0.1]
        >>> found = robot.solutions([robot.forward(joints)])[0]
        >>> bool(np.abs(found - joints).max(axis=1).min() < 1e-12)
        True
        """
        return self._solved(poses)[0]

    def _solved(self, poses: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Joints of all branches (m, 8, 6), and mm by which each pose is out of their reach (m, 8)."""
        form, given = self._inverse(), checked_poses(poses)
        turn = given[:, :3, :3]
        off = np.abs(turn.transpose(0, 2, 1) @ turn - np.eye(3)).max(axis=(1, 2), initial=0.0)
        for k in np.flatnonzero(off > CROOKED)[:1]:
            check_rigid(f"poses[{k}]", given[k])
        flange = given if self._bare else np.ascontiguousarray(given @ self._off_tool)
        if not form.near:
            return form.solve(flange, middle(self))
        return solve_near(form, self.links, self._slides, flange, middle(self))

    @cached_property
    def _off_tool(self) -> Floats:
        return inverted(self.tool)

    @cached_property
    def _bare(self) -> bool:
        return bool(np.array_equal(self.tool, np.eye(4)))

    def singularities(self, joints: npt.ArrayLike) -> Mapping[str, Floats]:
        """Return the distances from singular poses, unit 1: the factors of the Jacobian's determinant.

        "shoulder": distance of the wrist from axis 1 in the plane of the arm, over the length of both links;
        "elbow", "wrist": the size of the sine of joints 3 (from the stretched pose) and 5.

        Parameters
        ----------
        joints : array_like (..., 6)
            Joints, rad.

        Returns
        -------
        dict
            Name -> array (...).
        """
        return self._inverse().singularities(self._checked(joints))
