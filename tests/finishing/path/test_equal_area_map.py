"""Equal areas: cells by triangles, shares by quadrature, closed forms on cylinder and sphere, derivatives by
differences.
"""

import numpy as np
import pytest
from finishing_inside import equal_area, mapping_of
from hypothesis import given, settings
from hypothesis import strategies as st

from sdpgrind.finishing import Surface, hilbert
from sdpgrind.finishing.surface import (
    cylinder_surface,
    flat_surface,
    nominal_surface,
    sphere_surface,
    uneven_surfaces,
)

UNEVEN = uneven_surfaces()
SURFACES = {"nominal": nominal_surface(), **UNEVEN}
MEETS = 1e-6
"""Relative error of the density that the map is exact for."""


def jets(a, b):
    a, b = np.broadcast_arrays(a, b)
    found = np.zeros((a.size, 3, 2))
    found[:, 0, 0], found[:, 0, 1] = a.ravel(), b.ravel()
    return found


def uv(surface, a, b):
    return equal_area(surface).carried(jets(a, b))[:, 0]


def triangle_areas(surface, cells, parts):
    """Area of each cell by flat triangles between points of the map, with no use of the density."""
    at = np.linspace(0.0, 1.0, cells * parts + 1)
    a, b = np.meshgrid(at, at, indexing="ij")
    places = uv(surface, a, b)
    q = surface.point(places[:, 0], places[:, 1]).reshape(*a.shape, 3)
    one, other = q[1:, 1:] - q[:-1, :-1], q[1:, :-1] - q[:-1, 1:]
    area = 0.5 * np.linalg.norm(np.cross(one, other), axis=-1)
    return area.reshape(cells, parts, cells, parts).sum(axis=(1, 3))


@pytest.mark.parametrize("name", UNEVEN)
def test_cells_of_strongly_uneven_surfaces_have_one_area(name):
    surface = UNEVEN[name]
    at = np.linspace(0.0, 1.0, 101)
    density = surface.area_density(at[:, None], at)
    assert density.max() / density.min() >= 10
    coarse, fine = (triangle_areas(surface, 16, parts) for parts in (10, 20))
    areas = fine + (fine - coarse) / 3  # the triangles' error falls with the square of their size
    remains = np.abs(areas - fine).max() / areas.mean()
    assert areas.std() / areas.mean() <= 1e-5
    assert areas.sum() == pytest.approx(surface.area, rel=remains)
    assert triangle_areas_of_parameters(surface) > 0.2


def triangle_areas_of_parameters(surface):
    """Coefficient of variation of cells that are equal in the parameters: what the map is there for."""
    at = np.linspace(0.0, 1.0, 129)
    density = surface.area_density(at[:, None], at)[:-1, :-1].reshape(16, 8, 16, 8).mean(axis=(1, 3))
    return density.std() / density.mean()


def cumulative(surface, u, v):
    """Shares of area up to u, and along the line of u up to v, by Gauss points in each knot span."""
    x, weight = np.polynomial.legendre.leggauss(24)

    def points(axis, end):
        low, knots = surface.domain[axis][0], surface.knots[axis]
        ends = np.unique(np.concatenate([np.clip(knots, low, end), np.linspace(low, end, 9)]))
        half = 0.5 * np.diff(ends)[:, None]
        return (ends[:-1, None] + half * (1 + x)).ravel(), (half * weight).ravel()

    (u1, v1) = surface.domain[0][1], surface.domain[1][1]
    (us, wu), (vs, wv) = points(0, u), points(1, v1)
    a = wu @ surface.area_density(us[:, None], vs) @ wv / surface.area
    (part, wp), whole = points(1, v), wv @ surface.area_density(u, vs)
    assert u <= u1
    return a, wp @ surface.area_density(u, part) / whole


@pytest.mark.parametrize("name", SURFACES)
@settings(max_examples=5, deadline=None)
@given(a=st.floats(0.01, 0.99), b=st.floats(0.01, 0.99))
def test_parameters_lie_where_the_shares_of_area_are(name, a, b):
    u, v = uv(SURFACES[name], a, b)[0]
    assert cumulative(SURFACES[name], u, v) == pytest.approx((a, b), abs=2 * MEETS)


def test_around_a_cylinder_the_share_is_the_angle():
    b = np.linspace(0.0, 1.0, 33)
    surface = cylinder_surface(20.0, 50.0)
    place = surface.point(*uv(surface, 0.3, b).T)
    np.testing.assert_allclose(np.arctan2(place[:, 2], place[:, 0]), b * np.pi / 2, atol=MEETS)
    np.testing.assert_allclose(place[:, 1], 15.0, atol=1e-5)


def test_on_a_sphere_the_shares_are_longitude_and_height():
    a, b = np.meshgrid(np.linspace(0.05, 0.95, 13), np.linspace(0.0, 0.99, 13))
    surface = sphere_surface(20.0)
    x, y, z = surface.point(*uv(surface, a, b).T).T
    np.testing.assert_allclose(np.arctan2(y, x), a.ravel() * np.pi / 2, atol=2 * MEETS)
    np.testing.assert_allclose(z / 20.0, b.ravel(), atol=2 * MEETS)  # Archimedes


def test_a_flat_square_is_mapped_onto_itself():
    rng = np.random.default_rng(0)
    curve = rng.uniform(0.1, 0.9, (50, 3, 2))
    surface = flat_surface(30.0)
    np.testing.assert_allclose(
        equal_area(surface).carried(curve), mapping_of("parametric", surface).carried(curve), atol=1e-12
    )


@pytest.mark.parametrize("name", SURFACES)
def test_edges_stay_edges(name):
    at = np.linspace(0.0, 1.0, 9)
    for side in (0.0, 1.0):
        np.testing.assert_allclose(uv(SURFACES[name], side, at)[:, 0], side, atol=1e-12)
        np.testing.assert_allclose(uv(SURFACES[name], at, side)[:, 1], side, atol=1e-12)


@pytest.mark.parametrize("name", SURFACES)
def test_derivatives_are_those_of_the_map(name):
    """A curve (a, b)(t) through the map, against central differences of its places and of its first
    derivatives.
    """
    surface = SURFACES[name]
    rng = np.random.default_rng(3)
    start, speed, bend = (
        rng.uniform(0.25, 0.75, (40, 2)),
        rng.normal(0, 1.0, (40, 2)),
        rng.normal(0, 1.0, (40, 2)),
    )

    def curve(t):
        moving = np.stack([start + speed * t + 0.5 * bend * t**2, speed + bend * t, bend], axis=1)
        return equal_area(surface).carried(moving)

    h = 1e-6
    here, before, after = curve(0.0), curve(-h), curve(h)
    for order in (1, 2):
        by_difference = (after[:, order - 1] - before[:, order - 1]) / (2 * h)
        scale = np.abs(here[:, order]).max()
        # a mesh cell that is passed bends the difference
        close = np.abs(by_difference - here[:, order]) <= 2e-3 * scale
        assert close.mean() > 0.9
        assert np.median(np.abs(by_difference - here[:, order])) <= 1e-6 * scale


@pytest.mark.parametrize("name", SURFACES)
def test_second_derivatives_do_not_jump_at_knots(name):
    surface = SURFACES[name]
    b = np.linspace(0.1, 0.9, 7)
    for knot in np.unique(surface.knots[0])[1:-1]:
        a, _ = cumulative(surface, knot, 0.5)
        sides = []
        for shift in (-1e-8, 1e-8):
            curve = jets(a + shift, b)
            curve[:, 1] = 1.0
            sides.append(equal_area(surface).carried(curve))
        jump = np.abs(sides[1] - sides[0]).max(axis=(0, 2)) / np.abs(sides[0]).max(axis=(0, 2))
        assert np.all(jump < 1e-3), knot


def test_a_kinked_surface_keeps_its_kinks():
    """Two flat halves, one stretched: the density jumps at the fold, and shares of area are linear on either
    side.
    """
    net = [[[x, y, 0.0] for y in (0.0, 10.0)] for x in (0.0, 10.0, 40.0)]
    surface = Surface.bspline(net, degree=(1, 1))
    a = np.array([0.1, 0.25, 0.3, 0.9])
    np.testing.assert_allclose(surface.point(*uv(surface, a, 0.4).T)[:, 0], 40.0 * a, atol=1e-9)


def test_the_error_that_it_tells_bounds_that_of_cells():
    assert all(equal_area(surface).error <= 1e-5 for surface in SURFACES.values())
    assert equal_area(flat_surface(3.0)).error <= 1e-14


def test_node_steps_are_more_even_and_hardly_longer():
    plain, even = (
        hilbert(UNEVEN["weighted"], 5, mapping=mapping) for mapping in ("parametric", "equal_area")
    )
    steps = [np.diff(path.sample(per_leg=1).length) for path in (plain, even)]
    variation = [step[step > 0].std() / step[step > 0].mean() for step in steps]
    assert variation[1] < variation[0]
    assert even.length < 1.1 * plain.length


def test_maps_of_equal_surfaces_are_made_once():
    assert equal_area(nominal_surface()) is equal_area(nominal_surface())
