"""Where Qu x Qv vanishes: the limit from the interior, where there is one, or a refusal that names the place;
never NaN.
"""

import numpy as np
import pytest
from cox_de_boor import some_surface
from finishing_inside import QUARTER, QUARTER_WEIGHTS
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.finishing import Surface
from sdpgrind.finishing.surface import sphere_surface

AT = np.array([0.0, 0.2, 0.5, 0.9, 1.0])


@pytest.mark.parametrize("side", [1, -1])
def test_the_pole_of_a_sphere(side):
    ball = sphere_surface(20.0, inside=side < 0)
    assert np.linalg.norm(ball.derivatives(AT, 1.0).u, axis=-1).max() < 1e-13
    np.testing.assert_allclose(ball.normal(AT, 1.0), np.tile([0, 0, side], (5, 1)), atol=1e-12)
    np.testing.assert_allclose(ball.mean_curvature(AT, 1.0), -side / 20, rtol=1e-9)
    np.testing.assert_allclose(ball.gaussian_curvature(AT, 1.0), 1 / 400, rtol=1e-9)
    np.testing.assert_allclose(ball.principal_curvatures(AT, 1.0), -side / 20, rtol=1e-9)
    np.testing.assert_allclose(ball.normal_curvature(AT, 1.0, 0.0, 1.0), -side / 20, rtol=1e-9)


def test_a_pole_among_other_points():
    ball = sphere_surface(20.0)
    u, v = np.array([0.1, 0.5, 0.9]), np.array([0.0, 0.999999999999, 1.0])
    normal = ball.normal(u[:, None], v)
    np.testing.assert_allclose(normal, ball.point(u[:, None], v) / 20, atol=1e-11)
    assert np.isfinite(ball.gaussian_curvature(u[:, None], v)).all()


@pytest.mark.parametrize("apart", [1e-4, 1e-5, 1e-6, 1e-8, 1e-9, 1e-12])
def test_curvatures_near_the_pole(apart):
    """Forms from derivatives have relative errors of rounding over `apart` squared there."""
    ball = sphere_surface(20.0)
    np.testing.assert_allclose(ball.mean_curvature(AT, 1.0 - apart), -1 / 20, rtol=1e-8)
    np.testing.assert_allclose(ball.gaussian_curvature(AT, 1.0 - apart), 1 / 400, rtol=2e-8)
    np.testing.assert_allclose(ball.principal_curvatures(AT, 1.0 - apart), -1 / 20, rtol=2e-8)


def test_near_an_apex_the_curvature_is_what_it_is():
    """No limit at the apex, but H = -1/(2 r) beside it, as well as rounding lets it."""
    across = np.array([1.0, 0.0])
    net = 20.0 * np.stack([np.outer(x, across) for x in QUARTER.T] + [np.tile(1 - across, (3, 1))], axis=-1)
    cone = Surface.nurbs(net, np.outer(QUARTER_WEIGHTS, [1, 1]), degree=(2, 1))
    distance = 20 * np.sqrt(2) * 1e-5
    assert abs(cone.mean_curvature(0.4, 1 - 1e-5)) * 2 * distance == pytest.approx(1.0, rel=1e-6)


def test_the_pole_in_other_parameters():
    ball = sphere_surface(20.0)
    other = ball.replace(knots=(1e-3 * ball.knots[0] + 5.0, 40.0 * ball.knots[1] - 9.0))
    np.testing.assert_allclose(
        other.normal(5.0 + 1e-3 * AT[1:4], 31.0), np.tile([0, 0, 1], (3, 1)), atol=1e-10
    )


def test_at_the_pole_a_direction_may_have_no_length():
    ball = sphere_surface(20.0)
    message = r"\(du, dv\) must have a length on the surface; got \(2, 0\) at \(u, v\) = \(0.5, 1\)"
    with pytest.raises(ValueError, match=f"^{message}$"):
        ball.normal_curvature([0.1, 0.5], [0.5, 1.0], 2.0, 0.0)


def test_corners_of_a_disc_from_a_square():
    """At its four corners Qu and Qv are opposite; the disc is flat there as elsewhere."""
    half = np.sqrt(0.5)
    net = [[[-1, 0], [-1, -1], [0, -1]], [[-1, 1], [0, 0], [1, -1]], [[0, 1], [1, 1], [1, 0]]]
    net = 10.0 * np.concatenate([net, np.zeros((3, 3, 1))], axis=-1)
    disc = Surface.nurbs(net, [[1, half, 1], [half, 1, half], [1, half, 1]], degree=(2, 2), outward=-1)
    u, v = [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]
    assert disc.area_density(u, v).max() < 1e-12
    np.testing.assert_allclose(disc.normal(u, v), np.tile([0, 0, 1], (4, 1)), atol=1e-12)
    np.testing.assert_allclose(disc.gaussian_curvature(u, v), 0.0, atol=1e-12)
    assert disc.area == pytest.approx(100 * np.pi, rel=1e-13)


def test_an_apex_of_a_cone_has_normals_but_no_mean_curvature():
    """Half angle 45 degrees: for each u its own normal; K = 0, but H = -1/(2 r) grows without limit."""
    across = np.array([1.0, 0.0])
    net = 20.0 * np.stack([np.outer(x, across) for x in QUARTER.T] + [np.tile(1 - across, (3, 1))], axis=-1)
    cone = Surface.nurbs(net, np.outer(QUARTER_WEIGHTS, [1, 1]), degree=(2, 1))
    np.testing.assert_allclose(cone.normal(AT, 1.0), cone.normal(AT, 0.5), atol=1e-12)
    np.testing.assert_allclose(cone.gaussian_curvature(AT, 1.0), 0.0, atol=1e-12)
    with pytest.raises(
        ValueError, match=r"^the surface has no mean curvature at \(u, v\) = \(0.2, 1\): \|Qu x Qv\| vanishes"
    ):
        cone.mean_curvature(AT[1:], 1.0)
    assert cone.area == pytest.approx(np.pi * 20 * 20 * np.sqrt(2) / 4, rel=1e-12)


@pytest.mark.parametrize("rows", [2, 3])
def test_rows_of_control_points_that_coincide(rows):
    """Qu = 0 along an edge, to first or second order: the tangents keep their directions, and the normal is
    there.
    """
    x, y = np.array([0.0, 10.0, 20.0, 30.0]), np.arange(4.0) * 10
    x[:rows] = 0.0
    x, y = np.meshgrid(x, y, indexing="ij")
    surface = Surface.bspline(np.stack([x, y, 0.02 * x * y + 0.1 * y], axis=-1))
    assert not surface.derivatives(0.0, AT).u.any()
    zx, zy = 0.02 * 30 * AT, 0.1
    exact = np.stack([-zx, 0 * zx - zy, 0 * zx + 1], axis=-1) / np.sqrt(1 + zx**2 + zy**2)[:, None]
    np.testing.assert_allclose(surface.normal(0.0, AT), exact, atol=1e-9)


def test_points_in_one_line():
    line = Surface.bspline(np.arange(16.0).reshape(4, 4, 1) * np.array([1.0, 2.0, 3.0]))
    with pytest.raises(
        ValueError,
        match=r"^the surface has no normal at \(u, v\) = \(0.25, 0.5\): \|Qu x Qv\| vanishes there",
    ):
        line.normal(0.25, 0.5)
    assert line.area == pytest.approx(0.0, abs=1e-9)


def test_a_fold():
    """A patch folded over at u = 1/2: its normals on both sides are opposite."""
    fold = Surface.bspline([[[x, y, 0.0] for y in (0.0, 10.0)] for x in (0.0, 10.0, 0.0)], degree=(2, 1))
    np.testing.assert_allclose(fold.normal([0.4, 0.6], 0.3), [[0, 0, 1], [0, 0, -1]], atol=1e-15)
    with pytest.raises(ValueError, match=r"^the surface has no normal at \(u, v\) = \(0.5, 0.3\)"):
        fold.normal([0.4, 0.5], 0.3)


def test_a_fold_beside_a_pole():
    """Two arcs with common points and end tangents, of other weights: the strip between them folds over near
    its corner.
    """
    arc = [[-3.0, 0.0, 0.0], [0.0, 9.0, 0.0], [3.0, 1.0, 0.0]]
    knots = ([0.0, 0.0, 1.0, 1.0], [-0.99, -0.1, 0.0, 1.0, 1.1, 1.66])
    strip = Surface.nurbs([arc, arc], [[2.2, 2.57, 2.72], [2.42, 2.73, 1.31]], degree=(1, 2), knots=knots)
    assert strip.normal(0.25, [1e-5, 0.3])[:, 2].round(9).tolist() in ([1.0, -1.0], [-1.0, 1.0])
    with pytest.raises(ValueError, match=r"^the surface has no normal at \(u, v\) = \(0, 0\)"):
        strip.normal(0.0, 0.0)


@given(st.integers(0, 2**32 - 1), st.sampled_from(["edge", "corner", "line", "all in a line"]))
@settings(max_examples=40, deadline=None)
def test_never_nan(seed, how):
    """Whatever collapses: a finite normal of length one, or a refusal."""
    surface = some_surface(seed)
    net = np.array(surface.control_points)
    if how == "edge":
        net[0] = net[0, 0]
    elif how == "corner":
        net[0, 1] = net[1, 0] = net[0, 0]
    elif how == "line":
        net[1] = net[0]
    else:
        net[..., 1:] = 0.0
    surface = surface.replace(control_points=net)
    (u0, u1), (v0, v1) = surface.domain
    for u in (u0, 0.5 * (u0 + u1)):
        for v in (v0, 0.4 * v0 + 0.6 * v1):
            for function in (surface.normal, surface.gaussian_curvature, surface.mean_curvature):
                try:
                    found = function(u, v)
                except ValueError as error:
                    assert str(error).startswith("the surface has no ")
                else:
                    assert np.isfinite(found).all()
                    assert function != surface.normal or np.linalg.norm(found) == pytest.approx(1.0, abs=1e-6)
