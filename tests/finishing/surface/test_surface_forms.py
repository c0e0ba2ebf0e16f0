"""Forms, curvature and area: closed forms, the spec's own formulas, differences, Gauss-Bonnet, and what no
motion changes.
"""

import numpy as np
import pytest
from cox_de_boor import places, some_surface
from finishing_inside import QUARTER, QUARTER_WEIGHTS, gauss
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad
from scipy.interpolate import NdBSpline
from scipy.spatial.transform import Rotation

from sdpgrind.finishing import Surface
from sdpgrind.finishing.surface import (
    cylinder_surface,
    flat_surface,
    nominal_surface,
    sphere_surface,
    uneven_surfaces,
)

SEEDS = st.integers(0, 2**32 - 1)
whole = settings(max_examples=25, deadline=None)
INSIDE = np.random.default_rng(4).uniform(0.02, 0.98, (2, 50))
# z = 0.008 x y
SADDLE = Surface.bspline([[[0, 0, 0], [0, 50, 0]], [[50, 0, 0], [50, 50, 20]]], degree=(1, 1))


def torus(outer, inner):
    """A sixteenth of a torus about z: the quarter of its outer half above z = 0, exactly."""
    across, up = inner * QUARTER.T
    net = np.stack([np.outer(x, outer + across) for x in QUARTER.T] + [np.broadcast_to(up, (3, 3))], axis=-1)
    return Surface.nurbs(net, np.outer(QUARTER_WEIGHTS, QUARTER_WEIGHTS), degree=(2, 2))


@pytest.mark.parametrize("inside", [False, True])
def test_a_cylinder(inside):
    shape, side = cylinder_surface(20.0, 50.0, inside=inside), 1 if inside else -1
    u, v = INSIDE
    point, normal = shape.point(u, v), shape.normal(u, v)
    np.testing.assert_allclose(np.hypot(point[:, 0], point[:, 2]), 20.0, rtol=1e-14)
    np.testing.assert_allclose(normal, -side * point * [1, 0, 1] / 20.0, atol=1e-14)
    np.testing.assert_allclose(shape.gaussian_curvature(u, v), 0.0, atol=1e-15)
    np.testing.assert_allclose(shape.mean_curvature(u, v), side / 40.0, rtol=1e-12)
    k1, k2 = shape.principal_curvatures(u, v)
    np.testing.assert_allclose(k1, max(side, 0) / 20.0, atol=1e-14)
    np.testing.assert_allclose(k2, min(side, 0) / 20.0, atol=1e-14)
    np.testing.assert_allclose(shape.normal_curvature(u, v, 0.0, -3.0), side / 20.0, rtol=1e-12)
    np.testing.assert_allclose(shape.normal_curvature(u, v, 2.0, 0.0), 0.0, atol=1e-15)
    assert shape.area == pytest.approx(np.pi / 2 * 20 * 50, rel=1e-13)


@pytest.mark.parametrize("inside", [False, True])
def test_a_sphere(inside):
    shape, side = sphere_surface(20.0, inside=inside), 1 if inside else -1
    u, v = INSIDE
    np.testing.assert_allclose(shape.normal(u, v), -side * shape.point(u, v) / 20.0, atol=1e-14)
    np.testing.assert_allclose(shape.gaussian_curvature(u, v), 1 / 400, rtol=1e-12)
    np.testing.assert_allclose(shape.mean_curvature(u, v), side / 20, rtol=1e-12)
    for k in shape.principal_curvatures(u, v):  # 1e-8 apart, if H^2 - K were formed by subtraction
        np.testing.assert_allclose(k, side / 20, rtol=1e-12)
    np.testing.assert_allclose(shape.normal_curvature(u, v, u - v, v + 0.1), side / 20, rtol=1e-12)
    assert shape.area == pytest.approx(np.pi / 2 * 400, rel=1e-13)


def test_a_torus():
    """K = cos t/(r (R + r cos t)), 2H = 1/r + cos t/(R + r cos t), with t the angle around the tube."""
    R, r = 40.0, 15.0
    shape, (u, v) = torus(R, r), INSIDE
    x, y, z = np.moveaxis(shape.point(u, v), -1, 0)
    across = np.hypot(x, y) - R
    np.testing.assert_allclose(across**2 + z**2, r**2, rtol=1e-13)
    around = across / r / (R + across)
    np.testing.assert_allclose(shape.gaussian_curvature(u, v), around / r, rtol=1e-12)
    np.testing.assert_allclose(shape.mean_curvature(u, v), -0.5 * (1 / r + around), rtol=1e-12)
    k1, k2 = shape.principal_curvatures(u, v)
    np.testing.assert_allclose(k1, -around, rtol=1e-12)
    np.testing.assert_allclose(k2, -1 / r, rtol=1e-12)
    # Pappus, for a quarter of each circle
    assert shape.area == pytest.approx(np.pi / 2 * r * (R * np.pi / 2 + r), rel=1e-13)


def test_a_flat():
    shape = flat_surface(30.0)
    assert shape.area == pytest.approx(900.0, rel=1e-15) and shape.area_error <= 1e-12
    np.testing.assert_array_equal(shape.normal(*INSIDE), np.tile([0.0, 0.0, 1.0], (50, 1)))
    for value in (
        shape.gaussian_curvature(*INSIDE),
        shape.mean_curvature(*INSIDE),
        *shape.principal_curvatures(*INSIDE),
    ):
        assert not value.any()


def test_a_saddle():
    """z = c x y: K = -c^2/(1 + c^2 (x^2 + y^2))^2, H = -c^3 x y/(1 + ...)^(3/2), area by another quadrature."""
    c, (x, y) = 0.008, 50.0 * INSIDE
    metric = 1.0 + c**2 * (x**2 + y**2)
    np.testing.assert_allclose(SADDLE.gaussian_curvature(*INSIDE), -(c**2) / metric**2, rtol=1e-12)
    np.testing.assert_allclose(SADDLE.mean_curvature(*INSIDE), -(c**3) * x * y / metric**1.5, rtol=1e-10)
    area, error = dblquad(lambda y, x: np.sqrt(1.0 + c**2 * (x**2 + y**2)), 0, 50, 0, 50, epsabs=1e-9)
    assert SADDLE.area == pytest.approx(area, abs=error + 1e-9)


def test_the_nominal_die_is_a_graph():
    """Greville abscissae make x = 50 u and y = 50 v, so that K and H follow from the height's own
    derivatives.
    """
    die, (u, v) = nominal_surface(), INSIDE
    height = NdBSpline(die.knots, die.control_points[..., 2], (3, 3))
    z, zx, zy, zxx, zxy, zyy = (
        height(INSIDE.T, nu=order) / 50.0 ** sum(order)
        for order in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    )
    np.testing.assert_allclose(die.point(u, v), np.stack([50 * u, 50 * v, z], axis=-1), atol=1e-13)
    metric = 1 + zx**2 + zy**2
    np.testing.assert_allclose(
        die.normal(u, v), np.stack([-zx, -zy, 1 + 0 * z], axis=-1) / np.sqrt(metric)[:, None], atol=1e-14
    )
    np.testing.assert_allclose(
        die.gaussian_curvature(u, v), (zxx * zyy - zxy**2) / metric**2, rtol=1e-9, atol=1e-16
    )
    mean = ((1 + zy**2) * zxx - 2 * zx * zy * zxy + (1 + zx**2) * zyy) / (2 * metric**1.5)
    np.testing.assert_allclose(die.mean_curvature(u, v), mean, rtol=1e-11)


def test_the_nominal_die_has_the_stated_numbers():
    die = nominal_surface()
    np.testing.assert_allclose(die.point(0.5, 0.5), [25, 25, 5.856271], atol=5e-7)
    assert die.area == pytest.approx(2604.0760, abs=5e-5)
    assert die.control_points.shape == (6, 6, 3) and die.degree == (3, 3) and die.outward == 1


@pytest.mark.parametrize("shape", uneven_surfaces().values(), ids=uneven_surfaces())
@pytest.mark.parametrize("outward", [1, -1])
def test_formulas(shape, outward):
    shape, (u, v) = shape.replace(outward=outward), INSIDE
    (E, F, G), (e, f, g) = shape.first_form(u, v), shape.second_form(u, v)
    d, n = shape.derivatives(u, v), shape.normal(u, v)
    np.testing.assert_allclose(np.linalg.norm(n, axis=-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose((n * d.u).sum(-1) / np.sqrt(E), 0.0, atol=1e-14)
    np.testing.assert_allclose((n * d.v).sum(-1) / np.sqrt(G), 0.0, atol=1e-14)
    assert (np.sign((np.cross(d.u, d.v) * n).sum(-1)) == outward).all()
    density = E * G - F**2
    np.testing.assert_allclose(shape.area_density(u, v), np.sqrt(density), rtol=1e-11)
    K, H = (e * g - f**2) / density, (e * G - 2 * f * F + g * E) / (2 * density)
    np.testing.assert_allclose(shape.gaussian_curvature(u, v), K, rtol=1e-9, atol=1e-9 * np.abs(K).max())
    np.testing.assert_allclose(shape.mean_curvature(u, v), H, rtol=1e-9, atol=1e-9 * np.abs(H).max())
    k1, k2 = shape.principal_curvatures(u, v)
    root = np.sqrt(np.maximum(H**2 - K, 0.0))
    np.testing.assert_allclose([k1, k2], [H + root, H - root], rtol=0, atol=1e-7 * np.abs(H).max())
    assert (k1 >= k2).all()


@given(SEEDS)
@whole
def test_euler_and_the_second_form_by_differences(seed):
    """k_n is between k1 and k2, each reached once; e, f, g are the normal's part of second derivatives."""
    surface = some_surface(seed)
    (u,), (v,) = (x[4:5] for x in places(surface, seed, 1))
    turn = np.linspace(0.0, np.pi, 721)
    found = surface.normal_curvature(u, v, np.cos(turn), np.sin(turn))
    k1, k2 = surface.principal_curvatures(u, v)
    span = max(abs(k1), abs(k2), 1e-6)
    assert found.max() <= k1 + 1e-9 * span and found.min() >= k2 - 1e-9 * span
    assert 0.5 * (found.max() + found.min()) == pytest.approx(surface.mean_curvature(u, v), abs=0.01 * span)


def test_the_normal_curvature_is_that_of_the_section():
    """The bend of the surface off its tangent plane: 2 (Q(h) - Q).n/|dQ|^2, by central differences."""
    die, h = nominal_surface(), 1e-3
    u, v = np.random.default_rng(5).uniform(0.4, 0.6, (2, 40))
    du, dv = np.random.default_rng(6).normal(size=(2, 40))
    before, here, behind = (die.point(u + k * h * du, v + k * h * dv) for k in (-1, 0, 1))
    bend = ((before - 2 * here + behind) * die.normal(u, v)).sum(-1) / ((behind - before) ** 2).sum(-1) * 4
    np.testing.assert_allclose(die.normal_curvature(u, v, du, dv), bend, atol=2e-6)
    assert bend.min() < -0.01  # a ridge bends away from the tool


def test_gauss_bonnet():
    """Int K dA + int k_g ds + turns at the corners = 2 pi: within a span of the saddle, the die, and a
    rational one.
    """
    for shape in (SADDLE, nominal_surface(), torus(40.0, 15.0)):
        a, b = (0.35, 0.64), (0.36, 0.65)
        u, weight_u = gauss(np.array(a), 24)
        v, weight_v = gauss(np.array(b), 24)
        curved = (
            weight_u
            @ (shape.gaussian_curvature(u[:, None], v) * shape.area_density(u[:, None], v))
            @ weight_v
        )
        corners = np.array([(a[0], b[0]), (a[1], b[0]), (a[1], b[1]), (a[0], b[1])])
        edges = [turned(shape, corners[k], corners[(k + 1) % 4]) for k in range(4)]
        angles = [np.arccos(edges[k][2] @ edges[(k + 1) % 4][1]) for k in range(4)]
        assert curved + sum(edge[0] for edge in edges) + sum(angles) == pytest.approx(2 * np.pi, abs=1e-12)
        assert abs(curved) > 1e-3


def turned(shape, start, end):
    """Integral of the geodesic curvature along a straight edge of the patch; its unit tangents at both ends."""
    s, weight = gauss(np.array([0.0, 1.0]), 24)
    (u, v), (du, dv) = (start + np.append(s, [0.0, 1.0])[:, None] * (end - start)).T, end - start
    d, n = shape.derivatives(u, v), shape.normal(u, v)
    speed = d.u * du + d.v * dv
    bend = d.uu * du**2 + 2 * d.uv * du * dv + d.vv * dv**2
    geodesic = (np.cross(speed, bend) * n).sum(-1) / (speed**2).sum(-1)  # k_g ds/d parameter
    tangents = speed / np.linalg.norm(speed, axis=1)[:, None]
    return weight @ geodesic[:-2], tangents[-2], tangents[-1]


@given(SEEDS)
@whole
def test_a_motion_changes_no_curvature(seed):
    surface = some_surface(seed)
    rng = np.random.default_rng(seed)
    matrix = Rotation.random(rng=rng).as_matrix()
    other = surface.replace(control_points=surface.control_points @ matrix.T + rng.uniform(-50, 50, 3))
    u, v = places(surface, seed, 10)
    np.testing.assert_allclose(other.normal(u, v), surface.normal(u, v) @ matrix.T, atol=1e-9)
    for one, two in zip(curvatures(surface, u, v), curvatures(other, u, v), strict=True):
        np.testing.assert_allclose(two, one, rtol=0, atol=1e-8 * np.abs(one).max() + 1e-12)
    assert other.area == pytest.approx(surface.area, rel=1e-9)


@given(SEEDS, st.floats(0.01, 100.0))
@whole
def test_other_parameters_change_no_curvature(seed, factor):
    surface = some_surface(seed)
    other = surface.replace(knots=(factor * surface.knots[0], surface.knots[1]))
    u, v = places(surface, seed, 10)
    u = np.append(u[:4], u[4:][np.abs(u[4:, None] - surface.knots[0]).min(axis=1) > 1e-3])
    v = v[: len(u)]
    for one, two in zip(curvatures(surface, u, v), curvatures(other, factor * u, v), strict=True):
        np.testing.assert_allclose(two, one, rtol=0, atol=1e-8 * np.abs(one).max() + 1e-12)
    assert other.area == pytest.approx(surface.area, rel=1e-9)


@given(SEEDS)
@whole
def test_u_and_v_exchanged_turn_the_normal(seed):
    surface = some_surface(seed)
    weights = None if surface.weights is None else surface.weights.T
    other = Surface(
        surface.control_points.swapaxes(0, 1),
        surface.degree[::-1],
        surface.knots[::-1],
        weights,
        -surface.outward,
    )
    u, v = places(surface, seed, 10)
    np.testing.assert_allclose(other.normal(v, u), surface.normal(u, v), atol=1e-10)
    for one, two in zip(curvatures(surface, u, v), curvatures(other, v, u), strict=True):
        np.testing.assert_allclose(two, one, rtol=0, atol=1e-9 * np.abs(one).max() + 1e-13)


def curvatures(surface, u, v):
    return surface.gaussian_curvature(u, v), surface.mean_curvature(u, v), *surface.principal_curvatures(u, v)


@pytest.mark.parametrize("name", uneven_surfaces())
def test_the_area_is_found_to_what_it_says(name):
    surface = uneven_surfaces()[name]
    (u, weight_u), (v, weight_v) = (gauss(each, 150) for each in surface.breaks)
    d = surface.grid(u, v)
    E, F, G = ((a * b).sum(-1) for a, b in ((d.u, d.u), (d.u, d.v), (d.v, d.v)))
    fine = weight_u @ np.sqrt(E * G - F**2) @ weight_v
    assert abs(surface.area - fine) <= surface.area_error + 1e-12 * fine
    assert surface.area_error <= 1e-9


def test_the_area_of_facets():
    """Triangles between points on a grid of 1/400: their area is short by O(1/400^2)."""
    die, at = nominal_surface(), np.linspace(0, 1, 401)
    p = die.grid(at, at).point
    first = np.cross(p[1:, :-1] - p[:-1, :-1], p[:-1, 1:] - p[:-1, :-1])
    second = np.cross(p[:-1, 1:] - p[1:, 1:], p[1:, :-1] - p[1:, 1:])
    facets = 0.5 * (np.linalg.norm(first, axis=-1).sum() + np.linalg.norm(second, axis=-1).sum())
    assert 0 < die.area - facets < 5e-3


def test_breaks_are_the_knots_of_the_domain():
    """Knots outside of the domain of an unclamped surface are none; a repeated one counts once."""
    net = np.stack([*np.meshgrid(np.arange(5.0), np.arange(3.0), indexing="ij"), np.zeros((5, 3))], axis=-1)
    surface = Surface.bspline(
        net, (2, 1), ([-1.0, -0.5, 0.0, 0.4, 0.4, 1.0, 1.5, 2.0], [0.0, 0.0, 1.0, 2.0, 2.0])
    )
    assert [each.tolist() for each in surface.breaks] == [[0.0, 0.4, 1.0], [0.0, 1.0, 2.0]]


def test_gauss_takes_each_span_for_itself():
    """Exact for a polynomial of degree 5 in each span, with 3 points."""
    x, weight = gauss(np.array([0.0, 0.3, 0.9, 2.0]), 3)
    assert len(x) == 9
    broken = np.where(x < 0.3, x**5, np.where(x < 0.9, 7.0, x**4 - 2.0))
    exact = 0.3**6 / 6 + 7 * 0.6 + (2**5 - 0.9**5) / 5 - 2 * 1.1
    assert weight @ broken == pytest.approx(exact, rel=1e-14)
