"""Distance from a border: closed forms, its order, geodesics traced by another way, and passes at equal
distances.
"""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from finishing_inside import Square, distance_field, solved, sweep
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar
from scipy.spatial import cKDTree

from sdpgrind.finishing import Surface, zigzag
from sdpgrind.finishing.surface import (
    cylinder_surface,
    flat_surface,
    nominal_surface,
    sphere_surface,
    uneven_surfaces,
)

RADIUS = 50.0


@cache
def sphere(nodes):
    """Error on a sphere from a meridian, where the foot of the perpendicular lies on it: d = R asin(cos lat
    sin lon).
    """
    lat, lon = np.meshgrid(np.linspace(-0.5, 0.5, nodes), np.linspace(0, 1, nodes), indexing="ij")
    h = 1 / (nodes - 1)
    d = solved((h * RADIUS) ** 2 + 0 * lat, 0 * lat, (h * RADIUS * np.cos(lat)) ** 2)
    near = np.abs(np.arctan2(np.tan(lat), np.cos(lon))) <= 0.45
    return np.abs(d - RADIUS * np.arcsin(np.cos(lat) * np.sin(lon)))[near]


@cache
def skewed(nodes):
    """Error on a flat with a skewed, bent grid from the x axis, where the foot lies on the border: d = y; and
    beside it.
    """
    u, v = np.meshgrid(*2 * [np.linspace(0, 1, nodes)], indexing="ij")
    h = 1 / (nodes - 1)
    x, y = 50 * u + 20 * v + 4 * np.sin(3 * u) * v, 50 * v + 8 * v * np.sin(2 * u)
    xu, xv, yu, yv = (
        50 + 12 * np.cos(3 * u) * v,
        20 + 4 * np.sin(3 * u),
        16 * v * np.cos(2 * u),
        50 + 8 * np.sin(2 * u),
    )
    d = solved(h**2 * (xu**2 + yu**2), h**2 * (xu * xv + yu * yv), h**2 * (xv**2 + yv**2))
    error = np.abs(d - np.hypot(np.maximum(x - 50, 0), y))
    return error[x <= 48], error[x > 50]


@cache
def sheared(nodes):
    """Error on a flat with a grid so skewed that its triangles are obtuse everywhere, away from the sides."""
    metric, x, y = sheared_grid(nodes)
    foot = (x > x[:, 0].min() + 1) & (x < x[:, 0].max() - 1)
    return np.abs(solved(*metric) - y)[foot]


def sheared_grid(nodes):
    """Metric of a grid whose triangles are obtuse everywhere, and its nodes."""
    u, v = np.meshgrid(*2 * [np.linspace(0, 1, nodes)], indexing="ij")
    h, wave = 1 / (nodes - 1), 4 * u + 3 * v
    x, y = 20 * u + 60 * v + 2 * np.sin(wave), 50 * v + 4 * v * np.sin(2 * u)
    xu, xv = 20 + 8 * np.cos(wave), 60 + 6 * np.cos(wave)
    yu, yv = 8 * v * np.cos(2 * u), 50 + 4 * np.sin(2 * u)
    E, F, G = (h**2 * each for each in (xu**2 + yu**2, xu * xv + yu * yv, xv**2 + yv**2))
    assert (F > E).all()
    return (E, F, G), x, y


def swept(metric, most):
    """Rounds of sweeps, and distances of first order."""
    d = np.full(metric[0].shape, np.inf)
    d[:, 0] = 0.0
    return sweep(*metric, d, most), d


def test_sweeps_converge_on_a_sheared_grid():
    """By rows alone 60 rounds left distances 0.17 mm too long; with a sweep more nothing changes, then."""
    metric, _, _ = sheared_grid(257)
    rounds, d = swept(metric, 60)
    assert rounds <= 60
    further = d.copy()
    sweep(*metric, further, 1)
    assert (d - further).max() < 1e-8


def test_distances_that_do_not_converge_are_refused():
    """The metric of a flat that is folded: its lines are parallel where it turns back."""
    u, v = np.meshgrid(*2 * [np.linspace(0, 1, 25)], indexing="ij")
    across, along = np.cos(2.4 * u + 1.3 * v), np.cos(4.1 * (u + v))
    xu, xv, yu, yv = 33 + 4.5 * across, 143 + 2.4 * across, -7.2 - 2.9 * along, -25 - 2.9 * along
    assert np.ptp(np.sign(xu * yv - xv * yu)) == 2
    metric = [each / 24**2 for each in (xu**2 + yu**2, xu * xv + yu * yv, xv**2 + yv**2)]
    assert swept(metric, 5)[0] == 6
    with pytest.raises(
        ValueError,
        match=r"^mapping must be another one than 'geodesic' on a grid whose lines are nearly parallel, or on a"
        r" strip with ends askew: distances still fall after 200 rounds; got lines that meet at \d\S* rad, with"
        r" steps of 1 : \d\S*$",
    ):
        solved(*metric)


def test_a_strip_with_ends_askew_is_refused_as_that(monkeypatch):
    """58 mm long, 1 mm wide; its lines meet at 1.03 rad, which is not nearly parallel."""
    monkeypatch.setattr("sdpgrind.finishing.path._geodesic.ROUNDS", 5)
    metric = [np.full((65, 65), each / 64**2) for each in (1.0, 30.0, 30.0**2 + 50.0**2)]
    with pytest.raises(
        ValueError, match=r"a strip with ends askew: .* meet at 1 rad, with steps of 1 : 58\.3$"
    ):
        solved(*metric)


def test_second_order_on_a_sheared_grid():
    """Through obtuse triangles distances were 1 mm too long in the mean, and no finer grid helped."""
    means = [sheared(nodes).mean() for nodes in (65, 129, 257)]
    assert means[0] / means[1] > 3 and means[1] / means[2] > 3
    assert means[2] < 5e-4 and sheared(257).max() < 2e-3


def test_second_order_from_a_smooth_border():
    """Mean errors fall by 4 and more when the grid is twice as fine; 0.0002 mm in the mean over 50 mm."""
    for error in (sphere, lambda nodes: skewed(nodes)[0]):
        means = [error(nodes).mean() for nodes in (65, 129, 257)]
        assert means[0] / means[1] > 3.5 and means[1] / means[2] > 3.4
        assert means[2] < 2e-4 and error(257).max() < 5e-4


def test_first_order_round_a_corner():
    """Where fronts go round the end of the border nothing is better than first order, and small."""
    worst = [skewed(nodes)[1].max() for nodes in (65, 129, 257)]
    assert worst[0] / worst[1] == pytest.approx(2, rel=0.1) and worst[1] / worst[2] == pytest.approx(
        2, rel=0.1
    )
    assert worst[2] < 0.02


def test_flat_and_cylinder_are_exact():
    for surface, along in ((flat_surface(50.0), "u"), (flat_surface(50.0), "v")):
        field = distance_field(Square(surface, "parametric", along), 65)
        np.testing.assert_allclose(field.distance, np.broadcast_to(50 * field.c, (65, 65)), atol=1e-10)
    surface = cylinder_surface(30.0, 50.0)
    round_way = "u" if surface.degree == (1, 2) else "v"
    field = distance_field(Square(surface, "parametric", round_way))
    point = surface.grid([0.5], field.c) if round_way == "u" else surface.grid(field.c, [0.5])
    normal = np.cross(point.u, point.v).reshape(-1, 3)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    angle = np.arccos(np.clip(normal @ normal[0], -1, 1))
    np.testing.assert_allclose(field.distance, np.broadcast_to(30 * angle, field.distance.shape), atol=1e-3)


def test_sweeps_are_their_slow_twin():
    """Each node by the least way through the edge of a triangle around it, found by a minimiser, until
    nothing changes.
    """
    rng = np.random.default_rng(3)
    n = 7
    E, G = rng.uniform(1, 2, (2, n, n))
    F = 0.3 * rng.uniform(-1, 1, (n, n))
    d = np.full((n, n), np.inf)
    d[:, 0] = 0
    twin = d.copy()
    sweep(E, F, G, d, 50)
    ring = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]

    def way(share, i, j, a, b):
        x, y = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
        length = np.sqrt(E[i, j] * x * x + 2 * F[i, j] * x * y + G[i, j] * y * y)
        return length + (1 - share) * twin[i + a[0], j + a[1]] + share * twin[i + b[0], j + b[1]]

    for _ in range(12):
        for i, j in np.ndindex(n, n):
            for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
                inside = all(0 <= i + p < n and 0 <= j + q < n for p, q in (a, b))
                if inside and np.isfinite([twin[i + a[0], j + a[1]], twin[i + b[0], j + b[1]]]).all():
                    place = i, j, a, b
                    found = minimize_scalar(
                        way, bounds=(0, 1), args=place, method="bounded", options={"xatol": 1e-9}
                    ).fun
                    twin[i, j] = min(twin[i, j], found, way(0.0, *place), way(1.0, *place))
    np.testing.assert_allclose(d, twin, atol=1e-7)


def traced(surface, u, length):
    """Where a geodesic comes to that leaves the border v = 0 at a right angle: u'' = -Gamma(u', u')."""

    def slope(_, state):
        d = surface.derivatives(state[0], state[1])
        bend = d.uu * state[2] ** 2 + 2 * d.uv * state[2] * state[3] + d.vv * state[3] ** 2
        metric = np.array([[d.u @ d.u, d.u @ d.v], [d.u @ d.v, d.v @ d.v]])
        return [*state[2:], *np.linalg.solve(metric, [-bend @ d.u, -bend @ d.v])]

    d = surface.derivatives(u, 0.0)
    across = np.array([-(d.u @ d.v) / (d.u @ d.u), 1.0])
    across /= np.linalg.norm(across[0] * d.u + across[1] * d.v)
    return solve_ivp(slope, (0, length), [u, 0.0, *across], rtol=1e-9, atol=1e-10).y[:2, -1]


@pytest.mark.parametrize(
    ("name", "u", "length", "within"),
    [
        ("nominal", 0.2, 20.0, 2e-3),
        ("nominal", 0.5, 45.0, 2e-3),
        ("nominal", 0.7, 35.0, 2e-3),
        ("steep", 0.7, 10.0, 0.03),
        ("steep", 0.7, 16.0, 0.03),
    ],
)
def test_traced_geodesics(name, u, length, within):
    """On the wall of the steep surface the grid is skewed: distances are 0.02 mm off there; they were 0.2 mm."""
    surface = nominal_surface() if name == "nominal" else uneven_surfaces()[name]
    field = distance_field(Square(surface, "parametric", "u"))
    at = traced(surface, u, length)
    i = at * (len(field.s) - 1)
    k = i.astype(int)
    a, b = i - k
    corner = field.distance[k[0] : k[0] + 2, k[1] : k[1] + 2]
    assert np.array([1 - a, a]) @ corner @ np.array([1 - b, b]) == pytest.approx(length, abs=within)


def test_gaps_are_equal_along_the_passes():
    """Straight distances from each pass to the next are the same all along, a curved surface's sagitta less."""
    path = zigzag(nominal_surface(), 2.0, mapping="geodesic", along="v")
    line = path.sample(0.05)
    runs = [line.point[line.run == k] for k in range(len(path.runs))]
    passes = [run for run in runs if np.ptp(run[:, 1]) > 40][:-2]
    assert len(passes) > 20
    gaps = [cKDTree(other).query(one[40:-40])[0] for one, other in pairwise(passes)]
    assert max(map(np.ptp, gaps)) < 0.02 and np.ptp(np.concatenate(gaps)) < 0.03
    assert np.concatenate(gaps).max() <= 2.0
    straight = zigzag(nominal_surface(), 2.0, along="v")
    assert (
        path.metrics(1.0, surface_step=0.3).coverage > 0.99 and straight.pattern == path.pattern == "zigzag"
    )


def test_much_is_saved_on_an_uneven_surface():
    """A grid that is bent on a steep surface: lines of it are as close in places as they are wide in others."""
    surface = uneven_surfaces()["steep"]
    lines, curves = (
        zigzag(surface, 2.0, mapping=mapping, along="v") for mapping in ("equal_spacing", "geodesic")
    )
    assert curves.length < 0.87 * lines.length
    assert curves.metrics(1.0, surface_step=0.3).coverage > 0.99


@pytest.mark.parametrize("pitch", [1.0, 2.0])
def test_passes_end_on_the_other_border_where_it_is_near(pitch):
    """The border of a fan: all is covered, and the last pass follows the border."""
    net = [[[x, y * (30 + 20 * x / 50), 0.0] for y in (0.0, 1.0)] for x in (0.0, 50.0)]
    surface = Surface.bspline(net, degree=(1, 1))
    path = zigzag(surface, pitch, mapping="geodesic")
    found = path.metrics(0.55 * pitch, surface_step=0.25)
    assert found.coverage > 0.985 and found.largest_gap < 1.9 * pitch
    ends = path.nodes[-20:]
    assert np.ptp(ends[:, 1]) < 1e-9 and np.ptp(ends[:, 0]) > 0.2
    assert len(path.runs) > 2 * 30 / pitch


def test_kinks_are_sharp_corners():
    """From a parabola y = 0.04 x^2 fronts meet above its focal length 12.5; some way before it they are but
    round.
    """
    net = [
        [[x, low + 45 * y, 0.0] for y in (0.0, 1.0)] for x, low in ((-25.0, 25.0), (0.0, -25.0), (25.0, 25.0))
    ]
    surface = Surface.bspline(net, degree=(2, 1))
    field = distance_field(Square(surface, "parametric", "u"))
    border = surface.grid(np.linspace(0, 1, 20001), [0.0]).point[:, 0]
    middle = surface.grid([0.5], field.c).point[0]
    exact = cKDTree(border).query(middle)[0]
    # then it is round the ends
    np.testing.assert_allclose(field.distance[len(field.s) // 2][exact < 26], exact[exact < 26], atol=0.02)
    path = zigzag(surface, 2.0, mapping="geodesic")
    corner = path.points[path.runs[1:, 0]]
    kinks = np.sort(corner[np.abs(corner[:, 0]) < 2.0, 1])
    assert len(kinks) > 5 and kinks.min() > 12.5 - 2 / 0.3  # where a leg of 2 mm turns by 0.3 rad


def test_refused_where_passes_turn_back():
    """Behind a bump that is longer to climb than to go round, distances fall again."""
    g = np.linspace(0, 1, 9)
    x, y = np.meshgrid(50 * g, 50 * g, indexing="ij")
    bump = Surface.bspline(
        np.stack([x, y, 80 * np.exp(-(((x - 25) / 6) ** 2) - ((y - 25) / 6) ** 2)], axis=-1)
    )
    message = (
        r"^mapping must be another one than 'geodesic', or along the other side: the distance from the border falls at "
        r"\(a, b\) = \(0\.\d{3}, 0\.\d{3}\) of the square, where a pass of equal distance would turn back; got along='u'$"
    )
    with pytest.raises(ValueError, match=message):
        zigzag(bump, 2.0, mapping="geodesic")


def test_refused_on_creases():
    crease = Surface.bspline(
        [[[x, y, abs(x - 25)] for y in (0.0, 50.0)] for x in (0.0, 25.0, 50.0)], degree=(1, 1)
    )
    message = (
        r"^mapping must be another one than 'geodesic' on a surface whose tangents jump: its knot u = 0.5 is there 1 times "
        r"at degree 1$"
    )
    with pytest.raises(ValueError, match=message):
        zigzag(crease, 2.0, mapping="geodesic")


def test_refused_at_a_pole():
    with pytest.raises(
        ValueError,
        match=r"^mapping must be another one for a zigzag on a surface with a pole, where lines would",
    ):
        zigzag(sphere_surface(40.0), 2.0, mapping="equal_area")


def test_pieces_shorter_than_the_field_can_tell():
    """At 0.3 mm a level comes to the far border between two columns of the field."""
    path = zigzag(uneven_surfaces()["steep"], 0.3, mapping="geodesic", along="u")
    assert np.isfinite(path.nodes).all() and path.nodes.shape[0] > 30000
