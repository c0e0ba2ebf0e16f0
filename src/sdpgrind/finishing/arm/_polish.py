"""Joints of a chain near those of a robot in closed form: damped least squares with a quadratic finish."""

import math

import numpy as np

from sdpgrind.base.checks import Bools, Floats
from sdpgrind.finishing.arm import _polish_kernels as kernels
from sdpgrind.finishing.arm._closed_form import WIDER, ClosedForm

GOOD = 1e-9  # mm, and rad times the lever; chosen: more is no solution


def solve_near(
    form: ClosedForm, links: Floats, sliding: Bools, poses: Floats, middle: Floats
) -> tuple[Floats, Floats]:
    """Joints of all branches (m, 8, 6) of poses of the flange, and mm out of reach (m, 8).

    The chain is near the form. A branch begins at its joints in the form. One that is lost, or ends where
    another does, begins again at those of forms that reach farther, and then at its joints at the pose before
    where that is near. One that is still lost, or then another's, is NaN. Angles are the turns nearest to the
    middle of their limits.
    """
    starts, beyond = form.solve(poses, middle)
    joints, left = np.full(starts.shape, np.nan), beyond.copy()
    kernels.polish(links, sliding, poses, starts, joints, left, GOOD, True)
    for farther in form.farther():
        rows = np.flatnonzero((np.isnan(joints[..., 0]) & (beyond <= WIDER)).any(axis=1))
        starts, found, rest = farther.solve(poses[rows], middle)[0], joints[rows], left[rows]
        kernels.polish(links, sliding, poses[rows], starts, found, rest, GOOD, False)
        joints[rows], left[rows] = found, rest
    kernels.pursue(links, sliding, poses, joints, left, GOOD)
    turn = 2 * math.pi
    joints += np.where(sliding, 0.0, turn * np.floor((middle - joints) / turn + 0.5))
    return joints, np.where(np.isnan(joints[..., 0]), np.where(beyond > 0, beyond, left), 0.0)
