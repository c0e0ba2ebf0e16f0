"""A robot of five joints over a table of two: lengths, limits, poses, joints."""

import math
from collections.abc import Mapping
from dataclasses import KW_ONLY, fields
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Bools, Floats
from sdpgrind.base.quantities import Described, custom, described, quantity, units_of
from sdpgrind.base.units import deg
from sdpgrind.finishing.arm import _forward as chain
from sdpgrind.finishing.arm import _inverse as closed_form
from sdpgrind.finishing.arm._chain_checks import limit_units
from sdpgrind.finishing.arm._damped import damped
from sdpgrind.finishing.arm._robot import Redundancy

NAMES = ("q1", "q2", "q3", "q4", "q5", "X", "Y")
UNITS = ("rad",) * 5 + ("mm",) * 2
RISE = 0.1  # s, chosen: time to full acceleration; sets the jerk limits of the generic arm


def _positions(name: str, values: npt.ArrayLike) -> tuple[float, ...]:
    """Check the position limits, one for each joint."""
    found = _seven(name, values)
    for joint, value in zip(NAMES[:5], found, strict=False):
        if abs(value) > 4 * math.pi:
            raise checks.refuse(
                f"{name} of {joint}", "within two turns; units.deg(90) for degrees", value, "rad"
            )
    return found


def _rates(name: str, values: npt.ArrayLike) -> tuple[float, ...]:
    """Check the limits of speed, acceleration or jerk, one for each joint."""
    found = _seven(name, values)
    for joint, unit, value in zip(NAMES, UNITS, found, strict=True):
        checks.positive(f"{name} of {joint}", value, unit)
    return found


def _radii(name: str, value: float | npt.ArrayLike) -> float | tuple[float, ...]:
    """Check one wrist radius, or several."""
    if np.ndim(value) == 0:
        return checks.positive(name, value, "mm")
    found = checks.finite_array(name, value, "mm")
    if found.ndim != 1 or not found.size:
        raise ValueError(f"{name} must be one number or several (mm); got {checks.shown(value)}")
    return tuple(checks.positive(f"{name}[{k}]", each, "mm") for k, each in enumerate(found.tolist()))


def _seven(name: str, values: npt.ArrayLike) -> tuple[float, ...]:
    array = checks.finite_array(name, values, "rad, mm")
    if array.shape != (7,):
        raise ValueError(
            f"{name} must be seven numbers, of {', '.join(NAMES)} (rad, mm); got {checks.shown(values)}"
        )
    return tuple(array.tolist())


@described("finishing.arm")
class Arm(Described):
    """A 5-axis arm without wrist yaw, and an xy table that carries the work.

    Standard Denavit-Hartenberg links (theta, d, a, alpha), mm and degrees: (q1, d1, 0, 90), (q2, 0, a2, 0),
    (q3, 0, a3, 0), (q4 + 90, 0, 0, 90), (q5, d5, 0, 0). The last frame is that of the tool, P: its z axis is
    the axis of the fifth joint, its y axis the shaft of the torque motor, the eighth joint, which is at zero
    in all poses here. The table's axes X and Y are parallel to those of the base; at X = Y = 0 the frames of
    work and base coincide.

    The arm alone has five of the six freedoms of a pose, and only four of position and tool axis, as the axis
    stays in the arm's vertical plane. With the table it takes any pose in its range, with one redundant
    freedom: the distance of the wrist from the first axis (``wrist_radius``).

    Parameters
    ----------
    d1, a2, a3, d5 : float
        Height of the shoulder, upper arm, forearm, wrist to P, mm.
    position_min, position_max : tuple of float
        Limits of q1 to q5 and of the table's X and Y: rad, mm.
    speed_max, acceleration_max, jerk_max : tuple of float
        In rad/s, mm/s; in rad/s^2, mm/s^2; in rad/s^3, mm/s^3. jerk_max None: no limit.
    wrist_radius : float or tuple of float
        Distance of the wrist from the first axis, mm; of several, the planner takes that with the least
        travel of the joints.

    Raises
    ------
    ValueError
        When a length or a limit is not positive, a range empty, or there are not seven limits.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> arm = finishing.Arm.generic()
    >>> pose = arm.forward([0.0, 0.8, -1.5, 0.0, 0.0, 0.0, 0.0])
    >>> pose[:3, 3].round(3)  # mm
    array([476.707,   0.   , 389.731])
    """

    d1: float = quantity("mm", at_least=0, usual=(0.0, 1e4), typical=400)
    a2: float = quantity("mm", above=0, usual=(5.0, 1e4), typical=300)
    a3: float = quantity("mm", above=0, usual=(5.0, 1e4), typical=250)
    d5: float = quantity("mm", at_least=0, usual=(0.0, 1e4), typical=100)
    _: KW_ONLY
    position_min: tuple[float, ...] = custom(_positions, "rad, mm")
    position_max: tuple[float, ...] = custom(_positions, "rad, mm")
    speed_max: tuple[float, ...] = custom(_rates, "rad/s, mm/s")
    acceleration_max: tuple[float, ...] = custom(_rates, "rad/s^2, mm/s^2")
    jerk_max: tuple[float, ...] | None = custom(_rates, "rad/s^3, mm/s^3")
    wrist_radius: float | tuple[float, ...] = custom(_radii, "mm", default=350.0)

    names: ClassVar[tuple[str, ...]] = NAMES
    units: ClassVar[tuple[str, ...]] = UNITS

    def _check(self) -> None:
        for joint, unit, low, high in zip(NAMES, UNITS, self.position_min, self.position_max, strict=True):
            if low >= high:
                raise ValueError(
                    f"position_max of {joint} must be > position_min ({unit}); got {high!r} and {low!r}"
                )

    def _field_units(self) -> dict[str, str]:
        return super()._field_units() | limit_units(self.units)

    @property
    def _former_fields(self) -> list[tuple[str, Any]]:
        """Fields of version 0.1.0, in which the wrist radius was the problem's."""
        names = [field.name for field in fields(self) if field.name != "wrist_radius"]
        return [(name, getattr(self, name)) for name in names]

    @classmethod
    def generic(cls) -> Self:
        """Return an arm of common size, all numbers assumed (mm, rad, s); full acceleration after 0.1 s.

        Examples
        --------
        >>> from sdpgrind import finishing
        >>> finishing.Arm.generic().replace(d5=120.0).d5
        120.0
        """
        acceleration = (8.0,) * 5 + (2000.0,) * 2
        return cls(
            400.0, 300.0, 250.0, 100.0,
            position_min=(*(deg(float(a)) for a in (-165, -30, -150, -150, -180)), -200.0, -200.0),
            position_max=(*(deg(float(a)) for a in (165, 110, 0, 150, 180)), 200.0, 200.0),
            speed_max=(1.5,) * 5 + (200.0,) * 2,
            acceleration_max=acceleration,
            jerk_max=tuple(a / RISE for a in acceleration),
        )  # fmt: skip

    @property
    def lengths(self) -> tuple[float, float, float, float]:
        """Lengths d1, a2, a3, d5, mm."""
        return self.d1, self.a2, self.a3, self.d5

    @property
    def wrist_radii(self) -> tuple[float, ...]:
        """Candidate distances of the wrist from the first axis, mm."""
        return self.wrist_radius if isinstance(self.wrist_radius, tuple) else (self.wrist_radius,)

    @property
    def redundancy(self) -> tuple[Redundancy, ...]:
        """Freedom that a pose leaves: the distance of the wrist from the first axis, mm."""
        return (Redundancy("wrist_radius", self.wrist_radii),)

    def forward(self, joints: npt.ArrayLike) -> Floats:
        """Return the pose of P in the base frame.

        Parameters
        ----------
        joints : array_like (..., 7) or (..., 5)
            Joints, rad, and table, mm, which has no influence.

        Returns
        -------
        array (..., 4, 4)
            Positions in mm.
        """
        return chain.forward(_joints(joints, (5, 7)), self.lengths)

    def forward_work(self, joints: npt.ArrayLike) -> Floats:
        """Return the pose of P in the frame of the work, which the table moves.

        Parameters
        ----------
        joints : array_like (..., 7)
            Joints, rad, and table, mm.

        Returns
        -------
        array (..., 4, 4)
            Positions in mm.
        """
        array = _joints(joints, (7,))
        poses = chain.forward(array, self.lengths)
        poses[..., :2, 3] -= array[..., 5:]
        return poses

    def jacobian(self, joints: npt.ArrayLike, *, motor: bool = False) -> Floats:
        """Return the Jacobian of the pose of P in the frame of the work.

        Parameters
        ----------
        joints : array_like (..., 7)
            Joints, rad, and table, mm.
        motor : bool
            Whether to add a column for the torque motor, which turns the tool about y_P.

        Returns
        -------
        array (..., 6, 7) or (..., 6, 8)
            Velocity of P (mm/s) and angular velocity (rad/s), in the axes of the base, per rad/s or mm/s of a
            joint.
        """
        full = chain.jacobian(_joints(joints, (7,)), self.lengths)
        return full if motor else full[..., :7]

    def inverse(
        self, poses: npt.ArrayLike, *, wrist_radius: float = 350.0, branch: int = 0, continuous: bool = True
    ) -> Floats:
        """Return the joints for poses, in closed form.

        With phi the tool's pitch (sin(phi) = a_z, a = z_P) and q1 its azimuth, the wrist is ``wrist_radius``
        from the first axis and p_z - d1 - d5 sin(phi) above the shoulder. The law of cosines gives q2 and q3;
        q4 = phi - q2 - q3; q5 is the remaining rotation; the table moves the work below the tool. Where the
        tool is vertical q1 and q5 turn about one axis: q1 keeps its value of the pose before.

        Parameters
        ----------
        poses : array_like (m, 4, 4)
            Poses of P in the frame of the work with the table at zero, mm.
        wrist_radius : float
            Distance of the wrist from the first axis, mm.
        branch : {0, 1, 2, 3}
            0, 1: q1 along the tool's azimuth; 2, 3: half a turn further, the arm reaching over. 0, 2: elbow
            up (q3 <= 0).
        continuous : bool
            Whether the poses are points of one path, along which no angle jumps by a whole turn. False: each
            pose by itself.

        Returns
        -------
        array (m, 7)
            Joints, rad, and table, mm.

        Raises
        ------
        ValueError
            When a pose is out of reach, or a joint beyond its limit: with index, joint and amount.

        Examples
        --------
        >>> from sdpgrind import finishing
        >>> arm = finishing.Arm.generic()
        >>> pose = arm.forward([0.0, 0.2, -1.0, 0.3, 0.1])
        >>> arm.forward_work(arm.inverse([pose]))[0].round(6).tolist() == pose.round(6).tolist()
        True
        """
        checks.one_of("branch", branch, range(4))
        radius, array = _radius(wrist_radius), closed_form.checked_poses(poses)
        joints, reached = closed_form.joints_of(self, array, radius, branch, continuous)
        found = closed_form.excess(self, array, radius, joints, reached)
        if found is not None:
            raise ValueError(found.text)
        return joints

    def branches(
        self, poses: npt.ArrayLike, *, wrist_radius: float = 350.0, continuous: bool = True
    ) -> tuple[Floats, Bools]:
        """Return the joints of all four branches, within reach and limits or not.

        Parameters
        ----------
        poses, wrist_radius, continuous
            As of `inverse`, mm.

        Returns
        -------
        joints : array (4, m, 7)
            Joints, rad, and table, mm; for a pose out of reach, those of the arm stretched (or folded)
            towards it.
        reachable : array of bool (4, m)
            Whether the pose is within reach and all joints within their limits.
        """
        radius, array = _radius(wrist_radius), closed_form.checked_poses(poses)
        found = [closed_form.joints_of(self, array, radius, branch, continuous) for branch in range(4)]
        reachable = [reached & closed_form.within_limits(self, joints) for joints, reached in found]
        return np.stack([joints for joints, _ in found]), np.stack(reachable)

    def solutions(self, poses: npt.ArrayLike) -> Floats:
        """Return the joints of the four branches at each wrist radius, within their limits or not.

        Parameters
        ----------
        poses : array_like (m, 4, 4)
            Poses of P in the frame of the work with the table at zero, mm; each by itself.

        Returns
        -------
        array (m, 4 k, 7)
            Joints, rad, and table, mm: branches 0 to 3 at the first of k radii, then at the next; NaN where
            the wrist is out of reach.

        Examples
        --------
        >>> from sdpgrind import finishing
        >>> arm = finishing.Arm.generic().replace(wrist_radius=(300.0, 350.0))
        >>> arm.solutions([arm.forward_work([0.0, 0.2, -1.0, 0.3, 0.1, 0.0, 0.0])]).shape
        (1, 8, 7)
        """
        given, out = closed_form.checked_poses(poses), []
        for radius in self.wrist_radii:
            for branch in range(4):
                joints, reached = closed_form.joints_of(self, given, radius, branch, False)
                out.append(np.where(reached[:, None], joints, np.nan))
        return np.stack(out, axis=1)

    def singularities(self, joints: npt.ArrayLike) -> Mapping[str, Floats]:
        """Return the distances from singular poses, unit 1.

        "vertical": ``|cos phi|`` of the tool, whose inverse the speed of q1 follows; "elbow": ``|sin q3|``.

        Parameters
        ----------
        joints : array_like (..., 7)
            Joints, rad, and table, mm.

        Returns
        -------
        dict
            Name -> array (...).
        """
        array = _joints(joints, (5, 7))
        return {
            "vertical": np.abs(np.cos(array[..., 1:4].sum(axis=-1))),
            "elbow": np.abs(np.sin(array[..., 2])),
        }

    def solve(self, pose: npt.ArrayLike, start: npt.ArrayLike) -> Floats:
        """Return joints near a start for one pose, by damped least squares.

        Unlike `inverse`, the search leaves the wrist's radius free, keeps the limits, and near a singular
        pose the damping keeps the joints slow.

        Parameters
        ----------
        pose : array_like (4, 4)
            Pose of P in the frame of the work with the table at zero, mm.
        start : array_like (7,)
            Joints, rad, and table, mm, within their limits.

        Returns
        -------
        array (7,)
            Joints, rad, and table, mm: the pose to 1e-9 mm and 1e-11 rad.

        Raises
        ------
        ValueError
            When no joints within the limits are found; with the remaining error (mm, rad).

        Examples
        --------
        >>> from sdpgrind import finishing
        >>> arm = finishing.Arm.generic()
        >>> start = [0.1, 0.2, -1.1, 0.3, 0.0, 10.0, 0.0]
        >>> pose = arm.forward_work([0.0, 0.2, -1.0, 0.3, 0.1, 0.0, 0.0])
        >>> joints = arm.solve(pose, start)
        >>> bool(abs(arm.forward_work(joints) - pose).max() < 1e-9)
        True
        """
        target = closed_form.checked_poses(np.asarray(pose)[None])[0]
        begin = _joints(start, (7,))
        if begin.shape != (7,):
            raise ValueError(f"start must be of shape (7,); got {begin.shape}")
        found = closed_form.excess(self, target[None], 1.0, begin[None], np.array([True]))
        if found is not None:
            raise ValueError(f"start: {found.text}")
        return damped(self, target, begin)


def _radius(wrist_radius: float) -> float:
    return checks.positive("wrist_radius", wrist_radius, units_of(Arm)["wrist_radius"])


def _joints(joints: npt.ArrayLike, widths: tuple[int, ...]) -> Floats:
    array = checks.finite_array("joints", joints, "rad, mm")
    if array.ndim == 0 or array.shape[-1] not in widths:
        wanted = " or ".join(f"(..., {width})" for width in widths)
        raise ValueError(f"joints must be of shape {wanted} (rad, mm); got {array.shape}")
    return array
