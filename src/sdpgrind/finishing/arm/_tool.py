"""Tool frame at the contact: Wang eq. (1), with a fixed heading or along the feed."""

import math

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

HEADINGS = ("fixed", "feed_aligned")
# chosen: length of the azimuth's projection on the tangent plane below which its direction is rounding
UPRIGHT = 1e-3
SHORTEST = 1.0  # mm, chosen: a shorter lever arm is in another unit
OFF_UNIT = 1e-6  # chosen: rounding of a unit vector
FACING = 1e-9  # rad, chosen: rounding of a quarter of a turn


def tool_poses(
    point: npt.ArrayLike,
    tangent: npt.ArrayLike,
    normal: npt.ArrayLike,
    *,
    contact_angle: float,
    lever_arm: float,
    pushed: bool = False,
    heading: str = "fixed",
    azimuth: float = 0.0,
) -> Floats:
    """Return the tool frame P at every contact, Wang eq. (1): A_P = A_C (A_C^P)^-1.

    The contact frame C has z along the outward normal n, x along the heading h in the tangent plane, and
    y = n x h. P is on the motor's axis y_P = y_C, ``lever_arm`` away from the contact; the axis
    z_P = s cos(theta_f) h - sin(theta_f) n points from P to the contact, with s = 1 for a pushed tool (its
    tip leads where the feed is along h), -1 for a dragged one. A torque about +y_P presses a pushed tool on,
    a torque about -y_P a dragged one.

    ``"feed_aligned"``: h is the direction of feed, as the source defines theta_f. ``"fixed"``: h is one
    direction of the xy plane for the whole path, projected on the tangent plane; the tool is then pushed or
    dragged only where the feed is along h, see `feed_angle`. A tool dragged along h has the pose of one
    pushed along -h, turned by half a turn about z_P.

    Parameters
    ----------
    point : array_like (m, 3)
        Contacts, mm, in the frame of the returned poses.
    tangent, normal : array_like (m, 3)
        Unit vectors: direction of feed, and outward normal of the surface.
    contact_angle : float
        theta_f from the surface to the tool, rad, in [0, pi/2].
    lever_arm : float
        R from the motor's axis to the contact, mm.
    pushed : bool
        Whether the tip leads; False: the tool is dragged.
    heading : {"fixed", "feed_aligned"}
        Definition of h.
    azimuth : float
        Direction of h in the xy plane, from x, rad; "fixed" only. An arm at the origin that works along x
        needs pi, both for a dragged tool (it leans away from the base, q1 and q5 are near 0) and a pushed one
        (the arm reaches over).

    Returns
    -------
    array (m, 4, 4)
        Poses of P; rotations have no unit, positions are in mm.

    Raises
    ------
    ValueError
        When an angle or a length is out of range, a vector is no unit vector or not in the tangent plane, or
        the normal lies along the azimuth of a fixed heading.

    Examples
    --------
    >>> from sdpgrind import finishing, units
    >>> flat = [[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]
    >>> pose = finishing.arm.tool_poses(*flat, contact_angle=units.deg(30), lever_arm=95.0)[0]
    >>> pose[:3, 3].round(3), pose[:3, 2].round(3) + 0.0  # dragged: P is ahead of the contact
    (array([82.272,  0.   , 47.5  ]), array([-0.866,  0.   , -0.5  ]))
    """
    angle, lever = checked_hold(contact_angle, lever_arm, pushed)
    checks.one_of("heading", heading, HEADINGS)
    place, feed, up = contacts(point, tangent, normal)
    along = feed if heading == "feed_aligned" else headings(up, checks.number("azimuth", azimuth, "rad"))
    return held_poses(place, along, up, angle, lever, pushed)


def held_poses(
    place: Floats, along: Floats, up: Floats, contact_angle: float, lever_arm: float, pushed: bool
) -> Floats:
    """Poses of a tool at trusted contacts, with the heading `along`; see `tool_poses`."""
    sign = 1.0 if pushed else -1.0
    cos, sin = math.cos(contact_angle), math.sin(contact_angle)
    (ux, uy, uz), (hx, hy, hz) = up.T, along.T
    poses = np.zeros((len(place), 4, 4))
    poses[:, :3, 0] = -sin * along - sign * cos * up
    poses[:, 0, 1], poses[:, 1, 1], poses[:, 2, 1] = uy * hz - uz * hy, uz * hx - ux * hz, ux * hy - uy * hx
    poses[:, :3, 2] = sign * cos * along - sin * up
    poses[:, :3, 3] = place - lever_arm * poses[:, :3, 2]
    poses[:, 3, 3] = 1.0
    return poses


def contacts(
    point: npt.ArrayLike, tangent: npt.ArrayLike, normal: npt.ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """Check contacts: points (mm), unit feeds in the tangent plane, unit normals, each (m, 3)."""
    place = checks.finite_array("point", point, "mm")
    feed, up = checks.finite_array("tangent", tangent), checks.finite_array("normal", normal)
    for name, array in {"point": place, "tangent": feed, "normal": up}.items():
        if array.ndim != 2 or array.shape[1] != 3 or len(array) != len(place):
            raise ValueError(f"{name} must be of shape (m, 3), as many as points; got {array.shape}")
    for name, array in {"tangent": feed, "normal": up}.items():
        _refuse(f"{name}[{{}}]", "of length 1", np.linalg.norm(array, axis=1) - 1, 1.0)
    _refuse("the cosine of tangent[{}] and normal", "0", np.einsum("ij,ij->i", feed, up), 0.0)
    return place, feed, up


def _refuse(name: str, rule: str, off: Floats, wanted: float) -> None:
    """Refuse the first vector whose value is off the wanted one."""
    bad = np.flatnonzero(np.abs(off) > OFF_UNIT)
    if bad.size:
        raise checks.refuse(name.format(bad[0]), rule, float(off[bad[0]] + wanted))


def is_face_on(contact_angle: float) -> bool:
    """Whether a tool's axis is along the normal, so that no torque of its motor presses it."""
    return contact_angle > math.pi / 2 - FACING


def checked_hold(contact_angle: float, lever_arm: float, pushed: bool) -> tuple[float, float]:
    """Check contact angle (rad) and lever arm (mm) of a pushed or dragged tool."""
    angle = checks.number("contact_angle", contact_angle, "rad")
    if not 0 <= angle <= math.pi / 2:
        raise checks.refuse("contact_angle", "in [0, pi/2]; units.deg(30) for degrees", angle, "rad")
    if not isinstance(pushed, bool | np.bool_):
        raise TypeError(f"pushed must be True or False; got {checks.shown(pushed)}")
    if checks.positive("lever_arm", lever_arm, "mm") < SHORTEST:
        raise checks.refuse("lever_arm", f">= {SHORTEST:g}; 95.0 for 0.095 m", lever_arm, "mm")
    return angle, float(lever_arm)


def headings(up: Floats, azimuth: float) -> Floats:
    """Projections of one direction of the xy plane on the tangent planes, unit vectors (m, 3)."""
    level = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    along = level - (up @ level)[:, None] * up
    size = np.linalg.norm(along, axis=1)
    bad = np.flatnonzero(size < UPRIGHT)
    if bad.size:
        raise ValueError(
            f"azimuth must not be along the normal of the surface, where it tells no direction;"
            f" got {azimuth!r} rad at contact {bad[0]}, whose normal is {up[bad[0]].round(6).tolist()}"
        )
    out: Floats = along / size[:, None]
    return out
