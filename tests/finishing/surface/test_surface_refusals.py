"""What is refused at the door of a surface, and in which words."""

import re

import numpy as np
import pytest

from sdpgrind.finishing import Surface
from sdpgrind.finishing.surface import cylinder_surface, flat_surface, nominal_surface, sphere_surface

DIE = nominal_surface()
NET = np.array(DIE.control_points)
CLAMPED = np.array(DIE.knots[0])


def changed(array, place, value):
    out = np.array(array, dtype=float)
    out[place] = value
    return out


def with_knots(knots):
    return Surface.bspline(NET, knots=(CLAMPED, knots))


REFUSED = [
    # control points
    (lambda: Surface.bspline(NET[..., 0]), "control_points must be of shape (nu, nv, 3); got (6, 6)"),
    (lambda: Surface.bspline(NET[..., :2]), "control_points must be of shape (nu, nv, 3); got (6, 6, 2)"),
    (lambda: Surface.bspline("die"), "control_points must be numbers (mm); got 'die'"),
    (
        lambda: Surface.bspline(changed(NET, (0, 1, 2), np.nan)),
        "control_points[5] must be finite (mm); got nan",
    ),
    (
        lambda: Surface.bspline(np.ones((6, 6, 3))),
        "control_points must not all coincide (mm); got [[1.0, 1.0, 1.0]] everywhere",
    ),
    (
        lambda: Surface.bspline(np.ones((0, 6, 3))),
        "control_points must be of shape (nu, nv, 3); got (0, 6, 3)",
    ),
    (lambda: Surface.bspline(NET[:3]), "control points along u must be at least degree + 1 = 4; got 3"),
    (
        lambda: Surface.bspline(NET, degree=(3, 6)),
        "control points along v must be at least degree + 1 = 7; got 6",
    ),
    # degrees
    (lambda: Surface.bspline(NET, degree=(0, 3)), "degree[0] must be >= 1; got 0"),
    (lambda: Surface.bspline(NET, degree=(3, 2.0)), "degree[1] must be a whole number; got 2.0"),
    (lambda: Surface.bspline(NET, degree=3), "degree must be a pair, one entry for u and one for v; got 3"),
    (
        lambda: Surface.bspline(NET, degree=(3, 3, 3)),
        "degree must be a pair, one entry for u and one for v; got (3, 3, 3)",
    ),
    # knots
    (lambda: Surface.bspline(NET, knots=3), "knots must be a pair, one entry for u and one for v; got 3"),
    (
        lambda: Surface.bspline(NET, knots="uv"),
        "knots must be a pair, one entry for u and one for v; got 'uv'",
    ),
    (
        lambda: with_knots(CLAMPED[1:]),
        "knots[1] must be control points + degree + 1 = 6 + 3 + 1 = 10 numbers; got 9",
    ),
    (
        lambda: with_knots([CLAMPED]),
        "knots[1] must be control points + degree + 1 = 6 + 3 + 1 = 10 numbers; got (1, 10)",
    ),
    (
        lambda: with_knots(changed(CLAMPED, 5, 0.25)),
        "knots[1] must not decrease; got 0.25 behind 0.333333 at 5",
    ),
    (lambda: with_knots(changed(CLAMPED, 5, np.nan)), "knots[1][5] must be finite; got nan"),
    (
        lambda: with_knots([0, 0, 0, 0, 0, 0.5, 1, 1, 1, 1]),
        "knots[1] must hold no knot more than degree + 1 = 4 times; got 0 5 times",
    ),
    (
        lambda: with_knots(np.linspace(0, 1, 10) ** 0),
        "knots[1] must hold no knot more than degree + 1 = 4 times; got 1 10 times",
    ),
    (
        lambda: Surface.bspline(NET[:4, :4], knots=([-3, -2, -1, 0, 0, 1, 2, 3], [0, 0, 0, 0, 1, 1, 1, 1])),
        "knots[0] must leave a domain, knot 3 < knot 4; got 0 at both",
    ),
    # weights, side
    (
        lambda: Surface.nurbs(NET, np.ones((6, 5))),
        "weights must be of the control points' shape (6, 6); got (6, 5)",
    ),
    (lambda: Surface.nurbs(NET, changed(np.ones((6, 6)), (2, 1), 0.0)), "weights[2, 1] must be > 0; got 0.0"),
    (
        lambda: Surface.nurbs(NET, changed(np.ones((6, 6)), (5, 5), -2.0)),
        "weights[5, 5] must be > 0; got -2.0",
    ),
    (
        lambda: Surface.nurbs(NET, changed(np.ones((6, 6)), (0, 3), np.nan)),
        "weights[3] must be finite; got nan",
    ),
    (
        lambda: Surface.nurbs(NET, None),
        "weights must be given; Surface.bspline makes a surface without; got None",
    ),
    (lambda: Surface.bspline(NET, outward=0), "outward must be one of 1, -1; got 0"),
    # parameters
    (lambda: DIE.point(1.2, 0.5), "u must be in the surface's domain [0, 1]; got 1.2"),
    (lambda: DIE.normal(0.5, [0.1, 0.2, -0.01]), "v[2] must be in the surface's domain [0, 1]; got -0.01"),
    (lambda: DIE.derivatives(0.5, [0.1, np.nan]), "v[1] must be finite; got nan"),
    (lambda: DIE.area_density(0.5, np.inf), "v[0] must be finite; got inf"),
    (lambda: DIE.grid([0.0, 1.5], [0.0]), "u[1] must be in the surface's domain [0, 1]; got 1.5"),
    (lambda: DIE.grid(0.5, [0.0]), "u must be one-dimensional; got ()"),
    (lambda: DIE.grid([0.5], [[0.0]]), "v must be one-dimensional; got (1, 1)"),
    (
        lambda: DIE.replace(knots=(3 * CLAMPED, CLAMPED)).point(3.1, 0),
        "u must be in the surface's domain [0, 3]; got 3.1",
    ),
    (
        lambda: DIE.point([0.1, 0.2], [0.1, 0.2, 0.3]),
        "u, v must be of shapes that fit together; got (2,) and (3,)",
    ),
    # directions, moves
    (
        lambda: DIE.normal_curvature(0.5, 0.25, 0.0, 0.0),
        "(du, dv) must have a length on the surface; got (0, 0) at (u, v) = (0.5, 0.25)",
    ),
    (lambda: DIE.normal_curvature(0.5, 0.25, np.nan, 0.0), "du[0] must be finite; got nan"),
    (
        lambda: DIE.normal_curvature(0.5, [0.1, 0.2], [1.0, 2.0, 3.0], 0.0),
        "points, du, dv must be of shapes that fit together; got (2,) and (3,) and ()",
    ),
    (lambda: DIE.moved([1.0, 2.0]), "translation must be of three numbers (mm); got (2,)"),
    (lambda: DIE.moved([1.0, np.nan, 0.0]), "translation[1] must be finite (mm); got nan"),
    (lambda: DIE.replace(weight=2), "Surface has no field 'weight'; is weights meant?"),
    # surfaces ready to use
    (lambda: flat_surface(0.0), "side must be > 0 (mm); got 0.0"),
    (lambda: flat_surface(0.0064), "side must be in mm, some 50; units.m(...) for metres; got 0.0064"),
    (lambda: cylinder_surface(0.3, 50.0), "radius must be in mm, some 50; units.m(...) for metres; got 0.3"),
    (lambda: cylinder_surface(-1.0, 5.0), "radius must be > 0 (mm); got -1.0"),
    (lambda: cylinder_surface(1.0, np.nan), "length must be finite (mm); got nan"),
    (lambda: sphere_surface("20"), "radius must be a number (mm); got '20'"),
]


@pytest.mark.parametrize(("what", "message"), REFUSED, ids=[message[:40] for _, message in REFUSED])
def test_refused(what, message):
    with pytest.raises((ValueError, TypeError), match=f"^{re.escape(message)}$"):
        what()


def test_a_knot_may_be_there_degree_plus_one_times():
    """The surface is torn there, and each side has its own points; the right side owns the knot."""
    knots = [0, 0, 1, 1, 2, 2]
    net = [[[x, y, z] for y in (0.0, 1.0)] for x, z in ((0.0, 0.0), (1.0, 0.0), (1.0, 5.0), (2.0, 5.0))]
    torn = Surface.bspline(net, degree=(1, 1), knots=(knots, [0, 0, 1, 1]))
    np.testing.assert_array_equal(torn.point([0.5, 1.0, 2.0], 0.0)[:, 2], [0.0, 5.0, 5.0])
    assert torn.area == pytest.approx(2.0, rel=1e-14)
