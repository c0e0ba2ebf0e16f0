"""Points and derivatives: against scipy, the recursion written down, and differences; and what no change may
change.
"""

import numpy as np
import pytest
from cox_de_boor import ORDERS, derivatives, places, row, some_knots, some_surface
from finishing_inside import _find_span, bases
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import NdBSpline

from sdpgrind.base.compiling.compiled import opened
from sdpgrind.finishing import Surface
from sdpgrind.finishing.surface import nominal_surface, sphere_surface, uneven_surfaces

find_span = opened(_find_span)

SEEDS = st.integers(0, 2**32 - 1)
SURFACES = {"nominal": nominal_surface(), "ball": sphere_surface(20.0), **uneven_surfaces()}
whole = settings(max_examples=25, deadline=None)


def scale(surface, order):
    """What a derivative of this order may be as large as: net over knot spans. Rounding is told relative to
    it.
    """
    steps = [
        np.diff(np.unique(np.clip(k, *ends))).min()
        for k, ends in zip(surface.knots, surface.domain, strict=True)
    ]
    size = np.abs(surface.control_points).max() * (
        1.0 if surface.weights is None else np.ptp(surface.weights) + 10.0
    )
    return size * (surface.degree[0] / steps[0]) ** order[0] * (surface.degree[1] / steps[1]) ** order[1]


@pytest.mark.parametrize("name", SURFACES)
def test_points_alone_have_the_bits_of_points_with_derivatives(name):
    surface = SURFACES[name]
    u, v = (np.random.default_rng(k).uniform(*ends, 500) for k, ends in enumerate(surface.domain))
    u[:4], v[:4] = np.repeat(surface.domain[0], 2), np.tile(surface.domain[1], 2)
    assert np.array_equal(surface.point(u, v), surface.derivatives(u, v).point)


@pytest.mark.parametrize("name", ["nominal", "crowded", "steep"])
def test_scipy_gives_the_same_on_the_path_of_order_seven(name):
    surface = SURFACES[name]
    u, v = np.random.default_rng(1).random((2, 4**7))
    peer = NdBSpline(surface.knots, surface.control_points, surface.degree)
    found = surface.derivatives(u, v)
    for order, values in zip(ORDERS, found, strict=True):
        apart = np.abs(values - peer(np.stack([u, v], axis=-1), nu=order)).max()
        assert apart <= 1e-10 if sum(order) == 0 else apart <= 1e-14 * scale(surface, order)


@given(SEEDS)
@whole
def test_the_recursion_gives_the_same(seed):
    surface = some_surface(seed)
    u, v = places(surface, seed, 3)
    found = np.stack(surface.derivatives(u, v), axis=1)
    for k in range(len(u)):
        for order, one, other in zip(ORDERS, found[k], derivatives(surface, u[k], v[k]), strict=True):
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * scale(surface, order))


@given(SEEDS)
@whole
def test_a_grid_is_its_points(seed):
    surface = some_surface(seed)
    u, v = (np.sort(x) for x in places(surface, seed, 5))
    for order, one, other in zip(ORDERS, surface.grid(u, v), surface.derivatives(u[:, None], v), strict=True):
        assert one.shape == (len(u), len(v), 3)
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * scale(surface, order))


@given(SEEDS)
@whole
def test_a_rational_surface_obeys_the_product_rule(seed):
    """(w Q)_uv = w Q_uv + w_u Q_v + w_v Q_u + w_uv Q and its like, with w Q and w by scipy."""
    surface = some_surface(seed, degree=(3, 2), rational=True)
    (u0, u1), (v0, v1) = surface.domain
    u, v = np.random.default_rng(seed).uniform((u0, v0), (u1, v1), (20, 2)).T
    weights = surface.weights[..., None]
    net = np.concatenate([surface.control_points * weights, weights], axis=-1)
    peer = NdBSpline(surface.knots, net, surface.degree)
    A = {order: peer(np.stack([u, v], axis=-1), nu=order) for order in ORDERS}
    w = {order: A[order][:, 3:] for order in ORDERS}
    q, qu, qv, quu, quv, qvv = surface.derivatives(u, v)
    products = {
        (0, 0): w[0, 0] * q,
        (1, 0): w[0, 0] * qu + w[1, 0] * q,
        (0, 1): w[0, 0] * qv + w[0, 1] * q,
        (2, 0): w[0, 0] * quu + 2 * w[1, 0] * qu + w[2, 0] * q,
        (1, 1): w[0, 0] * quv + w[1, 0] * qv + w[0, 1] * qu + w[1, 1] * q,
        (0, 2): w[0, 0] * qvv + 2 * w[0, 1] * qv + w[0, 2] * q,
    }
    for order, product in products.items():
        np.testing.assert_allclose(product, A[order][:, :3], rtol=0, atol=1e-12 * scale(surface, order))


@pytest.mark.parametrize("name", SURFACES)
def test_differences(name):
    """Central differences with h = 1e-4: truncation by h^2/6 of the third derivative, rounding by eps/h."""
    surface, h = SURFACES[name], 1e-4
    u, v = np.random.default_rng(2).uniform(0.41, 0.49, (2, 30))  # within one span of each
    d = surface.derivatives(u, v)
    up, down, left, right = (surface.derivatives(u + a, v + b) for a, b in ((h, 0), (-h, 0), (0, -h), (0, h)))
    for differences, exact in (
        ((up.point - down.point) / (2 * h), d.u),
        ((right.point - left.point) / (2 * h), d.v),
        ((up.u - down.u) / (2 * h), d.uu),
        ((right.u - left.u) / (2 * h), d.uv),
        ((up.v - down.v) / (2 * h), d.uv),
        ((right.v - left.v) / (2 * h), d.vv),
    ):
        np.testing.assert_allclose(differences, exact, rtol=0, atol=2e-5 * max(50.0, np.abs(exact).max()))


def test_the_right_end_belongs_to_the_last_span():
    surface = nominal_surface()
    np.testing.assert_array_equal(surface.point(1.0, 1.0), surface.control_points[-1, -1])
    (ku, _), (p, _) = surface.knots, surface.degree
    assert find_span(ku, p, 1.0) == 5 and find_span(ku, p, 0.0) == 3
    assert find_span(ku, p, 1 / 3) == 4 and find_span(ku, p, np.nextafter(ku[4], 0)) == 3


def test_the_right_end_of_a_domain_with_an_empty_last_span():
    """scipy gives 0 there: its last span is the empty one."""
    knots = np.array([-0.3, -0.2, -0.1, 0.0, 0.5, 1.0, 1.0, 1.2, 1.3, 1.4])
    x, y = np.meshgrid(np.arange(6.0), np.arange(6.0), indexing="ij")
    surface = Surface.bspline(np.stack([x, y, x * y], axis=-1), knots=(knots, knots))
    assert surface.domain == ((0.0, 1.0), (0.0, 1.0))
    near = surface.derivatives(1.0 - 1e-9, 1.0 - 1e-9)
    for found in (surface.derivatives(1.0, 1.0), surface.grid([1.0], [1.0])):
        for one, other in zip(found, near, strict=True):
            np.testing.assert_allclose(np.ravel(one), other, atol=1e-6)


@given(SEEDS)
@whole
def test_spans_are_found(seed):
    rng = np.random.default_rng(seed)
    degree = int(rng.integers(1, 5))
    n = degree + 1 + int(rng.integers(0, 8))
    knots = some_knots(rng, n, degree)
    for x in [*knots[degree : n + 1], *rng.uniform(0, 1, 20)]:
        k = find_span(knots, degree, x)
        assert degree <= k < n and knots[k] < knots[k + 1]
        assert knots[k] <= x < knots[k + 1] or (x == knots[n] == knots[k + 1])


@given(SEEDS)
@whole
def test_a_partition_of_unity(seed):
    rng = np.random.default_rng(seed)
    degree = int(rng.integers(1, 5))
    n = degree + 1 + int(rng.integers(0, 5))
    knots = some_knots(rng, n, degree)
    x = np.append(rng.uniform(0, 1, 10), [0.0, 1.0])
    value, first, second = bases(knots, degree, x)
    assert value.min() >= -1e-15
    np.testing.assert_allclose(value.sum(axis=1), 1.0, rtol=1e-13)
    np.testing.assert_allclose(first.sum(axis=1), 0.0, atol=1e-12 * np.abs(first).max())
    np.testing.assert_allclose(second.sum(axis=1), 0.0, atol=1e-12 * max(1.0, np.abs(second).max()))
    for k, order in ((3, 0), (4, 1), (5, 2)):
        np.testing.assert_allclose(
            (value, first, second)[order][k], row(knots, degree, x[k], order), atol=1e-12 * 10**order * 99
        )


@pytest.mark.parametrize("degree", [1, 2])
def test_derivatives_beyond_the_degree_are_zero(degree):
    net = np.random.default_rng(3).uniform(0, 50, (4, 5, 3))
    surface = Surface.bspline(net, degree=(degree, 1))
    d = surface.derivatives(0.37, [0.2, 0.9])
    assert not d.vv.any() and (degree == 1) == (not d.uu.any())
    assert not surface.grid([0.37], [0.2, 0.9]).vv.any()


@given(SEEDS)
@whole
def test_an_affine_map_of_the_net_is_one_of_the_surface(seed):
    surface = some_surface(seed)
    rng = np.random.default_rng(seed)
    matrix, shift = rng.uniform(-1, 1, (3, 3)), rng.uniform(-50, 50, 3)
    other = surface.replace(control_points=surface.control_points @ matrix.T + shift)
    u, v = places(surface, seed, 10)
    one, two = surface.derivatives(u, v), other.derivatives(u, v)
    np.testing.assert_allclose(two.point, one.point @ matrix.T + shift, atol=1e-11)
    for order, a, b in list(zip(ORDERS, one, two, strict=True))[1:]:
        np.testing.assert_allclose(b, a @ matrix.T, rtol=0, atol=1e-11 * scale(surface, order))


@given(SEEDS, st.floats(0.01, 100.0), st.floats(-10.0, 10.0))
@whole
def test_other_parameters_scale_the_derivatives_alone(seed, factor, shift):
    surface = some_surface(seed)
    other = surface.replace(knots=(shift + factor * surface.knots[0], surface.knots[1]))
    u, v = places(surface, seed, 10)
    u = np.clip(u, 0.02, 0.98)  # a rounded knot may put an end, or a break, on its other side
    u = u[np.abs(u[:, None] - surface.knots[0]).min(axis=1) > 1e-3]
    v = v[: len(u)]
    one, two = surface.derivatives(u, v), other.derivatives(shift + factor * u, v)
    rounding = 1e-11 * (1.0 + abs(shift) / factor)
    for order, a, b in zip(ORDERS, one, two, strict=True):
        np.testing.assert_allclose(b * factor ** order[0], a, rtol=0, atol=rounding * scale(surface, order))


@given(SEEDS, st.floats(0.1, 10.0))
@whole
def test_weights_all_alike_weigh_nothing(seed, weight):
    plain = some_surface(seed, rational=False)
    rational = plain.replace(weights=np.full(plain.control_points.shape[:2], weight))
    u, v = places(plain, seed, 10)
    for order, a, b in zip(ORDERS, plain.derivatives(u, v), rational.derivatives(u, v), strict=True):
        np.testing.assert_allclose(b, a, rtol=0, atol=1e-12 * scale(plain, order))


@given(SEEDS)
@whole
def test_points_stay_in_the_box_of_the_net(seed):
    surface = some_surface(seed)
    points = surface.point(*places(surface, seed, 30))
    net = surface.control_points.reshape(-1, 3)
    assert (points >= net.min(axis=0) - 1e-10).all() and (points <= net.max(axis=0) + 1e-10).all()


def test_parameters_broadcast():
    surface = nominal_surface()
    assert surface.point(0.5, 0.5).shape == (3,)
    assert surface.point(np.zeros((4, 1)), np.zeros(5)).shape == (4, 5, 3)
    assert surface.normal([0.1, 0.2], 0.5).shape == (2, 3) and surface.mean_curvature(0.1, 0.2).shape == ()
    assert surface.point([], []).shape == (0, 3)
    np.testing.assert_array_equal(surface.point(0.2, [0.1, 0.7])[1], surface.point(0.2, 0.7))


def test_rounding_beyond_the_domain_is_put_back():
    surface = nominal_surface()
    np.testing.assert_array_equal(surface.point(1.0 + 2e-16, -1e-15), surface.point(1.0, 0.0))


def test_a_surface_keeps_its_own_arrays():
    net = np.array(nominal_surface().control_points)
    surface = Surface.bspline(net)
    before = surface.point(0.3, 0.4)
    net[:] = 0.0
    np.testing.assert_array_equal(surface.point(0.3, 0.4), before)
    with pytest.raises(ValueError, match="read-only"):
        surface.control_points[0, 0] = 0.0


def test_moved():
    surface = uneven_surfaces()["weighted"]
    other = surface.moved([1.0, -2.0, 3.0])
    np.testing.assert_allclose(other.point(0.3, 0.9) - surface.point(0.3, 0.9), [1.0, -2.0, 3.0], atol=1e-12)
    assert other.weights is not None and other.knots[0] is not None and other != surface
    assert other.area == pytest.approx(surface.area, rel=1e-12)


def test_equal_by_value():
    one, two = nominal_surface(), nominal_surface()
    assert one == two and hash(one) == hash(two) and one is not two
    assert one != one.replace(outward=-1) and one != uneven_surfaces()["weighted"] and one != "nominal"
