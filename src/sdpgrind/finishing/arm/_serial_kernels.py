"""Kinematics of serial robots: poses, Jacobians, and both closed forms of the inverse.

In both forms the first joint turns about z, axis 2 is perpendicular to it, axis 3 parallel to axis 2. With
z_1 = (s1, -c1, 0) the direction of axis 2, a point p behind the first two links of the arm's plane lies at

    p . z_1 = p_x s1 - p_y c1 = e,    p . x_1 = p_x c1 + p_y s1 = rho = +- sqrt(r^2 - e^2),    r = |p_xy|

with a constant e. These two equations are linear in (c1, s1): c1 = (rho p_x - e p_y)/r^2, s1 = (rho p_y + e
p_x)/r^2. In the plane, X = rho - a1 and Y = p_z are the end of two links a2, a3: the law of cosines.

Spherical wrist: p is the point in which axes 4, 5, 6 meet; the rest of the rotation, W = Rz(4) Rx(90) Rz(5)
Rx(-90) Rz(6), has the third column (-s5 c4, -s5 s4, c5).

Parallel axes (UR): p is the point in which axes 5 and 6 meet; z_1 in the frame of the flange is (s5 c6, -s5
s6, c5), which gives joints 5 and 6, and the direction of link 4 by them: p less that link is X, Y of axis 4.

A product of three factors vanishes at singular poses: rho (p over axis 1), sin 3 (elbow), sin 5 (wrist).
"""

import math

import numpy as np

from sdpgrind.base.compiling.compiled import compiled

BRANCHES = 8  # derived: two signs each of rho, sin 3 and sin 5
# chosen: excess of a cosine over 1 by rounding alone; 1e-9 mm out of reach is 3e-12 for an arm of 1.2 m
STRETCHED = 1e-12
# chosen: sine of joint 5 below which joints 4 and 6 turn about one axis; a tool 1 m away moves 1e-9 mm
ALIGNED = 1e-12
ON_AXIS = 1e-9  # mm, chosen: distance from axis 1 below which the wrist has no azimuth
_TURN = 2 * math.pi


@compiled
def _after(pose, link):
    """Multiply a pose (3, 4), in place, by a link (4, 4)."""
    for i in range(3):
        x, y, z = pose[i, 0], pose[i, 1], pose[i, 2]
        for j in range(3):
            pose[i, j] = x * link[0, j] + y * link[1, j] + z * link[2, j]
        pose[i, 3] += x * link[0, 3] + y * link[1, 3] + z * link[2, 3]


@compiled
def _moved(pose, slides, joint):
    """Turn a pose (3, 4), in place, about its z axis, or shift it along."""
    if slides:
        for i in range(3):
            pose[i, 3] += joint * pose[i, 2]
        return
    c, s = math.cos(joint), math.sin(joint)
    for i in range(3):
        x, y = pose[i, 0], pose[i, 1]
        pose[i, 0], pose[i, 1] = c * x + s * y, c * y - s * x


@compiled
def forward(links, sliding, joints, out):
    """Poses (m, 4, 4) behind links (n + 1, 4, 4) with a joint after each but the last; joints (m, n)."""
    for k in range(len(joints)):
        pose = out[k]
        for i in range(4):
            for j in range(4):
                pose[i, j] = links[0, i, j]
        for j in range(joints.shape[1]):
            _moved(pose, sliding[j], joints[k, j])
            _after(pose, links[j + 1])


@compiled
def jacobian(links, sliding, joints, poses, out):
    """Velocity and angular velocity (m, 6, n) of `poses` (m, 4, 4) per speed of a joint."""
    for k in range(len(joints)):
        here = links[0].copy()
        for j in range(joints.shape[1]):
            x, y, z = here[0, 2], here[1, 2], here[2, 2]
            if sliding[j]:
                out[k, 0, j], out[k, 1, j], out[k, 2, j] = x, y, z
                out[k, 3, j] = out[k, 4, j] = out[k, 5, j] = 0.0
            else:
                px, py = poses[k, 0, 3] - here[0, 3], poses[k, 1, 3] - here[1, 3]
                pz = poses[k, 2, 3] - here[2, 3]
                out[k, 0, j], out[k, 1, j], out[k, 2, j] = y * pz - z * py, z * px - x * pz, x * py - y * px
                out[k, 3, j], out[k, 4, j], out[k, 5, j] = x, y, z
            _moved(here, sliding[j], joints[k, j])
            _after(here, links[j + 1])


@compiled
def _inner(pose, before, behind, out):
    """Fill (3, 4) with ``before @ pose @ behind``."""
    for i in range(3):
        for j in range(4):
            out[i, j] = before[i, 0] * pose[0, j] + before[i, 1] * pose[1, j] + before[i, 2] * pose[2, j]
        out[i, 3] += before[i, 3]
    _after(out, behind)


@compiled
def _shoulder(x, y, offset, side):
    """Cosine and sine of joint 1, rho, and how far the point is inside of |offset|, mm (0: reached)."""
    r = math.hypot(x, y)
    if r <= ON_AXIS and abs(offset) <= ON_AXIS:
        return side, 0.0, 0.0, 0.0
    if abs(offset) > r * (1 + STRETCHED):
        return 1.0, 0.0, 0.0, abs(offset) - r
    rho = side * math.sqrt(max(0.0, (r - offset) * (r + offset)))
    return (rho * x - offset * y) / (r * r), (rho * y + offset * x) / (r * r), rho, 0.0


@compiled
def _elbow(x, y, a2, a3, side):
    """Joints 2 and 3 of two links that end at (x, y), and how far that is out of reach, mm (0: reached)."""
    c = (x * x + y * y - a2 * a2 - a3 * a3) / (2 * a2 * a3)
    if abs(c) > 1 + STRETCHED:
        distance = math.hypot(x, y)
        return np.nan, np.nan, max(distance - a2 - a3, abs(a2 - a3) - distance)
    c = min(1.0, max(-1.0, c))
    s = side * math.sqrt((1 - c) * (1 + c))
    along, across = a2 + a3 * c, a3 * s
    return math.atan2(y * along - x * across, x * along + y * across), math.atan2(s, c), 0.0


@compiled
def _kept(angles, signs, zeros, middle, out):
    """Joints from angles: the turn of each that is nearest to the middle of its limits."""
    for j in range(6):
        q = signs[j] * (angles[j] - zeros[j])
        out[j] = q + _TURN * math.floor((middle[j] - q) / _TURN + 0.5)


@compiled
def _unreached(out, beyond, first, count, short):
    for b in range(first, first + count):
        out[b] = np.nan
        beyond[b] = short


@compiled
def _spherical(pose, lengths, crooked, zeros, signs, middle, angles, wrist, out, beyond):
    """All branches (8, 6) of one pose (3, 4) of a robot whose axes 4, 5, 6 meet."""
    a1, a2, a3, _, offset, _ = lengths
    for k in range(2):
        c1, s1, rho, short = _shoulder(pose[0, 3], pose[1, 3], offset, 1.0 - 2 * k)
        if short > 0:
            _unreached(out, beyond, 4 * k, 4, short)
            continue
        angles[0] = math.atan2(s1, c1)
        for e in range(2):
            angles[1], angles[2], short = _elbow(rho - a1, pose[2, 3], a2, a3, 1.0 - 2 * e)
            first, other = 4 * k + e, 4 * k + 2 + e
            if short > 0:
                _unreached(out, beyond, first, 1, short)
                _unreached(out, beyond, other, 1, short)
                continue
            c, s = math.cos(angles[1] + angles[2]), math.sin(angles[1] + angles[2])
            for j in range(3):  # the rotation behind link 3, in its own frame and then that of the wrist
                plane = c1 * pose[0, j] + s1 * pose[1, j]
                x, y = c * plane + s * pose[2, j], c * pose[2, j] - s * plane
                z = s1 * pose[0, j] - c1 * pose[1, j]
                for i in range(3):
                    wrist[i, j] = crooked[i, 0] * x + crooked[i, 1] * y + crooked[i, 2] * z
            s5 = math.hypot(wrist[0, 2], wrist[1, 2])
            c5 = wrist[2, 2]
            if s5 > ALIGNED:
                c4, s4 = -wrist[0, 2] / s5, -wrist[1, 2] / s5
                angles[3] = math.atan2(s4, c4)
            else:
                angles[3], c4, s4 = zeros[3], math.cos(zeros[3]), math.sin(zeros[3])
            angles[4] = math.atan2(s5, c5)
            across = c4 * wrist[1, 0] - s4 * wrist[0, 0]
            angles[5] = math.atan2(across, c5 * (c4 * wrist[0, 0] + s4 * wrist[1, 0]) + s5 * wrist[2, 0])
            _kept(angles, signs, zeros, middle, out[first])
            # the other wrist: half a turn of joints 4 and 6, joint 5 mirrored
            angles[3], angles[4], angles[5] = angles[3] + math.pi, -angles[4], angles[5] + math.pi
            _kept(angles, signs, zeros, middle, out[other])
            beyond[first] = beyond[other] = 0.0


@compiled
def _parallel(pose, lengths, zeros, signs, middle, angles, out, beyond):
    """All branches (8, 6) of one pose (3, 4) of a robot whose axes 2, 3, 4 are parallel."""
    a1, a2, a3, a4, offset, d5 = lengths
    for k in range(2):
        c1, s1, rho, short = _shoulder(pose[0, 3], pose[1, 3], offset, 1.0 - 2 * k)
        if short > 0:
            _unreached(out, beyond, 4 * k, 4, short)
            continue
        angles[0] = math.atan2(s1, c1)
        n, o = s1 * pose[0, 0] - c1 * pose[1, 0], s1 * pose[0, 1] - c1 * pose[1, 1]
        size, c5 = math.hypot(n, o), s1 * pose[0, 2] - c1 * pose[1, 2]
        for w in range(2):
            s5 = (1.0 - 2 * w) * size
            angles[4] = math.atan2(s5, c5)
            if size > ALIGNED:
                c6, s6 = n / s5, -o / s5
                angles[5] = math.atan2(s6, c6)
            else:
                angles[5], c6, s6 = zeros[5], math.cos(zeros[5]), math.sin(zeros[5])
            # x and z of frame 4 in the plane of the arm, along x_1 and z
            x0, x1, x2 = c5 * c6, -c5 * s6, -s5
            cw = c1 * (pose[0, 0] * x0 + pose[0, 1] * x1 + pose[0, 2] * x2) + s1 * (
                pose[1, 0] * x0 + pose[1, 1] * x1 + pose[1, 2] * x2
            )
            sw = pose[2, 0] * x0 + pose[2, 1] * x1 + pose[2, 2] * x2
            ahead = c1 * (pose[0, 0] * s6 + pose[0, 1] * c6) + s1 * (pose[1, 0] * s6 + pose[1, 1] * c6)
            up = pose[2, 0] * s6 + pose[2, 1] * c6
            x, y = rho + d5 * ahead - a4 * cw - a1, pose[2, 3] + d5 * up - a4 * sw
            whole = math.atan2(sw, cw)
            for e in range(2):
                angles[1], angles[2], short = _elbow(x, y, a2, a3, 1.0 - 2 * e)
                b = 4 * k + 2 * w + e
                if short > 0:
                    _unreached(out, beyond, b, 1, short)
                    continue
                angles[3] = whole - angles[1] - angles[2]
                _kept(angles, signs, zeros, middle, out[b])
                beyond[b] = 0.0


@compiled
def inverse(poses, wrists, before, behind, lengths, crooked, zeros, signs, middle, out, beyond):
    """All branches: joints (m, 8, 6), NaN where there are none, and mm out of reach (m, 8); 0: reached.

    `wrists`: the spherical form, else that of parallel axes. Branch 4 k + 2 w + e: k = 1 the negative rho, w
    = 1 the negative sine of joint 5, e = 1 the negative sine of joint 3.
    """
    inner, angles, wrist = np.empty((3, 4)), np.empty(6), np.empty((3, 3))
    for i in range(len(poses)):
        _inner(poses[i], before, behind, inner)
        if wrists:
            _spherical(inner, lengths, crooked, zeros, signs, middle, angles, wrist, out[i], beyond[i])
        else:
            _parallel(inner, lengths, zeros, signs, middle, angles, out[i], beyond[i])


@compiled
def follow(joints, angular, middle):
    """Unwrap angles (m, n), in place: nearest to the row before, the course nearest to the middle."""
    for j in range(joints.shape[1]):
        if not angular[j]:
            continue
        low, high = joints[0, j], joints[0, j]
        for i in range(1, len(joints)):
            near = joints[i - 1, j]
            joints[i, j] += _TURN * math.floor((near - joints[i, j]) / _TURN + 0.5)
            low, high = min(low, joints[i, j]), max(high, joints[i, j])
        turns = math.floor((middle[j] - 0.5 * (low + high)) / _TURN + 0.5)
        for i in range(len(joints)):
            joints[i, j] += _TURN * turns
