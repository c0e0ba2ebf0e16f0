"""Geometry that writers and readers of programs share: rigid motions, unit quaternions, lifts."""

import math
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sdpgrind.base.checks import Floats
from sdpgrind.finishing._program.turn_kernels import quaternions

LIFT = 20.0  # mm, chosen: start and end of a program above the work, clear of it and within reach
ORTHONORMAL = 1e-12  # source: scipy, beyond which it takes the nearest rotation
ALIKE = 1e-6  # rad, chosen: below it a straight line between quaternions is exact to rounding


def shifted(length: float) -> Floats:
    """Return the rigid motion (4, 4) along z by a length, mm."""
    out = np.eye(4)
    out[2, 3] = length
    return out


def inverse(pose: Floats) -> Floats:
    """Return the inverse of one rigid motion (4, 4), mm."""
    out = np.eye(4)
    out[:3, :3] = pose[:3, :3].T
    out[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return out


def poses_of(points: Floats, turns: Floats) -> Floats:
    """Return poses (m, 4, 4), mm, of points (m, 3) and quaternions (m, 4), x y z w."""
    out = np.zeros((len(points), 4, 4))
    out[:, :3, :3] = Rotation.from_quat(turns).as_matrix()
    out[:, :3, 3] = points
    out[:, 3, 3] = 1.0
    return out


def turns_of(poses: Floats) -> Floats:
    """Return the quaternions (m, 4), x y z w, of poses (m, 4, 4)."""
    out = np.empty((len(poses), 4))
    if quaternions(poses, ORTHONORMAL, out):
        return out
    return np.asarray(Rotation.from_matrix(poses[:, :3, :3]).as_quat())  # of the nearest rotations


def angle_between(first: Floats, second: Floats) -> Floats:
    """Return the angles (...), rad, between quaternions (..., 4)."""
    near = np.minimum(
        np.linalg.norm(first - second, axis=-1), np.linalg.norm(first + second, axis=-1)
    )  # 2 sin(angle / 4): exact for small angles
    out: Floats = 4.0 * np.arcsin(np.minimum(0.5 * near, 1.0))
    return out


def between(first: Floats, second: Floats, share: Floats) -> Floats:
    """Return the quaternions at shares (...) of the shortest turn from one to another, at constant rate."""
    dot = np.sum(first * second, axis=-1)[..., None]
    other = np.where(dot < 0.0, -second, second)
    half = 0.5 * angle_between(first, other)[..., None]
    u = np.asarray(share)[..., None]
    safe = np.where(half < ALIKE, 1.0, half)
    alike = half < ALIKE
    a = np.where(alike, 1.0 - u, np.sin((1.0 - u) * safe) / np.sin(safe))
    b = np.where(alike, u, np.sin(u * safe) / np.sin(safe))
    out = a * first + b * other
    unit: Floats = out / np.linalg.norm(out, axis=-1, keepdims=True)
    return unit


def outward(pose: Floats, contact_angle: float, spin: float, *, pushed: bool) -> Floats:
    """Return the outward normal (3,) of the work at a pose of the tool, see `arm.tool_poses`.

    `spin`: the turn of the tool about its own axis in the pose, rad.
    """
    sign = 1.0 if pushed else -1.0
    ahead = math.cos(spin) * pose[:3, 0] - math.sin(spin) * pose[:3, 1] if spin else pose[:3, 0]
    out: Floats = -sign * math.cos(contact_angle) * ahead - math.sin(contact_angle) * pose[:3, 2]
    return out


def raised(pose: Floats, problem: Any, spin: float) -> Floats:
    """Return a pose of the tool (4, 4), turned by `spin`, rad, moved off the work by `LIFT`, mm."""
    out = pose.copy()
    out[:3, 3] += LIFT * outward(pose, problem.contact_angle, spin, pushed=problem.pushed)
    return out
