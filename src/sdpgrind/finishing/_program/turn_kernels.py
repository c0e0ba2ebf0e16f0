"""Quaternions of rotation matrices."""

from math import sqrt

from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def quaternions(poses, most, out):
    """Write the quaternions (m, 4), x y z w, of poses (m, 4, 4); return whether all rotations are some.

    Rows of a rotation are orthonormal, up to `most` in their products, and right-handed.
    """
    for n in range(len(poses)):
        r, q = poses[n], out[n]
        if not _rotates(r, most):
            return False
        trace = r[0, 0] + r[1, 1] + r[2, 2]
        i, greatest = 3, trace  # the greatest component divides best
        for c in range(3):
            if r[c, c] > greatest or (r[c, c] == greatest and i == 3):
                i, greatest = c, r[c, c]
        j, k = (i + 1) % 3, (i + 2) % 3
        if i == 3:
            q[0], q[1], q[2] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
            q[3] = 1.0 + trace
        else:
            q[i], q[j], q[k] = 1.0 - trace + 2.0 * r[i, i], r[j, i] + r[i, j], r[k, i] + r[i, k]
            q[3] = r[k, j] - r[j, k]
        length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        for c in range(4):
            q[c] /= length
    return True


@compiled(error_model="numpy")
def _rotates(r, most):
    """Whether the rows of a matrix are orthonormal and right-handed."""
    for i in range(3):
        for j in range(i, 3):
            product = r[i, 0] * r[j, 0] + r[i, 1] * r[j, 1] + r[i, 2] * r[j, 2]
            if not abs(product - (1.0 if i == j else 0.0)) <= most:
                return False
    x = r[0, 1] * r[1, 2] - r[0, 2] * r[1, 1]
    y = r[0, 2] * r[1, 0] - r[0, 0] * r[1, 2]
    z = r[0, 0] * r[1, 1] - r[0, 1] * r[1, 0]
    return x * r[2, 0] + y * r[2, 1] + z * r[2, 2] > 0.0
