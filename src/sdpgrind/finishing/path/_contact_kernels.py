"""Chain rule from the unit square to the surface, and contact frames."""

from math import sqrt

from sdpgrind.base.compiling.compiled import compiled


@compiled(error_model="numpy")
def along(coefficients, piece, t, slack, out):
    """Polynomials (k, degree + 1, 2) of the pieces at t, with two derivatives, into `out` (m, 3, 2).

    Values within `slack` outside [0, 1] are clipped; returned is the last row further outside, or -1.
    """
    outside = -1
    for m in range(len(piece)):
        for c in range(2):
            value, first, second = 0.0, 0.0, 0.0
            for i in range(coefficients.shape[1] - 1, -1, -1):
                second = second * t[m] + first
                first = first * t[m] + value
                value = value * t[m] + coefficients[piece[m], i, c]
            if value < -slack or value > 1.0 + slack:
                outside = m
            else:
                value = min(max(value, 0.0), 1.0)
            out[m, 0, c], out[m, 1, c], out[m, 2, c] = value, first, 2.0 * second
    return outside


@compiled(error_model="numpy")
def speeds(jets, su, sv, out):
    """Speeds ``|Q'|`` (m,) for jets (m, 3, 2) of the parameters, mm a unit of t."""
    for m in range(len(out)):
        u1, v1, total = jets[m, 1, 0], jets[m, 1, 1], 0.0
        for c in range(3):
            total += (su[m, c] * u1 + sv[m, c] * v1) ** 2
        out[m] = sqrt(total)


@compiled(error_model="numpy")
def follow(jets, place, su, sv, suu, suv, svv, outward, speed, tangent, bend, normal, area):
    """Tangents, curvature vectors, normals for jets (m, 3, 2) of (u, v) at `place`, rows of the surface."""
    for m in range(len(place)):
        k = place[m]
        u1, v1, u2, v2 = jets[m, 1, 0], jets[m, 1, 1], jets[m, 2, 0], jets[m, 2, 1]
        squared, along_it = 0.0, 0.0
        for c in range(3):
            tangent[m, c] = su[k, c] * u1 + sv[k, c] * v1
            bend[m, c] = (
                su[k, c] * u2
                + sv[k, c] * v2
                + suu[k, c] * u1 * u1
                + 2.0 * suv[k, c] * u1 * v1
                + svv[k, c] * v1 * v1
            )
            squared += tangent[m, c] ** 2
            along_it += bend[m, c] * tangent[m, c]
        speed[m] = sqrt(squared)
        for c in range(3):
            bend[m, c] = (bend[m, c] - along_it / squared * tangent[m, c]) / squared
            tangent[m, c] /= speed[m]
        normal[m, 0] = su[k, 1] * sv[k, 2] - su[k, 2] * sv[k, 1]
        normal[m, 1] = su[k, 2] * sv[k, 0] - su[k, 0] * sv[k, 2]
        normal[m, 2] = su[k, 0] * sv[k, 1] - su[k, 1] * sv[k, 0]
        area[m] = sqrt(normal[m, 0] ** 2 + normal[m, 1] ** 2 + normal[m, 2] ** 2)
        for c in range(3):
            normal[m, c] *= outward / area[m]


@compiled(error_model="numpy")
def put_frames(point, place, tangent, normal, out):
    """Write frames (x = t, y = n x t, z = n) into `out` (m, 4, 4), at rows `place` of the points."""
    for m in range(len(place)):
        t0, t1, t2 = tangent[m, 0], tangent[m, 1], tangent[m, 2]
        n0, n1, n2 = normal[m, 0], normal[m, 1], normal[m, 2]
        out[m, 0, 0], out[m, 1, 0], out[m, 2, 0], out[m, 3, 0] = t0, t1, t2, 0.0
        out[m, 0, 1], out[m, 1, 1] = n1 * t2 - n2 * t1, n2 * t0 - n0 * t2
        out[m, 2, 1], out[m, 3, 1] = n0 * t1 - n1 * t0, 0.0
        out[m, 0, 2], out[m, 1, 2], out[m, 2, 2], out[m, 3, 2] = n0, n1, n2, 0.0
        for c in range(3):
            out[m, c, 3] = point[place[m], c]
        out[m, 3, 3] = 1.0
