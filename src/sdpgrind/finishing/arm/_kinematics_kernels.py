"""Inverse kinematics in closed form, one branch of the arm at a time."""

import math

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

# chosen: horizontal part of a vertical tool axis; with less, rounding alone would turn the first joint
VERTICAL = 1e-13
STRETCHED = 1e-12  # chosen: rounding of ``|cos q3|`` over 1, where the arm is stretched or folded
CROOKED = 1e-5  # chosen: error of a rotation matrix, summed over its entries, from rounding in a file
_TURN = 2 * math.pi


@compiled
def first_fault(poses):
    """Index of the first invalid pose (NaN, skewed, mirrored, wrong last row), or -1."""
    for i in range(len(poses)):
        p = poses[i]
        off = abs(p[3, 0]) + abs(p[3, 1]) + abs(p[3, 2]) + abs(p[3, 3] - 1.0)
        for k in range(3):
            for j in range(k, 3):
                dot = p[0, j] * p[0, k] + p[1, j] * p[1, k] + p[2, j] * p[2, k]
                off += abs(dot - (1.0 if j == k else 0.0))
        # The third column must be the cross product of the first two, not its mirror image.
        off += abs(p[0, 0] * p[1, 1] - p[1, 0] * p[0, 1] - p[2, 2])
        off += abs(p[1, 0] * p[2, 1] - p[2, 0] * p[1, 1] - p[0, 2])
        off += abs(p[2, 0] * p[0, 1] - p[0, 0] * p[2, 1] - p[1, 2])
        if not (off <= CROOKED and math.isfinite(p[0, 3] + p[1, 3] + p[2, 3])):
            return i
    return -1


@compiled
def _first_azimuth(poses, pitch, middle):
    """First joint at the start of a run: that of the first pose whose tool is not vertical."""
    for i in range(len(poses)):
        x, y = poses[i, 0, 2], poses[i, 1, 2]
        if math.hypot(x, y) > VERTICAL:
            return math.atan2(pitch * y, pitch * x)
    return middle


@compiled
def _joints_of(pose, lengths, radius, pitch, elbow, before, out):
    """Joints of one pose into `out` (7,), angles modulo a turn, and whether the wrist is within reach."""
    d1, a2, a3, d5 = lengths
    level = math.hypot(pose[0, 2], pose[1, 2])
    size = math.hypot(level, pose[2, 2])
    if level > VERTICAL:
        c1, s1 = pitch * pose[0, 2] / level, pitch * pose[1, 2] / level
        out[0], cos_phi = math.atan2(s1, c1), pitch * level / size
    else:
        out[0], cos_phi, c1, s1 = before, 0.0, math.cos(before), math.sin(before)
    sin_phi = pose[2, 2] / size
    height = pose[2, 3] - d1 - d5 * sin_phi
    c3 = (radius * radius + height * height - a2 * a2 - a3 * a3) / (2 * a2 * a3)
    reached = abs(c3) <= 1 + STRETCHED
    c3 = min(1.0, max(-1.0, c3))
    s3 = elbow * math.sqrt((1 - c3) * (1 + c3))
    along, across = a2 + a3 * c3, a3 * s3
    out[2] = math.atan2(s3, c3)
    out[1] = math.atan2(height * along - radius * across, radius * along + height * across)
    out[3] = math.atan2(sin_phi, cos_phi) - out[1] - out[2]
    # x4 = (-sin phi c1, -sin phi s1, cos phi), y4 = (s1, -c1, 0); the last joint turns them into the tool's.
    xx = cos_phi * pose[2, 0] - sin_phi * (c1 * pose[0, 0] + s1 * pose[1, 0])
    yx = cos_phi * pose[2, 1] - sin_phi * (c1 * pose[0, 1] + s1 * pose[1, 1])
    xy, yy = s1 * pose[0, 0] - c1 * pose[1, 0], s1 * pose[0, 1] - c1 * pose[1, 1]
    out[4] = math.atan2(xy - yx, xx + yy)
    out[5], out[6] = (radius + d5 * cos_phi) * c1 - pose[0, 3], (radius + d5 * cos_phi) * s1 - pose[1, 3]
    return reached


@compiled
def inverse(poses, lengths, radius, pitch, elbow, middle, continuous, joints, reached):
    """Joints of all poses in one branch (pitch and elbow: +1 or -1), into `joints` (m, 7) and `reached` (m,).

    Continuous: each angle is the one nearest to the pose before, and whole turns put the middle of its range
    nearest to the middle of the limits. Else each angle is the one nearest to that middle.
    """
    before = _first_azimuth(poses, pitch, middle[0]) if continuous else middle[0]
    for i in range(len(poses)):
        q = joints[i]
        reached[i] = _joints_of(poses[i], lengths, radius, pitch, elbow, before, q)
        for j in range(5):
            near = joints[i - 1, j] if continuous and i > 0 else middle[j]
            q[j] += _TURN * math.floor((near - q[j]) / _TURN + 0.5)
        if continuous:
            before = q[0]
    if continuous and len(poses) > 0:
        for j in range(5):
            low, high = np.inf, -np.inf
            for i in range(len(poses)):
                low, high = min(low, joints[i, j]), max(high, joints[i, j])
            turns = math.floor((middle[j] - 0.5 * (low + high)) / _TURN + 0.5)
            for i in range(len(poses)):
                joints[i, j] += _TURN * turns


@compiled
def first_beyond(joints, reached, low, high):
    """Index of the first pose out of reach or with a joint beyond its limits, or -1."""
    for i in range(len(joints)):
        kept = reached[i]
        for j in range(joints.shape[1]):
            kept = kept and low[j] <= joints[i, j] <= high[j]
        if not kept:
            return i
    return -1


@compiled
def travel(joints, speed, angular, turn):
    """Time through the poses by the slowest joint, s; first pose after which an angle turns too far."""
    time, at = 0.0, -1
    for i in range(len(joints) - 1):
        longest = 0.0
        for j in range(joints.shape[1]):
            way = abs(joints[i + 1, j] - joints[i, j])
            longest = max(longest, way / speed[j])
            if angular[j] and way > turn and at < 0:
                at = i
        time += longest
    return time, at
