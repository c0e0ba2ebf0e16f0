"""A finishing problem: path on a surface, robot, and tool with its feed."""

import dataclasses
import hashlib
import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sdpgrind import units
from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.doubts.record import Doubts, asked
from sdpgrind.base.quantities import Described, choice, custom, described, part, quantity, valued
from sdpgrind.base.stored import encode
from sdpgrind.base.warned import warn
from sdpgrind.finishing._problem.former_fields import current, former, takes_former_fields
from sdpgrind.finishing.arm._arm import Arm
from sdpgrind.finishing.arm._chain_checks import LEAST, check_away
from sdpgrind.finishing.arm._lever import feed_angle, torque_per_force
from sdpgrind.finishing.arm._mounted import MountedRobot
from sdpgrind.finishing.arm._robot import Robot
from sdpgrind.finishing.arm._serial import SerialRobot
from sdpgrind.finishing.arm._spin_states import checked_spin
from sdpgrind.finishing.arm._tool import HEADINGS, checked_hold, is_face_on, tool_poses
from sdpgrind.finishing.path._lifted_course import LiftedCourse
from sdpgrind.finishing.path._path import Path
from sdpgrind.finishing.path._samples import PathSamples
from sdpgrind.finishing.roughness._model import RoughnessModel
from sdpgrind.finishing.surface._surface import Surface
from sdpgrind.finishing.torque._axis import TorqueAxis
from sdpgrind.identify import Estimate

TABLE_HEIGHT = 100.0  # mm above the base, chosen: puts the generic arm's wrist well inside its reach
COLUMN = 100.0  # mm, chosen: radius in which a robot itself stands
# mm/s, chosen: belts and discs on robots run at 5 to 500 on the work; beyond, a feed is in another unit
FEEDS = 0.1, 1000.0


def _place(name: str, value: Any) -> tuple[float, ...]:
    place = checks.finite_array(name, value, "mm")
    if place.shape not in ((3,), (4,)):
        raise ValueError(
            f"{name} must be three coordinates (mm), and a turn about z (rad) or none;"
            f" got {checks.shown(value)}"
        )
    if place.size == 4 and abs(place[3]) > 2 * math.pi:
        raise checks.refuse(f"turn of {name}", "within a turn; units.deg(90)", float(place[3]), "rad")
    return tuple(place.tolist())


def _path(name: str, value: Any) -> Path | LiftedCourse:
    return (
        value
        if isinstance(value, LiftedCourse)
        else checks.kind(name, value, Path, " (see finishing.hilbert)")
    )


def _robot(name: str, value: Any) -> Robot:
    """Check that a robot has what the planner asks, and an inverse."""
    if not isinstance(value, Robot):
        missing = sorted(each for each in _ASKED if not hasattr(value, each))
        lacks = f", without {', '.join(missing)}" if 0 < len(missing) < len(_ASKED) else ""
        raise TypeError(
            f"{name} must be a robot: an Arm, a SerialRobot, or of the protocol finishing.Robot;"
            f" got {checks.shown(value)}{lacks}"
        )
    if isinstance(value, SerialRobot):
        _ = value.closed_form  # refused where there is none
    return value


_ASKED = (
    "names", "units", "position_min", "position_max", "speed_max", "acceleration_max", "jerk_max",
    "forward", "forward_work", "solutions", "redundancy", "jacobian", "singularities",
)  # fmt: skip


def check_outside(name: str, places: npt.ArrayLike, problem: "FinishingProblem") -> None:
    """Refuse places (mm) where a robot that stands at the origin would stand in the work: metres."""
    robot = problem.robot.robot if isinstance(problem.robot, MountedRobot) else problem.robot
    if not isinstance(robot, SerialRobot) or np.linalg.norm(robot.links[0][:3, 3]) >= LEAST:
        return
    if np.linalg.norm(problem.path.points, axis=1).min() < COLUMN:
        check_away(name, places)


@takes_former_fields
@described("finishing.problem")
class FinishingProblem(Described):
    """A path over a surface, for a tool on a torque-controlled axis held by a robot.

    Parameters
    ----------
    path : Path, LiftedPath or SequencedPath
        Path of the contact, with or without lifts; see `hilbert`, `zigzag` and `sequence`.
    model : RoughnessModel
        Roughness that the tool leaves.
    robot : Robot
        The robot, its table if it has one, and their limits: an `Arm`, a `SerialRobot`, or of a class of
        yours. The radii of an arm's wrist are among its fields.
    contact_angle : float
        theta_f between tool axis and surface, rad, in [0, pi/2]. pi/2: face-on, not pressed by a torque.
    lever_arm : float
        R from the motor's axis to the contact, mm.
    heading : {"fixed", "feed_aligned"}
        "fixed": one azimuth of the tool for the whole path; motor torque per normal force then varies with
        the direction of feed. "feed_aligned": the tool turns into the direction of feed, as the source
        defines theta_f; an arm without wrist yaw cannot do that at the corners of a path.
    azimuth : float
        Direction in the base frame of a "fixed" tool, from the motor to the tip, rad.
    pushed : bool
        Whether the tip of a "feed_aligned" tool leads; False: it is dragged. A "fixed" tool meets both.
    feed_rate : float
        Speed of the contact on the surface, mm/s.
    acceleration : float
        Greatest acceleration along the path, mm/s^2; "trapezoid" only, other methods use the limits of the
        joints.
    friction_ratio : float
        Tangential over normal force of the tool, unit 1.
    tool_diameter : float
        Diameter in the roughness model, mm; not that of the footprint.
    placement : (float, float, float) or (float, float, float, float), optional
        Origin of the surface in the base frame with the table at zero, mm, and its turn about z, rad. None:
        centres the travel of the table, 100 mm up; a robot without a table needs one.
    spin : int or tuple of float
        Turns of the tool about its own axis (z of P) that the planner may choose from along the path, where
        the process does not mind: their number over a turn, such as 24, or angles, rad, between which it
        stays. No torque of the axis then presses the tool. Default (): it is held.

    Raises
    ------
    ValueError
        When a value is out of range, the tool would lock itself, or the robot has no inverse.

    Examples
    --------
    >>> from sdpgrind import finishing, units
    >>> path = finishing.hilbert(finishing.preset("nominal").surface, 3)
    >>> problem = finishing.FinishingProblem(path, feed_rate=12.5)
    >>> problem.replace(contact_angle=units.deg(20)).feed_rate  # mm/s
    12.5
    """

    _younger = ("spin",)  # left out of files and digests while it is (), as in versions that did not have it
    path: Path | LiftedCourse = custom(_path)
    _: dataclasses.KW_ONLY
    model: RoughnessModel = part(
        RoughnessModel,
        " (see finishing.roughness.RoughnessModel.published)",
        default_factory=RoughnessModel.published,
    )
    robot: Robot = custom(_robot, default_factory=Arm.generic)
    contact_angle: float = quantity("rad", default=units.deg(30.0))
    lever_arm: float = quantity("mm", above=0, usual=(0.0, 5000.0), typical=95, default=95.0)
    heading: str = choice(*HEADINGS, default="fixed")
    azimuth: float = quantity("rad", default=0.0)
    pushed: bool = custom(default=False)
    feed_rate: float = quantity("mm/s", above=0, usual=FEEDS, typical=25, default=25.0)
    acceleration: float = quantity("mm/s^2", above=0, usual=(30.0, 1e7), typical=1000, default=1000.0)
    friction_ratio: float = quantity("1", at_least=0, default=0.3)
    tool_diameter: float = quantity("mm", above=0, usual=(0.05, 1000.0), typical=4, default=4.0)
    placement: tuple[float, ...] | None = custom(_place, "mm", default=None)
    spin: int | tuple[float, ...] = custom(checked_spin, "rad", default=())

    def _check(self) -> None:
        checked_hold(self.contact_angle, self.lever_arm, self.pushed)
        if abs(self.azimuth) > 2 * math.pi:
            raise self._refused("azimuth", "within a turn; units.deg(90) for degrees")
        if self.pushed and self.heading == "fixed":
            raise ValueError(
                "pushed must be False where heading is 'fixed':"
                " such a tool is pushed there and dragged back; got True"
            )
        if isinstance(self.robot, SerialRobot) and (told := self.robot.tool_across):
            warn(told)
        if self.placement is not None:
            check_outside("placement", self.placement[:3], self)
        # a fixed tool meets every direction of feed
        turns = (0.0, math.pi) if self.heading == "fixed" else (0.0,)
        for turned in turns if self.pressed else ():
            self.torque_per_force(turned)

    @classmethod
    def _from_file(cls, **fields: Any) -> Self:
        """Return the problem of a file, of version 0.1.0, too."""
        return cls(**current(fields, quiet=True))

    @property
    def _former_fields(self) -> list[tuple[str, Any]]:
        return former(self)

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Parameters
        ----------
        **changes
            Fields of this problem, in their own units; also fields of its ``model``.

        Raises
        ------
        ValueError
            When a name is a field of neither.
        """
        return super().replace(**current(changes, self.robot))

    def __repr__(self) -> str:
        path = f"{self.path.pattern} of {len(self.path.nodes)} nodes at {self.feed_rate:g} mm/s"
        tool = f"tool of {self.tool_diameter:g} mm at {self.contact_angle:.4g} rad, {self.heading} heading"
        return f"FinishingProblem({path}, {tool})"

    @property
    def surface(self) -> Surface:
        """Surface under the path, in mm."""
        return self.path.surface

    @property
    def arm(self) -> Robot:
        """Former name of `robot` (mm, rad, s)."""
        warn("FinishingProblem.arm is now FinishingProblem.robot", DeprecationWarning)
        return self.robot

    @property
    def wrist_radius(self) -> Any:
        """Former place of the wrist radius of an arm, mm."""
        warn("FinishingProblem.wrist_radius is now robot.wrist_radius", DeprecationWarning)
        return checks.kind("robot", self.robot, Arm).wrist_radius

    def _field_units(self) -> dict[str, str]:
        units = super()._field_units()
        turned = self.placement is not None and len(self.placement) == 4
        return units | ({"placement": "mm, mm, mm, rad"} if turned else {})

    @property
    def turn(self) -> float:
        """Turn of the surface about z of the base, rad."""
        return self.placement[3] if self.placement is not None and len(self.placement) == 4 else 0.0

    @property
    def face_on(self) -> bool:
        """Whether the tool's axis is along the normal: contact_angle is pi/2, in rad."""
        return is_face_on(self.contact_angle)

    @property
    def pressed(self) -> bool:
        """Whether a torque presses the tool, at an angle of less than pi/2 (rad) and held about its axis."""
        return not self.face_on and self.spin == ()

    def torque_per_force(self, feed_angle: Any) -> Any:
        """Return the motor torque per normal force, N m/N.

        Parameters
        ----------
        feed_angle : float or array
            Angle between feed and azimuth of the tool, rad.
        """
        ratio, pushed = self.friction_ratio, self.pushed
        return torque_per_force(
            self.contact_angle, self.lever_arm, friction_ratio=ratio, feed_angle=feed_angle, pushed=pushed
        )

    def tool_poses(self, samples: PathSamples) -> Floats:
        """Return the tool poses in the frame of the surface, (m, 4, 4): Wang eq. (1).

        Parameters
        ----------
        samples : PathSamples
            Places from `Path.sample` or `Path.at` (mm).
        """
        held = {name: getattr(self, name) for name in ("contact_angle", "lever_arm", "heading", "pushed")}
        held["azimuth"] = self.azimuth + math.pi  # a dragged tool points against its heading
        if self.turn:
            held["azimuth"] -= self.turn  # the azimuth is that in the base
        return tool_poses(samples.point, samples.tangent, samples.normal, **held)

    def feed_angles(self, samples: PathSamples) -> Floats:
        """Return the angles psi (rad) between azimuth of the tool and feed, (m,).

        Parameters
        ----------
        samples : PathSamples
            Places from `Path.sample` or `Path.at` (mm).
        """
        return feed_angle(samples.tangent, samples.normal, self.tool_poses(samples))

    @cached_property
    def job(self) -> Mapping[str, object]:
        """Part and machine, name -> (value, unit), without estimated quantities."""
        told = {
            "pattern": self.path.pattern,
            "path_length": (self.path.length, "mm"),
            "path_digest": _digest(self.path),
        }
        return {
            **told,
            **valued(self, ("contact_angle", "lever_arm")),
            "heading": self.heading,
            "pushed": float(self.pushed),
            **valued(self, ("feed_rate",)),
        }

    def updated(self, estimate: Estimate) -> Self:
        """Return the problem with a roughness model learned from measurements.

        The ranges of the model stay, mm and N; `doubts` offers the call with those of the readings.

        Parameters
        ----------
        estimate : Estimate
            Result of ``finishing.identify(study, "roughness")``; units as in `RoughnessModel`.

        Raises
        ------
        ValueError
            When the estimate has failed, or is of another quantity.
        """
        return self.replace(model=self.model.updated(estimate))

    def doubts(self, data: Any, *, axis: TorqueAxis | None = None) -> Doubts:
        """Return what finished parts, or free motion of the axis, say about this problem, and what not.

        Coefficients of the roughness model and the load torque with their intervals; the alignment of the
        current that the angles prefer; the median roughness of tool and path at both ends of each interval.

        Parameters
        ----------
        data : Study, mapping of arrays, log, or table of a log
            As for `finishing.identify`: pattern, tool_diameter (mm), normal_force (N) and roughness_ra (mm);
            or time (s), motor_angle (rad) and current (A).
        axis : TorqueAxis, optional
            Believed inertia, kg m^2, and torque constant, N m/A, for the load torque. Default: those of the
            source, `TorqueAxis`.

        Returns
        -------
        Doubts
            Rows, sentences, alignment and stakes; ``print`` shows the page.

        Raises
        ------
        ValueError, TypeError
            For missing or bad data.

        Examples
        --------
        >>> from sdpgrind import finishing
        >>> found = finishing.preset("nominal").doubts(finishing.Study.published("wang-2001"))
        >>> found["tool_exponent"].verdict, round(found["tool_exponent"].told, 3)
        ('agrees', -0.902)
        """
        return asked("sdpgrind.finishing._doubts.doubts:doubts", self, data, axis=axis)


def _digest(path: Path | LiftedCourse) -> str:
    """Hash of a path, 12 hexadecimal digits."""
    return hashlib.sha256(encode(path).encode()).hexdigest()[:12]


def check_pressed(problem: FinishingProblem, name: str = "contact_angle") -> None:
    """Refuse a tool that no torque of its motor presses; `name`: of its angle, as the caller knows it."""
    if problem.spin != ():
        rule = "(): no torque of the axis presses a tool that turns about its own axis"
        raise checks.refuse(name.replace("contact_angle", "spin"), rule, problem.spin)
    if problem.face_on:
        rule = "< pi/2: no torque of the axis presses a tool that is face-on"
        raise checks.refuse(name, rule, problem.contact_angle, "rad")
