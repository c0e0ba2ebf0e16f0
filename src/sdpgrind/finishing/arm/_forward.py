"""Poses and Jacobian of the arm from its joints, in closed form."""

from typing import NamedTuple

import numpy as np

from sdpgrind.base.checks import Floats


class _Links(NamedTuple):
    """Sines and cosines of q1 and pitch; elbow, wrist and tool in the vertical plane of the arm."""

    c1: Floats
    s1: Floats
    cos_phi: Floats
    sin_phi: Floats
    elbow: tuple[Floats, Floats]  # radius and height over the shoulder, mm
    wrist: tuple[Floats, Floats]
    tool: tuple[Floats, Floats]


def _links(joints: Floats, lengths: tuple[float, float, float, float]) -> _Links:
    _, a2, a3, d5 = lengths
    second, third = joints[..., 1], joints[..., 1] + joints[..., 2]
    pitch = third + joints[..., 3]
    cos_phi, sin_phi = np.cos(pitch), np.sin(pitch)
    elbow = (a2 * np.cos(second), a2 * np.sin(second))
    wrist = (elbow[0] + a3 * np.cos(third), elbow[1] + a3 * np.sin(third))
    tool = (wrist[0] + d5 * cos_phi, wrist[1] + d5 * sin_phi)
    return _Links(np.cos(joints[..., 0]), np.sin(joints[..., 0]), cos_phi, sin_phi, elbow, wrist, tool)


def forward(joints: Floats, lengths: tuple[float, float, float, float]) -> Floats:
    """Pose of P in the base, (..., 4, 4)."""
    k = _links(joints, lengths)
    c5, s5, none = np.cos(joints[..., 4]), np.sin(joints[..., 4]), np.zeros_like(k.c1)
    x4 = np.stack([-k.sin_phi * k.c1, -k.sin_phi * k.s1, k.cos_phi], axis=-1)
    y4 = np.stack([k.s1, -k.c1, none], axis=-1)
    pose = np.zeros((*k.c1.shape, 4, 4))
    pose[..., :3, 0] = c5[..., None] * x4 + s5[..., None] * y4
    pose[..., :3, 1] = c5[..., None] * y4 - s5[..., None] * x4
    pose[..., :3, 2] = np.stack([k.cos_phi * k.c1, k.cos_phi * k.s1, k.sin_phi], axis=-1)
    pose[..., :3, 3] = np.stack([k.tool[0] * k.c1, k.tool[0] * k.s1, lengths[0] + k.tool[1]], axis=-1)
    pose[..., 3, 3] = 1.0
    return pose


def jacobian(joints: Floats, lengths: tuple[float, float, float, float]) -> Floats:
    """Velocity of P in the frame of the work (mm/s, rad/s) per speed of joints, table, motor, (..., 6, 8)."""
    k = _links(joints, lengths)
    none, one = np.zeros_like(k.c1), np.ones_like(k.c1)
    out = np.zeros((*k.c1.shape, 6, 8))
    out[..., 0, 0], out[..., 1, 0], out[..., 5, 0] = -k.tool[0] * k.s1, k.tool[0] * k.c1, 1.0
    for j, (radius, height) in enumerate([(none, none), k.elbow, k.wrist], start=1):
        across, up = k.tool[1] - height, k.tool[0] - radius
        out[..., :3, j] = np.stack([-across * k.c1, -across * k.s1, up], axis=-1)
        out[..., 3:, j] = np.stack([k.s1, -k.c1, none], axis=-1)
    pose = forward(joints, lengths)
    out[..., 3:, 4] = pose[..., :3, 2]
    out[..., 0, 5] = out[..., 1, 6] = -one
    out[..., 3:, 7] = pose[..., :3, 1]
    return out
