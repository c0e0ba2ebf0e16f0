"""The tool in the flange of a robot."""

import math

import numpy as np

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.base.quantities import another_unit

# chosen: cosine between the way to a tool and the last axis below which it stands across: an angle head, or a
# flange that points elsewhere
_ACROSS = 0.5
_ON = 1 - 1e-6  # chosen: cosine of an axis of the flange and the last joint's, but for rounding
_USUAL, _TYPICAL = (1.0, 5000.0), 150.0  # mm, chosen: tools of robots


def tool(length: float, tilt: float = 0.0, *, axis: str = "z") -> Floats:
    """Return the frame P of a tool in the flange, for `SerialRobot.replace`: shifted along it, then tilted.

    The contact lies the lever arm of the problem along z_P. Flanges with the axis "x" point ahead along x, as
    those of older ROS-Industrial models (``irb2400``) and of the convention before ``tool0`` pointed along z.

    Parameters
    ----------
    length : float
        Distance of P from the flange along its axis, mm; 0: at the flange.
    tilt : float
        Angle from the axis of the flange to z_P, about y of the flange, rad.
    axis : {"z", "x"}
        Axis of the flange that points away from the robot.

    Returns
    -------
    array (4, 4)
        Rigid motion, positions in mm.

    Raises
    ------
    ValueError
        When the length is in another unit, or the tilt beyond a turn.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> robot = finishing.robot("ur10")
    >>> held = robot.replace(tool=finishing.tool(length=150.0))
    >>> joints = [0.3, -1.5, 1.8, -1.8, -1.5, 0.1]
    >>> moved = held.forward(joints)[:3, 3] - robot.forward(joints)[:3, 3]
    >>> round(float(moved @ robot.forward(joints)[:3, 2]), 9)  # mm along the axis of the flange
    150.0
    """
    ahead, turn = checks.nonnegative("length", length, "mm"), checks.number("tilt", tilt, "rad")
    if ahead and not _USUAL[0] <= ahead <= _USUAL[1]:
        raise ValueError(another_unit("length", length, "mm", _USUAL, _TYPICAL))
    if abs(turn) > 2 * math.pi:
        raise checks.refuse("tilt", "within a turn; units.deg(45) for degrees", turn, "rad")
    if checks.one_of("axis", axis, ("z", "x")) == "x":
        turned = _about_y(math.pi / 2)
        return turned @ _shifted(ahead) @ _about_y(turn)
    return _shifted(ahead) @ _about_y(turn)


def axis_on(last: Floats) -> str:
    """Return the axis of the flange, "x", "y" or "z", on that of the last joint there; "" where none is."""
    return next((name for name, part in zip("xyz", last, strict=True) if abs(part) > _ON), "")


def across(tool: Floats, last: Floats, axis: str) -> str:
    """Return what is said of a tool across the last axis (3,), both in the flange; "" of one along it."""
    way = tool[:3, 3]
    if abs(float(way @ last)) >= _ACROSS * float(np.linalg.norm(way)):
        return ""
    remedy = f": tool(length, axis={axis!r}) is meant?" if axis in ("x", "z") else ""
    return (
        f"the tool, {way.round(3).tolist()} mm from the flange, stands across the axis of the last joint,"
        f" which is {last.round(3).tolist()} there{remedy}"
    )


def _shifted(length: float) -> Floats:
    out = np.eye(4)
    out[2, 3] = length
    return out


def _about_y(angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s, 0.0], [0.0, 1.0, 0.0, 0.0], [-s, 0.0, c, 0.0], [0.0, 0.0, 0.0, 1.0]])
