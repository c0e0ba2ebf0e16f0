"""Slow, obvious twins of serial robots: chains of URDF joints, the inverse as the equations print it."""

import itertools

import numpy as np

from sdpgrind import finishing, units

UR10 = finishing.robot("ur10")
IRB2400 = finishing.robot("irb2400")
BOTH = {"ur10": UR10, "irb2400": IRB2400}

# Joints of five robots of three makers: kind, origin (m), roll-pitch-yaw (rad), axis. Lengths are facts of the
# makers' data sheets, as ROS-Industrial (abb, kuka_experimental, universal_robot: BSD-3, Apache-2.0) has them.
Q = "1.570796325"
CHAINS = {
    "ur10": [
        ("revolute", "0 0 0.128", "0 0 0", "0 0 1"),
        ("revolute", "0 0.1704 0", f"0 {Q} 0", "0 1 0"),
        ("revolute", "0 -0.12817 0.60186", "0 0 0", "0 1 0"),
        ("revolute", "0 0 0.56415", f"0 {Q} 0", "0 1 0"),
        ("revolute", "0 0.11279 0", "0 0 0", "0 0 1"),
        ("revolute", "0 0 0.11279", "0 0 0", "0 1 0"),
        ("fixed", "0 0.0857 0", f"0 0 {Q}", None),
    ],
    "irb2400": [
        ("revolute", "0 0 0", "0 0 0", "0 0 1"),
        ("revolute", "0.1 0 0.615", "0 0 0", "0 1 0"),
        ("revolute", "0 0 0.705", "0 0 0", "0 1 0"),
        ("revolute", "0.258 0 0.135", "0 0 0", "1 0 0"),
        ("revolute", "0.497 0 0", "0 0 0", "0 1 0"),
        ("revolute", "0.085 0 0", "0 0 0", "1 0 0"),
    ],
    "kr16": [
        ("revolute", "0 0 0.675", "0 0 0", "0 0 -1"),
        ("revolute", "0.26 0 0", "0 0 0", "0 1 0"),
        ("revolute", "0.68 0 0", "0 0 0", "0 1 0"),
        ("revolute", "0.67 0 -0.035", "0 0 0", "-1 0 0"),
        ("revolute", "0 0 0", "0 0 0", "0 1 0"),
        ("revolute", "0 0 0", "0 0 0", "-1 0 0"),
        ("fixed", "0.158 0 0", "0 1.57079632679 0", None),
    ],
    "kr210": [
        ("continuous", "-0.00262 0.00097586 0.33099", "0 0 0", "0 0 1"),
        ("revolute", "0.35277 -0.037476 0.4192", "0 0 0", "0 1 0"),
        ("revolute", "-9.8483E-05 -0.1475 1.2499", "0 0 0", "0 1 0"),
        ("revolute", "0.95795 0.184 -0.055059", "0 0 0", "1 0 0"),
        ("revolute", "0.542 0 0", "0 0 0", "0 1 0"),
        ("revolute", "0.1925 0 0", "0 0 0", "1 0 0"),
        ("fixed", "0.0375 0 -0.00023924", "0.1 -0.2 0.3", None),
    ],
    "iiwa14 on a track": [
        ("prismatic", "0 0.2 0", "0.3 -1.1 2.4", "1 2 -2"),
        ("revolute", "0 0 0", "0 0 0", "0 0 1"),
        ("revolute", "-0.00043624 0 0.36", "0 0 0", "0 1 0"),
        ("revolute", "0 0 0", "0 0 0", "0 0 1"),
        ("revolute", "0.00043624 0 0.42", "0 0 0", "0 -1 0"),
        ("revolute", "0 0 0", "0 0 0", "0 0 1"),
        ("revolute", "0 0 0.4", "0 0 0", "0 1 0"),
        ("revolute", "0 0 0", "0 0 0", None),  # the axis of URDF's default, x
        ("fixed", "0 0 0.126", "0 0 0", None),
    ],
}


def urdf(joints, head='<robot name="a">', limit='lower="-2.5" upper="2.5" velocity="1.5"'):
    """Text of a URDF file: links l0, l1, ..., joints j1, j2, ..."""
    lines = [head, *(f'<link name="l{k}"/>' for k in range(len(joints) + 1))]
    for k, (kind, xyz, rpy, axis) in enumerate(joints, start=1):
        told = "" if axis is None else f'<axis xyz="{axis}"/>'
        lines.append(
            f'<joint name="j{k}" type="{kind}"><parent link="l{k - 1}"/><child link="l{k}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/>{told}<limit effort="0" {limit}/></joint>'
        )
    return "\n".join([*lines, "</robot>"])


def read(folder, joints, **options):
    path = folder / "robot.urdf"
    path.write_text(urdf(joints, **options))
    ends = {"base": "l0", "tip": f"l{len(joints)}"}
    kinds = [kind for kind, *_ in joints if kind != "fixed"]
    if "prismatic" not in kinds:
        return finishing.SerialRobot.from_urdf(path, **ends, acceleration_max=10.0, jerk_max=100.0)
    acceleration = [2000.0 if kind == "prismatic" else 10.0 for kind in kinds]
    return finishing.SerialRobot.from_urdf(path, **ends, acceleration_max=acceleration)


def about(axis, angle):
    """Rotation about an axis: Rodrigues."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def chain(joints, q):
    """Pose of the last link (mm) by products of rotations, joint by joint; q in rad and mm."""
    pose, values = np.eye(4), iter(q)
    for kind, xyz, rpy, axis in joints:
        step = np.eye(4)
        r, p, y = map(float, rpy.split())
        step[:3, :3] = about([0, 0, 1], y) @ about([0, 1, 0], p) @ about([1, 0, 0], r)
        step[:3, 3] = 1000 * np.array(list(map(float, xyz.split())))
        pose = pose @ step
        if kind == "fixed":
            continue
        way = np.array(list(map(float, (axis or "1 0 0").split())))
        move = np.eye(4)
        if kind == "prismatic":
            move[:3, 3] = next(values) * way / np.linalg.norm(way)
        else:
            move[:3, :3] = about(way, next(values))
        pose = pose @ move
    return pose


def printed_ur(pose):
    """All solutions of the UR10 as the equations are printed: alpha 90, 0, 0, 90, -90, 0 deg."""
    d4, d5, d6, a2, a3, d1 = 163.941, 115.7, 92.2, -612.0, -572.3, 127.3
    R, p, found = pose[:3, :3], pose[:3, 3], []
    p5 = p - d6 * R[:, 2]
    for side, flip, elbow in itertools.product((1, -1), repeat=3):
        q1 = np.arctan2(p5[1], p5[0]) + side * np.arccos(d4 / np.hypot(p5[0], p5[1])) + np.pi / 2
        s1, c1 = np.sin(q1), np.cos(q1)
        q5 = flip * np.arccos((p[0] * s1 - p[1] * c1 - d4) / d6)
        s5 = np.sin(q5)
        n, o = -R[0, 0] * s1 + R[1, 0] * c1, -R[0, 1] * s1 + R[1, 1] * c1
        q6 = np.arctan2(o / s5, -n / s5)
        T14 = np.linalg.inv(dh(q1, d1, 0, np.pi / 2)) @ pose
        T14 = T14 @ np.linalg.inv(dh(q5, d5, 0, -np.pi / 2) @ dh(q6, d6, 0, 0))
        X, Y = T14[0, 3], T14[1, 3]
        c3 = (X * X + Y * Y - a2 * a2 - a3 * a3) / (2 * a2 * a3)
        if abs(c3) > 1:
            continue
        q3 = elbow * np.arccos(c3)
        q2 = np.arctan2(Y, X) - np.arctan2(a3 * np.sin(q3), a2 + a3 * c3)
        q4 = np.arctan2(T14[1, 0], T14[0, 0]) - q2 - q3
        found.append([q1, q2, q3, q4, q5, q6])
    return np.array(found).reshape(-1, 6)


def printed_wrist(pose):
    """All solutions of the IRB 2400 as the equations are printed: alpha -90, 0, -90, 90, -90, 0 deg."""
    d1, a1, a2, a3, d4, d6 = 615.0, 100.0, 705.0, 135.0, 755.0, 85.0
    pose = pose @ FLANGE.T
    R, found = pose[:3, :3], []
    w = pose[:3, 3] - d6 * R[:, 2]
    reach, g = np.hypot(a3, d4), np.arctan2(d4, a3)
    for side, elbow, s in itertools.product((1, -1), repeat=3):
        q1 = np.arctan2(w[1], w[0]) - np.arctan2(0.0, side * np.hypot(w[0], w[1]))
        X, Y = w[0] * np.cos(q1) + w[1] * np.sin(q1) - a1, d1 - w[2]
        cos = (X * X + Y * Y - a2 * a2 - reach**2) / (2 * a2 * reach)
        if abs(cos) > 1:
            continue
        t = elbow * np.arccos(cos)
        q2 = np.arctan2(Y, X) - np.arctan2(reach * np.sin(t), a2 + reach * cos)
        q3 = t - g
        R03 = (dh(q1, d1, a1, -np.pi / 2) @ dh(q2, 0, a2, 0) @ dh(q3, 0, a3, -np.pi / 2))[:3, :3]
        R36 = R03.T @ R
        q5 = s * np.arccos(R36[2, 2])
        q4, q6 = np.arctan2(-s * R36[1, 2], -s * R36[0, 2]), np.arctan2(-s * R36[2, 1], s * R36[2, 0])
        found.append([q1, q2 + np.pi / 2, q3, q4, q5, q6])
    return np.array(found).reshape(-1, 6)


FLANGE = np.array([[0.0, 0, 1, 0], [0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]])
"""Flange of the URDF chain of the IRB 2400 in that of its Denavit-Hartenberg rows."""


def dh(theta, d, a, alpha):
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


def within_a_turn(robot, count, rng):
    """Random joints within limits, at most half a turn either way."""
    low, high = np.maximum(robot.position_min, -np.pi), np.minimum(robot.position_max, np.pi)
    return rng.uniform(low, high, (count, 6))


def apart(one, other):
    """Greatest difference of angles, whole turns aside, over the joints."""
    return np.abs(np.mod(one - other + np.pi, 2 * np.pi) - np.pi).max(axis=-1)


LIMITS = {
    "position_min": [-units.deg(350.0)] * 6,
    "position_max": [units.deg(350.0)] * 6,
    "speed_max": [3.0] * 6,
    "acceleration_max": [10.0] * 6,
}
