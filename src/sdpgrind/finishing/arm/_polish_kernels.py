"""Damped least squares on a serial chain.

With the error e of a pose, translation in mm and rotation vector times a lever, and the Jacobian J scaled
alike, a step is J^T (J J^T + mu |e|^2)^-1 e: for as many joints as there are, the shortest where they are
more than six. As the damping falls with the squared error the finish is quadratic.
"""

import math

import numpy as np

from sdpgrind.base.compiling.compiled import compiled
from sdpgrind.finishing.arm._serial_kernels import forward, jacobian

LEVER = 100.0  # mm a rad, chosen: weight of rotations against translations
STEPS = 30  # chosen: from 1e-4 rad away three serve, more only at singular poses
DONE = 1e-11  # mm, and rad times the lever; chosen: rounding of lengths of some 100 mm
DAMPING = 1e-3  # chosen: of the squared error, first
NEAR = 50.0  # mm, and rad times the lever; chosen: a step from pose to pose along a path
SAME = 1e-6  # rad, mm; chosen: joints that differ by less are one solution
MOST = 1e9  # chosen: damping at which no step helps


@compiled(error_model="numpy")
def _error(pose, target, out):
    """Fill what is left (6,) from a pose to the target (4, 4); return its size."""
    sx = sy = sz = 0.0
    trace = 0.0
    for j in range(3):
        x, y, z = pose[0, j], pose[1, j], pose[2, j]
        tx, ty, tz = target[0, j], target[1, j], target[2, j]
        sx += 0.5 * (y * tz - z * ty)
        sy += 0.5 * (z * tx - x * tz)
        sz += 0.5 * (x * ty - y * tx)
        trace += x * tx + y * ty + z * tz
        out[j] = target[j, 3] - pose[j, 3]
    sine, cosine = math.sqrt(sx * sx + sy * sy + sz * sz), 0.5 * (trace - 1.0)
    scale = LEVER * (math.atan2(sine, cosine) / sine if sine > 0.0 else 1.0)
    out[3], out[4], out[5] = scale * sx, scale * sy, scale * sz
    size = 0.0
    for k in range(6):
        size += out[k] * out[k]
    return math.sqrt(size)


@compiled(error_model="numpy")
def _solved(matrix, right):
    """Solve a positive definite system (6, 6) in place, by Cholesky; `right` (6,) becomes the solution."""
    for i in range(6):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = math.sqrt(max(total, 1e-300)) if i == j else total / matrix[j, j]
    for i in range(6):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            right[i] -= matrix[k, i] * right[k]
        right[i] /= matrix[i, i]


@compiled(error_model="numpy")
def _step(slopes, error, damping, work, move):
    """Fill a damped step `move` (n,) for the error (6,); `slopes` (6, n), `work` (7, 6) holds the system."""
    count = slopes.shape[1]
    for i in range(6):
        work[6, i] = error[i]
        for j in range(i + 1):
            total = 0.0
            for k in range(count):
                total += slopes[i, k] * slopes[j, k]
            work[i, j] = total
        work[i, i] += damping
    _solved(work, work[6])
    for k in range(count):
        total = 0.0
        for i in range(6):
            total += slopes[i, k] * work[6, i]
        move[k] = total


@compiled
def _copy(joints, out):
    """Fill `out` (n,)."""
    for k in range(len(out)):
        out[k] = joints[k]


@compiled(error_model="numpy")
def _polished(links, sliding, target, joints, room):
    """Improve the joints (1, n) of one pose in place; return what is left, mm. `room`: arrays to work in."""
    pose, slopes, error, tried, work, move = room
    forward(links, sliding, joints, pose)
    left, damping = _error(pose[0], target, error), DAMPING
    for _ in range(STEPS):
        if left <= DONE:
            break
        jacobian(links, sliding, joints, pose, slopes)
        for i in range(3, 6):
            for k in range(len(move)):
                slopes[0, i, k] *= LEVER
        better = left
        while better >= left and damping < MOST:
            _step(slopes[0], error, damping * left * left, work, move)
            for k in range(len(move)):
                tried[0, k] = joints[0, k] + move[k]
            forward(links, sliding, tried, pose)
            better = _error(pose[0], target, error)
            damping *= 0.1 if better < left else 100.0
            if better >= left:
                forward(links, sliding, joints, pose)
                _error(pose[0], target, error)
        if better >= left:
            break
        _copy(tried[0], joints[0])
        left = better
    return left


@compiled
def _room(count):
    """Arrays that `_polished` works in, for so many joints."""
    return (
        np.empty((1, 4, 4)), np.empty((1, 6, count)), np.empty(6), np.empty((1, count)), np.empty((7, 6)),
        np.empty(count),
    )  # fmt: skip


@compiled
def _twin(found, joints, sliding):
    """Index among those found (b, n) of the same joints (n,), whole turns aside; -1: none."""
    turn = 2 * math.pi
    for b in range(len(found)):
        off = 0.0
        for k in range(len(joints)):
            move = found[b, k] - joints[k]
            if not sliding[k]:
                move -= turn * math.floor(move / turn + 0.5)
            off = max(off, abs(move)) if not math.isnan(move) else math.inf
        if off < SAME:
            return b
    return -1


@compiled(error_model="numpy")
def polish(links, sliding, poses, starts, joints, left, good, first):
    """Fill branches of joints (m, b, n) that are NaN, from starts; `left` (m, b): what is left, mm.

    What is reached to `good`, mm, is kept. Of two that end as one none is kept at first, later the one found.
    """
    room, one = _room(joints.shape[2]), np.empty((1, joints.shape[2]))
    for i in range(joints.shape[0]):
        for b in range(joints.shape[1]):
            if math.isnan(starts[i, b, 0]) or not math.isnan(joints[i, b, 0]):
                continue
            _copy(starts[i, b], one[0])
            left[i, b] = _polished(links, sliding, poses[i], one, room)
            if left[i, b] > good:
                continue
            twin = _twin(joints[i], one[0], sliding)
            if twin < 0:
                _copy(one[0], joints[i, b])
            elif first:
                for k in range(joints.shape[2]):
                    joints[i, twin, k] = np.nan


@compiled(error_model="numpy")
def pursue(links, sliding, poses, joints, left, good):
    """Fill branches that are NaN from their joints at the pose before, where that is near; see `polish`."""
    room, one = _room(joints.shape[2]), np.empty((1, joints.shape[2]))
    for i in range(1, joints.shape[0]):
        for b in range(joints.shape[1]):
            if not math.isnan(joints[i, b, 0]) or math.isnan(joints[i - 1, b, 0]):
                continue
            _copy(joints[i - 1, b], one[0])
            forward(links, sliding, one, room[0])
            if _error(room[0][0], poses[i], room[2]) > NEAR:
                continue
            left[i, b] = _polished(links, sliding, poses[i], one, room)
            if left[i, b] <= good and _twin(joints[i], one[0], sliding) < 0:
                _copy(one[0], joints[i, b])
