"""Joints near a start for poses, on the chain itself: damped least squares with a quadratic finish."""

import math

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.arm import _polish_kernels as kernels

GOOD = 1e-6  # mm, and rad times the lever; chosen: more is no solution


def polish(
    links: Floats, sliding: Bools, poses: Floats, joints: Floats, beyond: Floats, middle: Floats
) -> None:
    """Improve joints (m, b, n), in place, until the chain reaches the poses (m, 4, 4) of its last link.

    A start that is NaN stays so. One from which the pose is not reached becomes NaN, and `beyond` (m, b) what
    is left, mm. Angles are the turns nearest to the middle of their limits.
    """
    left = np.empty(beyond.shape)
    kernels.polish(links, sliding, poses, joints, left)
    lost = left > GOOD  # not of NaN
    joints[lost], beyond[lost] = np.nan, left[lost]
    turn = 2 * math.pi
    joints += np.where(sliding, 0.0, turn * np.floor((middle - joints) / turn + 0.5))
