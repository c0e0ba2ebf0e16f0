"""Joints by damped least squares (Levenberg-Marquardt), held at their limits."""

import math

import numpy as np

from sdpgrind.base.checks import Floats
from sdpgrind.finishing.arm import _forward as chain
from sdpgrind.finishing.arm._inverse import Links

LEVER = 100.0  # mm a rad, chosen: weight of rotations against translations
STEPS = 200  # chosen: limit of the iteration
DONE = 1e-11  # mm, and rad times the lever; chosen: rounding of lengths of some 100 mm
GOOD = 1e-9  # mm, and rad times the lever; chosen: greatest error of a solution
_WEIGHTS = np.array([1.0] * 5 + [LEVER] * 2)  # of joints: rad, mm


def damped(arm: Links, target: Floats, start: Floats) -> Floats:
    """Joints near a start, within limits, for a pose of P in the work; ValueError where none is found."""
    low, high = np.array(arm.position_min), np.array(arm.position_max)
    joints, damping = np.clip(start, low, high), 1e-3
    left = _error(arm, target, joints)
    for _ in range(STEPS):
        if np.abs(left).max() <= DONE or damping > 1e12:
            break
        tried = _step(arm, joints, left, damping, low, high)
        after = _error(arm, target, tried)
        if after @ after < left @ left:
            joints, left, damping = tried, after, max(damping / 10, 1e-15)
        else:
            damping = max(damping, 1e-12) * 10
    if np.abs(left).max() > GOOD:
        place, turn = float(np.linalg.norm(left[:3])), float(np.linalg.norm(left[3:])) / LEVER
        raise ValueError(
            "pose must be within reach of joints in their limits; from this start"
            f" {place:.4g} mm and {turn:.4g} rad are left"
        )
    return joints


def _error(arm: Links, target: Floats, joints: Floats) -> Floats:
    """Remaining translation (mm) and rotation (rad times the lever)."""
    pose = chain.forward(joints, arm.lengths)
    pose[:2, 3] -= joints[5:]
    return np.concatenate([target[:3, 3] - pose[:3, 3], LEVER * _turn(target[:3, :3] @ pose[:3, :3].T)])


def _turn(rotation: Floats) -> Floats:
    """Axis times angle (rad) of a rotation."""
    skew = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine, cosine = float(np.linalg.norm(skew)), 0.5 * (float(np.trace(rotation)) - 1)
    if sine < 1e-6 and cosine < 0:  # half a turn: the axis is the direction that stays
        axis = np.linalg.eigh(0.5 * (rotation + rotation.T))[1][:, -1]
        return math.pi * axis
    return skew if sine == 0 else skew * (math.atan2(sine, cosine) / sine)


def _step(arm: Links, joints: Floats, left: Floats, damping: float, low: Floats, high: Floats) -> Floats:
    """One damped step, solved again without the joints that it would push beyond a limit."""
    slopes = chain.jacobian(joints, arm.lengths)[:, :7] * _WEIGHTS
    slopes[3:] *= LEVER
    free = np.ones(7, dtype=bool)
    while True:
        held = slopes[:, free]
        move = np.zeros(7)
        gram = held @ held.T
        move[free] = (
            held.T @ np.linalg.lstsq(gram + damping * np.trace(gram) / 6 * np.eye(6), left, rcond=None)[0]
        )
        tried = joints + _WEIGHTS * move
        out = free & (((joints <= low) & (tried < low)) | ((joints >= high) & (tried > high)))
        if not out.any():
            return np.clip(tried, low, high)
        free &= ~out
