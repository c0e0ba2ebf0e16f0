"""Protocol of a robot: what the planner asks of any."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from sdpgrind.base.checks import Bools, Floats

STEP = 1e-5  # rad or mm, chosen: error of a central difference some 1e-10 of a metre per rad


class Redundancy(NamedTuple):
    """Freedom that a pose leaves to a robot.

    Attributes
    ----------
    name : str
        Name, as in `Posture.free`.
    values : tuple of float
        Candidates, of which the planner takes one, mm or rad.
    """

    name: str
    values: tuple[float, ...]


@runtime_checkable
class Robot(Protocol):
    """A robot that holds a tool, with an external axis or none: `Arm`, `SerialRobot`, or a class of yours.

    A class that derives from it has to add all but `redundancy`, `jacobian` and `singularities`; for a robot
    that does not carry the work `forward_work` is `forward`. All is in mm, rad and s.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> isinstance(finishing.robot("ur10"), finishing.Robot)
    True
    """

    @property
    def names(self) -> Sequence[str]:
        """Names of the joints, (n,); axes of a table come last."""
        ...

    @property
    def units(self) -> Sequence[str]:
        """Units of the joints, (n,): "rad" or "mm"."""
        ...

    @property
    def position_min(self) -> Sequence[float]:
        """Least positions, (n,), rad or mm."""
        ...

    @property
    def position_max(self) -> Sequence[float]:
        """Greatest positions, (n,), rad or mm."""
        ...

    @property
    def speed_max(self) -> Sequence[float]:
        """Greatest speeds, (n,), rad/s or mm/s."""
        ...

    @property
    def acceleration_max(self) -> Sequence[float]:
        """Greatest accelerations, (n,), rad/s^2 or mm/s^2."""
        ...

    @property
    def jerk_max(self) -> Sequence[float] | None:
        """Greatest jerks, (n,), rad/s^3 or mm/s^3. None: no limit."""
        ...

    def forward(self, joints: npt.ArrayLike) -> Floats:
        """Return the poses of the tool in the base, (..., 4, 4), mm.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.
        """
        ...

    def forward_work(self, joints: npt.ArrayLike) -> Floats:
        """Return the poses of the tool as the work sees it, moved back by axes that carry it, mm.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.
        """
        ...

    def solutions(self, poses: npt.ArrayLike) -> Floats:
        """Return the joints of every branch, (m, b, n), rad or mm; NaN where a branch does not reach a pose.

        The number b of branches is the same for all poses, and a branch is continuous along a path up to
        whole turns.

        Parameters
        ----------
        poses : array_like (m, 4, 4)
            Poses of the tool as the work sees it, mm.
        """
        ...

    @property
    def redundancy(self) -> tuple[Redundancy, ...]:
        """Freedoms that a pose leaves, with their candidates, mm or rad; the first varies slowest."""
        return ()

    def jacobian(self, joints: npt.ArrayLike) -> Floats:
        """Return the Jacobian of the pose in the work, (..., 6, n), by central differences; mm and rad.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.
        """
        return numeric_jacobian(self, joints)

    def singularities(self, joints: npt.ArrayLike) -> Mapping[str, Floats]:
        """Return the distances from singular sets by name, (...), unit 1.

        Default: least singular value of the Jacobian over its greatest, with lengths over the reach of the
        tool.

        Parameters
        ----------
        joints : array_like (..., n)
            Joints, rad or mm.
        """
        return {"pose": _least_share(self, joints)}


class Singularity(NamedTuple):
    """Place of a motion nearest to a singular pose.

    Attributes
    ----------
    name : str
        Singular set: "shoulder", "elbow" or "wrist" of a serial robot, "vertical" or "elbow" of an `Arm`.
    distance : float
        Distance from it, unit 1, 0 at singular poses: the sine of an angle, or a distance over the reach.
    time : float
        Time, s.
    length : float
        Length of path there, mm.
    each : mapping
        Name -> least distance of the motion from every singular set, unit 1.
    """

    name: str
    distance: float
    time: float
    length: float
    each: Mapping[str, float]

    def __str__(self) -> str:
        return f"{self.distance:.3g} from {self.name} singularity at {self.length:.4g} mm, {self.time:.4g} s"


def numeric_jacobian(robot: Any, joints: npt.ArrayLike) -> Floats:
    """Jacobian (..., 6, n) of the pose in the work by central differences."""
    array = np.asarray(joints, dtype=float)
    out = np.empty((*array.shape[:-1], 6, array.shape[-1]))
    for j, shift in enumerate(STEP * np.eye(array.shape[-1])):
        after, before = robot.forward_work(array + shift), robot.forward_work(array - shift)
        turn = after[..., :3, :3] @ np.swapaxes(before[..., :3, :3], -1, -2)
        out[..., :3, j] = after[..., :3, 3] - before[..., :3, 3]
        skew = turn - np.swapaxes(turn, -1, -2)
        out[..., 3:, j] = 0.5 * np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    return out / (2 * STEP)


def _least_share(robot: Robot, joints: npt.ArrayLike) -> Floats:
    """Least over greatest singular value of the Jacobian, lengths over the greatest distance of the tool."""
    slopes: Floats = robot.jacobian(joints).copy()
    sliding = np.array([unit != "rad" for unit in robot.units])
    reach = max(1.0, float(np.abs(robot.forward(joints)[..., :3, 3]).max()))
    slopes[..., :3, :] /= reach
    slopes[..., sliding] *= reach
    values = np.asarray(np.linalg.svd(slopes, compute_uv=False), dtype=float)
    out: Floats = values[..., 5] / values[..., 0]
    return out


def angular(robot: Robot) -> Bools:
    """Return which joints turn, (n,)."""
    return np.array([unit == "rad" for unit in robot.units])


def middle(robot: Robot) -> Floats:
    """Return the middles of the limits, (n,), rad or mm."""
    out: Floats = 0.5 * (np.array(robot.position_min, float) + np.array(robot.position_max, float))
    return out
