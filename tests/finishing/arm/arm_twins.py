"""Slow, obvious twins of the arm: products of Denavit-Hartenberg matrices, the inverse as the equations have
it.
"""

import numpy as np

from sdpgrind.finishing import Arm

GENERIC = Arm.generic()
WIDE = GENERIC.replace(
    position_min=(*(-np.pi,) * 5, -3000.0, -3000.0),
    position_max=(*(np.pi,) * 5, 3000.0, 3000.0),
)
"""The same arm without limits worth the name: all four branches are open."""


def link(theta, d, a, alpha):
    """Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha)."""
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]])
    tilt = np.array([[1, 0, 0, a], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]])
    return turn @ tilt


def chain(joints, motor=0.0, lengths=(400.0, 300.0, 250.0, 100.0), frames=False):
    """Pose of P in the work's frame as a product of links; the motor turns it about its y axis."""
    d1, a2, a3, d5 = lengths
    q1, q2, q3, q4, q5, x, y = joints
    table = np.eye(4)
    table[:2, 3] = -x, -y
    turned = np.eye(4)
    turned[[0, 2], [0, 2]], turned[0, 2], turned[2, 0] = np.cos(motor), np.sin(motor), -np.sin(motor)
    quarter = np.pi / 2
    links = [
        link(q1, d1, 0, quarter),
        link(q2, 0, a2, 0),
        link(q3, 0, a3, 0),
        link(q4 + quarter, 0, 0, quarter),
        link(q5, d5, 0, 0),
    ]
    poses = np.array([np.linalg.multi_dot([table, *links[: k + 1], np.eye(4)]) for k in range(5)])
    return poses if frames else poses[-1] @ turned


def inverse(pose, radius, branch, lengths=(400.0, 300.0, 250.0, 100.0)):
    """Joints of one pose, equation by equation, in no particular turn; None where the wrist is out of reach."""
    d1, a2, a3, d5 = lengths
    x, y, z = pose[:3, 2]
    phi, q1 = np.arcsin(z), np.arctan2(y, x)
    if branch >= 2:
        phi, q1 = np.pi - phi, q1 + np.pi
    height = pose[2, 3] - d1 - d5 * np.sin(phi)
    cosine = (radius**2 + height**2 - a2**2 - a3**2) / (2 * a2 * a3)
    if abs(cosine) > 1:
        return None
    q3 = (1 if branch % 2 else -1) * np.arccos(cosine)
    q2 = np.arctan2(height, radius) - np.arctan2(a3 * np.sin(q3), a2 + a3 * np.cos(q3))
    q4 = phi - q2 - q3
    before = chain([q1, q2, q3, q4, 0.0, 0.0, 0.0], lengths=lengths)
    left = before[:3, :3].T @ pose[:3, :3]
    return np.array([q1, q2, q3, q4, np.arctan2(left[1, 0], left[0, 0]), *(before[:2, 3] - pose[:2, 3])])


def random_poses(rng, count, radius=350.0, lengths=(400.0, 300.0, 250.0, 100.0)):
    """Poses of any orientation whose wrist, `radius` from the axis, is within reach."""
    d1, a2, a3, d5 = lengths
    quaternion = rng.normal(size=(count, 4))
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1)[:, None]).T
    poses = np.zeros((count, 4, 4))
    poses[:, 0, :3] = np.column_stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)])
    poses[:, 1, :3] = np.column_stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)])
    poses[:, 2, :3] = np.column_stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)])
    highest = np.sqrt((a2 + a3) ** 2 - radius**2)
    poses[:, :2, 3] = rng.uniform(-300, 300, (count, 2))
    poses[:, 2, 3] = d1 + d5 * poses[:, 2, 2] + rng.uniform(-highest, highest, count)
    poses[:, 3, 3] = 1.0
    return poses


def turned(angle):
    """The difference of two angles in (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)
