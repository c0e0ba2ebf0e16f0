"""Reading of an offset circle by a probe on a fixed line: the exact curve, Mears (4.11) with a tip."""

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats


def radial_position(slide: npt.ArrayLike, probe: npt.ArrayLike, calibration: float) -> Floats:
    """Return the position of the probe's contact on the fixed line, mm from the spindle axis.

    Slide and probe both count positive away from the spindle: moving the slide along a still part changes
    nothing. The source's signs, Mears (4.1), would count the motion of the slide twice.

    Parameters
    ----------
    slide, probe : array_like
        Positions of the slide and of the probe on it, mm, positive away from the spindle.
    calibration : float
        Constant that makes a master of known radius read that radius, mm.

    Raises
    ------
    ValueError, TypeError
        For values that are not finite, and arrays of different shapes.

    Examples
    --------
    >>> radial_position([10.0, 12.0], [1.5, -0.5], 50.0).tolist()
    [61.5, 61.5]
    """
    carried, shown = checks.finite_array("slide", slide, "mm"), checks.finite_array("probe", probe, "mm")
    if carried.ndim and shown.ndim and carried.shape != shown.shape:
        raise ValueError(f"slide and probe must be of one shape; got {carried.shape} and {shown.shape}")
    return np.asarray(checks.number("calibration", calibration, "mm") + (carried + shown))


def circle_reading(
    angle: npt.ArrayLike, radius: float, offset: float, offset_angle: float, tip_radius: float = 0.0
) -> Floats:
    """Return an offset circle's reading, mm, (4.11): d cos psi + sqrt((R + rho)^2 - d^2 sin^2 psi) - rho.

    psi = angle - offset_angle. A round tip reads the circle as one of radius R + rho, without further
    correction.

    Parameters
    ----------
    angle : array_like
        Spindle angle, rad.
    radius, offset : float
        Radius R of the part and distance d of its centre from the spindle axis, mm; 0 <= d < R.
    offset_angle : float
        Direction of its centre, rad.
    tip_radius : float
        Radius rho of the probe's tip, mm, >= 0.

    Returns
    -------
    array, of the shape of `angle`
        Readings, mm.

    Raises
    ------
    ValueError, TypeError
        For a value out of its range: with d >= R the axis lies outside the part.

    Examples
    --------
    >>> circle_reading([0.0, np.pi], 61.94, 3.6, 0.0).round(9).tolist()
    [65.54, 58.34]
    """
    psi, effective = _checked(angle, radius, offset, offset_angle, tip_radius)
    return np.asarray(offset * np.cos(psi) + _side(psi, effective, offset) - tip_radius)


def circle_derivatives(
    angle: npt.ArrayLike, radius: float, offset: float, offset_angle: float, tip_radius: float = 0.0
) -> Floats:
    """Return the derivatives of `circle_reading` by radius, offset (mm/mm) and offset angle (mm/rad).

    Parameters
    ----------
    angle : array_like, shape (m,)
        Spindle angle, rad.
    radius, offset, offset_angle, tip_radius : float
        As for `circle_reading`, mm and rad.

    Returns
    -------
    array, shape (m, 3)
        Columns: by radius, offset and offset_angle.

    Raises
    ------
    ValueError, TypeError
        As `circle_reading`.

    Examples
    --------
    >>> circle_derivatives([0.0], 60.0, 3.0, 0.0).tolist()
    [[1.0, 1.0, 0.0]]
    """
    psi, effective = _checked(angle, radius, offset, offset_angle, tip_radius)
    side, c, s = _side(psi, effective, offset), np.cos(psi), np.sin(psi)
    columns = effective / side, c - offset * s**2 / side, offset * s + offset**2 * s * c / side
    return np.stack(columns, axis=-1)


def _checked(
    angle: npt.ArrayLike, radius: float, offset: float, offset_angle: float, tip_radius: float
) -> tuple[Floats, float]:
    """Angle from the part's direction (rad), and radius of the path of the tip's centre (mm), checked."""
    turned = checks.finite_array("angle", angle, "rad") - checks.number("offset_angle", offset_angle, "rad")
    checks.positive("radius", radius, "mm")
    if checks.nonnegative("offset", offset, "mm") >= radius:
        raise checks.refuse(
            "offset", f"< radius, {float(radius)!r}: the spindle's axis lies in the part", float(offset), "mm"
        )
    return turned, radius + checks.nonnegative("tip_radius", tip_radius, "mm")


def _side(psi: Floats, effective: float, offset: float) -> Floats:
    """sqrt((R + rho)^2 - d^2 sin^2 psi), mm: part of the fixed line up to the tip's centre."""
    across = offset * np.sin(psi)
    return np.asarray(np.sqrt((effective - across) * (effective + across)))
