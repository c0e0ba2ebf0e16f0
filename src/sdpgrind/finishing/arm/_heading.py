"""Costs of a heading: distance of the tool from the vertical, jumps of table and joints at corners."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm._inverse import SLACK, checked_runs

if TYPE_CHECKING:
    from sdpgrind.finishing.arm._arm import Arm


def pitch_cosine(poses: Floats) -> Floats:
    """``|cos(phi)|`` of the tool's pitch, (m,); q1 turns faster than the tool's axis by its inverse."""
    out: Floats = np.hypot(poses[:, 0, 2], poses[:, 1, 2])
    return out


class CornerJumps(NamedTuple):
    """Motion of joints and table between runs, without contact, at a constant wrist radius.

    Attributes
    ----------
    turn : array (k,)
        Turn of q1 in the same branch, rad, in (-pi, pi].
    table : array (k, 2)
        Travel of the table in the same branch, mm.
    flip : array (k,)
        Turn of the pitch q2 + q3 + q4 where the arm changes to the other pair of branches, rad, in (-pi, pi].
    flip_turn : array (k,)
        Turn of q1 with that change, rad, in (-pi, pi].
    flip_table : array (k, 2)
        Travel of the table with that change, mm.
    """

    turn: Floats
    table: Floats
    flip: Floats
    flip_turn: Floats
    flip_table: Floats


def corner_jumps(
    arm: "Arm", runs: Sequence[npt.ArrayLike], *, wrist_radius: float = 350.0, branch: int = 0
) -> CornerJumps:
    """Return the jumps of joints and table from the end of each run to the start of the next, without limits.

    An arm without wrist yaw points where q1 does: at a corner q1 turns by the angle of the heading, and the
    table carries the work around the base. With r = wrist_radius + (d5 + R) cos(phi) from the base's axis to
    the contact a corner of 90 deg moves it by sqrt(2) r, a reversal by 2 r.

    Parameters
    ----------
    arm : Arm
        The robot, mm.
    runs : sequence of array_like (m, 4, 4)
        Poses of P in the frame of the work with the table at zero, mm.
    wrist_radius : float
        Distance of the wrist from the first axis, mm.
    branch : {0, 1, 2, 3}
        Branch of all runs; see `Arm.inverse`.

    Returns
    -------
    CornerJumps
        In rad and mm, one entry for each corner (none for one run).

    Examples
    --------
    >>> from sdpgrind import finishing, units
    >>> contact = dict(contact_angle=units.deg(30), lever_arm=95.0, heading="feed_aligned")
    >>> along_x, along_y = [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]
    >>> place, up = [[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]
    >>> ends = [finishing.arm.tool_poses(place, feed, up, **contact) for feed in (along_x, along_y)]
    >>> jumps = finishing.arm.corner_jumps(finishing.Arm.generic(), ends)
    >>> round(float(abs(jumps.turn[0])), 4), round(float((jumps.table[0] ** 2).sum() ** 0.5), 1)
    (1.5708, 733.8)
    """
    checks.one_of("branch", branch, range(4))
    radius = checks.positive("wrist_radius", wrist_radius, "mm")
    checked = checked_runs(runs)
    sign = -1.0 if branch >= 2 else 1.0
    after = _places(arm, [poses[0] for poses in checked[1:]], radius, sign)
    flipped = _places(arm, [poses[0] for poses in checked[1:]], radius, -sign)
    before = _places(arm, [poses[-1] for poses in checked[:-1]], radius, sign)
    stay, over = after - before, flipped - before
    return CornerJumps(
        _wrapped(stay[:, 0]), stay[:, 2:], _wrapped(over[:, 1]), _wrapped(over[:, 0]), over[:, 2:]
    )


def check_corners(arm: "Arm", jumps: CornerJumps) -> None:
    """Refuse corners whose table jump exceeds the table's range; the error names the farthest one."""
    if not len(jumps.table):
        return
    span = np.array(arm.position_max[5:]) - np.array(arm.position_min[5:])
    beyond = np.abs(jumps.table) - span
    if beyond.max() <= SLACK:
        return
    k = int(np.argmax(np.hypot(*jumps.table.T)))
    axis = int(np.argmax(beyond[k]))
    raise ValueError(
        "heading must not ask more of the table than it has;"
        f" at corner {k} q1 turns by {np.degrees(abs(jumps.turn[k])):.3g} deg"
        f" and the table jumps by {np.hypot(*jumps.table[k]):.4g} mm,"
        f" {arm.names[5 + axis]} beyond its range of {span[axis]:g} mm by {beyond[k, axis]:.4g} mm"
        " (the arm has no wrist yaw: take heading='fixed')"
    )


def _places(arm: "Arm", poses: list[Floats], radius: float, sign: float) -> Floats:
    """Azimuth q1, pitch (rad) and table (mm) of poses, (k, 4); tool forward (sign 1) or backward (-1)."""
    pose = np.array(poses).reshape(-1, 4, 4)
    x, y, z = pose[:, 0, 2], pose[:, 1, 2], pose[:, 2, 2]
    azimuth, pitch = np.arctan2(sign * y, sign * x), np.arctan2(z, sign * np.hypot(x, y))
    out = radius + arm.d5 * np.cos(pitch)
    table = [out * np.cos(azimuth) - pose[:, 0, 3], out * np.sin(azimuth) - pose[:, 1, 3]]
    return np.column_stack([azimuth, pitch, *table])


def _wrapped(angle: Floats) -> Floats:
    """Angles in (-pi, pi]."""
    out: Floats = np.pi - np.mod(np.pi - angle, 2 * np.pi)
    return out
