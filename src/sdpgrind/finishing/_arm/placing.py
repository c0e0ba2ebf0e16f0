"""Where to put the work so that the table works about its middle."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sdpgrind.base import checks
from sdpgrind.base.checks import Floats
from sdpgrind.finishing._arm.inverse import checked_poses, joints_of

if TYPE_CHECKING:
    from sdpgrind.finishing._arm.arm import Arm


def table_shift(arm: "Arm", poses: npt.ArrayLike, *, wrist_radius: float = 350.0, branch: int = 0) -> Floats:
    """Return by how much to move the work in x and y so that the table's way lies in the middle of its range.

    Parameters
    ----------
    arm : Arm
        With the limits of its table, mm.
    poses : array_like (m, 4, 4)
        Poses of P where the work is now, mm; at least one.
    wrist_radius : float
        Distance of the wrist from the first axis, mm.
    branch : {0, 1, 2, 3}
        See `Arm.inverse`.

    Returns
    -------
    array (2,)
        To be added to the positions of the work and of the poses, mm.

    Raises
    ------
    ValueError
        When there is no pose, or one is none.

    Examples
    --------
    >>> from sdpgrind import finishing
    >>> arm = finishing.Arm.generic()
    >>> poses = arm.forward([[0.0, 0.2, -1.0, -0.5, 0.0]])
    >>> poses[:, 0, 3] += 300.0
    >>> radius = float(300 * np.cos(0.2) + 250 * np.cos(0.8))
    >>> finishing.table_shift(arm, poses, wrist_radius=radius).round(6) + 0.0
    array([-300.,    0.])
    """
    checks.one_of("branch", branch, range(4))
    radius, array = checks.positive("wrist_radius", wrist_radius, "mm"), checked_poses(poses)
    if not len(array):
        raise ValueError("poses must be at least one; got none")
    table = joints_of(arm, array, radius, branch, True)[0][:, 5:]
    middle = 0.5 * (np.array(arm.position_min[5:]) + np.array(arm.position_max[5:]))
    out: Floats = 0.5 * (table.min(axis=0) + table.max(axis=0)) - middle
    return out
