"""Checks of a robot of joints in series: rigid links in mm, limits in rad and mm that do not cross."""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats

LEAST, MOST = 10.0, 1e5  # mm, chosen: reach of robots; outside it is in another unit
TURNS = 4 * math.pi  # rad, chosen: limits of joints, two turns either way
CROOKED = 1e-6  # chosen: error of a rotation, far above rounding and below what a user would accept
UNITS = {"speed_max": "/s", "acceleration_max": "/s^2", "jerk_max": "/s^3"}


def numbers(name: str, value: npt.ArrayLike) -> tuple[float, ...]:
    """Check one number for each joint, rad or mm and s."""
    found = checks.finite_array(name, value, "rad, mm")
    if found.ndim != 1:
        raise ValueError(f"{name} must be one number for each joint (rad, mm); got {checks.shown(value)}")
    return tuple(found.tolist())


def rigid(name: str, value: npt.ArrayLike) -> Floats:
    """Check one rigid motion (4, 4), positions in mm."""
    found = checks.finite_array(name, value, "mm")
    if found.shape != (4, 4):
        raise ValueError(f"{name} must be of shape (4, 4) (mm); got {found.shape}")
    check_rigid(name, found)
    found = found.copy()
    found.flags.writeable = False
    return found


def check_rigid(name: str, pose: Floats) -> None:
    """Refuse a matrix (4, 4) that is no rigid motion."""
    off = float(np.abs(pose[:3, :3].T @ pose[:3, :3] - np.eye(3)).max())
    mirrored, last = np.linalg.det(pose[:3, :3]) < 0, float(np.abs(pose[3] - [0.0, 0.0, 0.0, 1.0]).max())
    if off > CROOKED or mirrored or last > CROOKED:
        fault = "a mirror image" if mirrored else f"off by {max(off, last):.3g}"
        raise ValueError(f"{name} must be a rigid motion, R^T R = 1 to {CROOKED:g}; got {fault}")


def check_links(links: Floats, count: int) -> None:
    """Refuse links (mm) that are not one more than joints, not rigid, or in another unit."""
    if not count or links.shape != (count + 1, 4, 4):
        raise ValueError(
            f"links must be of shape ({count + 1}, 4, 4), one more than joints; got {links.shape}"
        )
    for k, link in enumerate(links):
        check_rigid(f"links[{k}]", link)
    reach = float(np.linalg.norm(links[:, :3, 3], axis=1).sum())
    if not LEAST <= reach <= MOST:
        meant = "metres? units.m(...)" if reach < LEAST else "is a file in mm where metres are meant?"
        raise ValueError(
            f"links must be in mm, with a reach of some 1000 along the chain; {meant}; got {reach:.4g}"
        )


def check_away(name: str, value: npt.ArrayLike) -> None:
    """Refuse places (mm) nearer to the base than any work lies: those of another unit; 0 is none."""
    if 0.0 < float(np.abs(value).max()) < LEAST:
        raise checks.refuse(name, "in mm, some 800 from the base; metres? units.m(...)", value)


def check_range(joint: str, unit: str, low: float, high: float) -> None:
    """Refuse limits of a joint's position that cross, or are in degrees."""
    for name, value in (("position_min", low), ("position_max", high)):
        if unit == "rad" and abs(value) > TURNS * (1 + 1e-9):
            rule = "within two turns; units.deg(90) for degrees"
            raise checks.refuse(f"{name} of {joint}", rule, value, unit)
    if low >= high:
        raise ValueError(f"position_max of {joint} must be > position_min ({unit}); got {high!r} and {low!r}")


def for_each(name: str, value: float | Sequence[float], sliding: Sequence[bool]) -> tuple[float, ...]:
    """One limit for each joint, of one for all or one each."""
    if isinstance(value, Sequence | np.ndarray):
        return tuple(value)
    if any(sliding) and not all(sliding):
        raise ValueError(
            f"{name} must be one number for each joint where some turn and some slide; got {value!r}"
        )
    return (checks.number(name, value),) * len(sliding)


def limit_units(units: Sequence[str]) -> dict[str, str]:
    """Return the units of the limits of joints of some units ("rad", "mm"): one where all are alike."""
    few = units[:1] if len(set(units)) == 1 else units
    rates = {"position_min": "", "position_max": "", **UNITS}
    return {name: ", ".join(unit + per for unit in few) for name, per in rates.items()}
