"""Motor torque per normal force: the tool's lever arm, with friction."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._tool import checked_hold, contacts, is_face_on

_MM_PER_M = 1000.0  # source: SI


def torque_per_force(
    contact_angle: float,
    lever_arm: float,
    *,
    friction_ratio: float = 0.0,
    feed_angle: Any = 0.0,
    pushed: bool = False,
) -> Any:
    """Return the motor torque per normal force: T/F_n = R (cos(theta_f) - s mu cos(psi) sin(theta_f)).

    The contact force F_n n - mu F_n t at R z_P from the motor's axis y_P exerts the torque -s F_n R (...)
    about it, which the motor balances; s = 1 for a pushed tool, -1 for a dragged one. The source takes T/F_n
    = R, correct at theta_f = 0.

    Parameters
    ----------
    contact_angle : float
        theta_f, rad, in [0, pi/2).
    lever_arm : float
        R from the motor's axis to the contact, mm.
    friction_ratio : float
        mu, tangential over normal force.
    feed_angle : float or array
        psi from the tool's heading to the feed, rad; see `feed_angle`.
    pushed : bool
        Whether the tip leads; False: the tool is dragged.

    Returns
    -------
    float or array
        Torque per force, N m/N.

    Raises
    ------
    ValueError
        When a value is out of range, or the tool locks itself: cos(theta_f) <= s mu cos(psi) sin(theta_f).

    Examples
    --------
    >>> from sdpgrind import finishing, units
    >>> for pushed in (False, True):
    ...     torque = finishing.arm.torque_per_force(units.deg(30), 95.0, friction_ratio=0.3, pushed=pushed)
    ...     print(round(0.095 / torque, 3))  # F_n R/T
    0.984
    1.397
    """
    angle, lever = checked_hold(contact_angle, lever_arm, pushed)
    if is_face_on(angle):
        raise checks.refuse("contact_angle", "< pi/2: a tool face-on locks itself", angle, "rad")
    ratio = checks.nonnegative("friction_ratio", friction_ratio)
    turned = checks.finite_array("feed_angle", feed_angle, "rad")
    against = (1.0 if pushed else -1.0) * np.cos(turned) * math.sin(angle)
    share = math.cos(angle) - ratio * against
    if np.any(share <= 0):
        most = math.cos(angle) / float(against.max())
        rule = f"< {most:.4g} at contact_angle {angle:.4g} rad: from there on the tool locks itself"
        raise checks.refuse("friction_ratio", rule, ratio)
    out = share * (lever / _MM_PER_M)
    return out if out.ndim else float(out)


def feed_angle(tangent: npt.ArrayLike, normal: npt.ArrayLike, poses: npt.ArrayLike) -> Floats:
    """Return psi from the tool's heading h = y_P x n to the feed.

    Parameters
    ----------
    tangent, normal : array_like (m, 3)
        Unit vectors of feed and outward normal.
    poses : array_like (m, 4, 4)
        Tool poses from `tool_poses`, positions in mm.

    Returns
    -------
    array (m,)
        Angles in (-pi, pi], rad.

    Raises
    ------
    ValueError
        When vectors are no unit vectors, or not as many as poses.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> flat = [[0.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]], [[0.0, 0.0, 1.0]]  # feed along y
    >>> poses = finishing.arm.tool_poses(*flat, contact_angle=0.5, lever_arm=95.0)  # heading along x
    >>> finishing.arm.feed_angle(flat[1], flat[2], poses).round(4)
    array([1.5708])
    """
    axis = checks.finite_array("poses", poses, "mm")
    _, feed, up = contacts(np.zeros((len(axis), 3)), tangent, normal)
    if axis.shape != (len(feed), 4, 4):
        raise ValueError(
            f"poses must be of shape ({len(feed)}, 4, 4), one for each tangent; got {axis.shape}"
        )
    motor = axis[:, :3, 1]
    along = np.cross(motor, up)
    out: Floats = np.arctan2(np.einsum("ij,ij->i", feed, motor), np.einsum("ij,ij->i", feed, along))
    return out
