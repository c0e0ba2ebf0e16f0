"""What a path is worth: closed forms on a flat, brute force, areas by positions alone, the numbers of an
uneven surface.
"""

import numpy as np
import pytest
from finishing_inside import Nearest, cell_areas, edges_of, metrics
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from sdpgrind.finishing import Path, hilbert, zigzag
from sdpgrind.finishing.path import hilbert_nodes
from sdpgrind.finishing.surface import Patch, flat_surface, nominal_surface, uneven_surfaces

MISSED = (1 - np.pi / 4) / 4
"""Of a cell, where a node has no leg on either side of a quarter: a square less a quarter circle."""


def test_hilbert_and_zigzag_at_half_a_pitch():
    """0.955 and 0.985: a turn leaves one quarter of a cell, an end two."""
    fine = {"surface_step": 0.003}  # 54 corners alike: each off by some h^2 sqrt(0.8/h/12), 2e-5 in all
    curve = hilbert(flat_surface(8.0), 3, mapping="parametric").metrics(0.5, **fine)
    assert curve.coverage == pytest.approx(1 - MISSED * (50 + 4) / 64, abs=2e-4)
    passes = zigzag(flat_surface(8.0), 1.0).metrics(0.5, **fine)
    assert passes.coverage == pytest.approx(1 - MISSED * (14 + 4) / 64, abs=2e-4)
    assert (round(curve.coverage, 3), round(passes.coverage, 3)) == (0.955, 0.985)
    for found in (curve, passes):
        assert found.largest_gap == pytest.approx(np.sqrt(2), abs=1e-6)
        assert (
            found.length == pytest.approx(63)
            and found.step_mean == pytest.approx(1)
            and found.step_cv < 1e-12
        )
        assert found.cell_area_cv < 1e-12


def test_vertices_that_no_leg_touches():
    """47 of the 961 inside order 5 are further than 0.707 pitches less nothing, and are reached from there
    on.
    """
    nodes = hilbert_nodes(5)
    legs = {
        tuple(sorted(map(tuple, pair))) for pair in zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True)
    }
    around = ((0, 0, 1, 0), (0, 1, 1, 1), (0, 0, 0, 1), (1, 0, 1, 1))
    free = [
        (i, j)
        for i in range(31)
        for j in range(31)
        if not any(((i + a, j + b), (i + c, j + d)) in legs for a, b, c, d in around)
    ]
    assert len(free) == 47
    path = hilbert(flat_surface(32.0), 5, mapping="parametric")
    line = path.sample(0.05).point
    for i, j in free:
        assert np.linalg.norm(line - [i + 1, j + 1, 0], axis=1).min() == pytest.approx(np.sqrt(0.5), abs=1e-9)
    assert path.metrics(0.75, surface_step=0.2).largest_gap == pytest.approx(np.sqrt(2), abs=1e-6)


def slowly(point, start, end):
    """Distance of each point from every leg, the least of them."""
    way, offset = end - start, point[:, None] - start
    share = np.clip((offset * way).sum(axis=2) / np.maximum((way**2).sum(axis=1), 1e-300), 0, 1)
    return np.linalg.norm(offset - share[..., None] * way, axis=2).min(axis=1)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32), st.integers(2, 60), st.floats(0.01, 100.0), st.sampled_from([0.0, 1.0]))
def test_distances_by_brute_force(seed, count, size, height):
    """Lines in space and in a plane; points on them, near and far; legs of length 0 and a single leg."""
    rng = np.random.default_rng(seed)
    lines = [np.cumsum(rng.normal(size=(n, 3)), axis=0) * [size, size, size * height] for n in (count, 2, 3)]
    lines[1][1] = lines[1][0]
    legs = np.concatenate([each[:-1] for each in lines]), np.concatenate([each[1:] for each in lines])
    longest = np.linalg.norm(legs[1] - legs[0], axis=1).max()
    away = rng.normal(size=(60, 3)) * longest * 10.0 ** rng.uniform(-3, 1.5, (60, 1))
    point = np.concatenate([lines[0], lines[0][rng.integers(count, size=60)] + away])
    told, true = Nearest(lines).distance(point), slowly(point, *legs)
    assert told == pytest.approx(true, rel=1e-9, abs=1e-9 * size)


def test_a_long_leg_behind_many_nearer_ends():
    """8 mm below the middle of a leg of 2 mm, whose ends are 8.06 mm away; those of 20 short ones are 8.03 mm."""
    x = np.linspace(-0.02, 0.02, 21)
    lines = [np.array([[-1.0, 0, 0], [1.0, 0, 0]]), np.stack([x, 0 * x, 0 * x - 0.03], axis=1)]
    assert Nearest(lines).distance(np.array([[0.0, 0.0, 8.0]]))[0] == pytest.approx(8.0, abs=1e-12)


@settings(max_examples=4, deadline=None)
@given(st.sampled_from([2, 3]), st.sampled_from(["parametric", "equal_area"]), st.floats(0.5, 6.0))
def test_coverage_by_brute_force(order, mapping, radius):
    """Samples much closer than the cells, against every chord of a path."""
    path = hilbert(nominal_surface(), order, mapping=mapping)
    found = metrics(path, radius, surface_step=0.02)
    count, width = 200, 52.0 / 200  # mm
    # one place in each cell, not its middle: edges of the footprint go along rows of middles
    u, v = (np.indices((count, count)) + np.random.default_rng(1).uniform(size=(2, count, count))) / count
    weight = path.surface.area_density(u, v).ravel()
    distance = cKDTree(path.sample(0.02).point).query(path.surface.point(u, v).reshape(-1, 3))[0]
    share, edge = weight[distance <= radius].sum() / weight.sum(), 2 * path.length
    # each cell at the edge of the footprint is off by a share between -1/2 and 1/2; five standard deviations;
    # an edge along a row of the smallest cells is off by half of one
    off = (5 * width**2 * np.sqrt(edge / width / 12) + edge * 0.02 / 2) / path.surface.area
    assert found.coverage == pytest.approx(share, abs=off)
    assert 2 * distance.max() - 2e-3 * radius <= found.largest_gap <= 2 * distance.max() + 4 * width


def test_the_largest_gap_is_the_largest():
    """Gaps that are nearly alike over all of the surface: a scan of all passes finds none larger."""
    path = zigzag(nominal_surface(), 2.0)
    found = path.metrics(2.0)
    u = np.linspace(0, 1, 401)
    point = path.surface.grid(u, u).point.reshape(-1, 3)
    seen = 2 * Nearest([path.sample(0.02).point]).distance(point).max()
    assert seen <= found.largest_gap + 2 * 1e-3 * 2.0 and found.largest_gap <= seen + 2 * np.sqrt(0.5) * 0.13


def test_a_trimmed_patch_by_its_area():
    """A disc of which the passes reach all, and a footprint that reaches only half of it."""
    turn = np.linspace(0, 2 * np.pi, 401)
    disc = Patch(flat_surface(20.0), [0.5 + 0.3 * np.stack([np.cos(turn), np.sin(turn)], axis=1)])
    whole = zigzag(disc, 1.0).metrics(2.0)
    assert whole.coverage == 1.0 and whole.largest_gap < 4.0
    line = Path(flat_surface(20.0), [(0.0, 0.5), (1.0, 0.5)])
    h, r = 2.0, 6.0  # mm: strip of half width h through a disc of radius r
    share = 2 * (h * np.sqrt(r**2 - h**2) + r**2 * np.arcsin(h / r)) / (np.pi * r**2)
    found = metrics(line, h, surface_step=0.01, patch=disc)
    # each edge of the strip, 2 sqrt(r^2 - h^2) long, is off by half a cell at most
    assert found.coverage == pytest.approx(share, abs=0.01 * 2 * np.sqrt(r**2 - h**2) / (np.pi * r**2))
    assert found.largest_gap == pytest.approx(2 * r, abs=2e-3)  # chords of the polygon: r (1 - cos(pi/400))


@pytest.mark.parametrize("radius", [5.0, 5.5])
def test_a_trimming_along_the_cells(radius):
    """Middles of cells that the border crosses would all lie on one side of it: 1.0 for 0.9992."""
    low, high = 0.05, 0.95
    patch = Patch(flat_surface(40.0), [[(low, low), (high, low), (high, high), (low, high), (low, low)]])
    path = zigzag(patch, pitch=3.0, margin=3.0)
    spread = np.random.default_rng(1).uniform(size=(2, 400 * 400))
    u, v = low + (high - low) * (np.indices((400, 400)).reshape(2, -1) + spread) / 400
    line = np.concatenate([each.sample(0.02).point for each in path.pieces])
    distance = cKDTree(line).query(patch.surface.point(u, v))[0]
    found = path.metrics(radius, surface_step=0.03)
    # edges along the cells, some 40 mm, are off by half a cell; 160 000 samples by less
    assert found.coverage == pytest.approx(np.mean(distance <= radius), abs=40 * 0.015 / 36**2 + 2e-4)
    assert (found.coverage == 1.0) == (found.largest_gap <= 2 * radius)


def test_cells_are_as_small_as_told():
    for surface in uneven_surfaces().values():
        edges = edges_of(surface, 2.0, 0.6)
        assert edges.levels == 2 and (edges.u.size - 1) % 4 == 0 == (edges.v.size - 1) % 4
        u, v = edges.u[::4], edges.v[::4]
        corner = surface.grid(u, v).point
        middle = surface.grid((u[1:] + u[:-1]) / 2, (v[1:] + v[:-1]) / 2).point
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
            reach = np.linalg.norm(corner[i : len(u) - 1 + i, j : len(v) - 1 + j] - middle, axis=-1).max()
            assert reach <= edges.reach[0] * 1.001


def test_a_wider_footprint_covers_more():
    path = hilbert(nominal_surface(), 3)
    shares = [
        path.metrics(radius, surface_step=0.5, path_step=0.3).coverage for radius in (1.0, 2.0, 3.0, 6.0)
    ]
    assert shares == sorted(shares) and shares[0] < 0.5 and shares[-1] == 1.0


def below(surface, u, v, count=400):
    """Area of the surface under a curve v(u) for each width of u, by rectangles of positions alone."""
    t = (np.arange(count) + 0.5) / count
    return sum(surface.area_density(u, v * each) * v for each in t) / count


@pytest.mark.parametrize("name", ["crowded", "steep", "weighted"])
def test_cells_of_equal_area(name):
    surface = uneven_surfaces()[name]
    density = surface.grid(*2 * [np.linspace(0, 1, 201)])
    w = np.linalg.norm(np.cross(density.u, density.v), axis=-1)
    assert w.max() / w.min() >= 10
    path = hilbert(surface, 4)
    assert path.metrics(2.0, surface_step=1.0, path_step=0.5).cell_area_cv <= 1e-3
    assert cell_areas(path).sum() == pytest.approx(surface.area, rel=1e-4)
    edges = Path(
        surface, np.stack(np.broadcast_arrays(0.3, [0.25, 0.5, 0.75]), axis=1), mapping="equal_area"
    ).uv
    share = below(surface, edges[:, 0], edges[:, 1]) / below(surface, edges[:1, 0], np.array([1.0]))
    np.testing.assert_allclose(share, [0.25, 0.5, 0.75], atol=2e-4)
    assert hilbert(surface, 4, mapping="parametric").metrics(2.0, surface_step=1.0).cell_area_cv > 0.3


def test_strips_of_a_zigzag():
    """Strips on a flat between lines of one's own: half way to the neighbours."""
    lines = np.array([0.1, 0.3, 0.8])
    nodes = [[a, c] for k, c in enumerate(lines) for a in ((0.1, 0.9) if k % 2 == 0 else (0.9, 0.1))]
    path = Path(flat_surface(10.0), np.array(nodes), pattern="zigzag")
    np.testing.assert_allclose(cell_areas(path), [20.0, 35.0, 45.0], rtol=1e-12)
    assert path.metrics(1.0).cell_area_cv == pytest.approx(np.std([20, 35, 45]) / np.mean([20, 35, 45]))
    even = zigzag(nominal_surface(), 2.0, mapping="equal_area", along="v")
    assert cell_areas(even).sum() == pytest.approx(nominal_surface().area, rel=1e-6)
    assert even.metrics(1.0, surface_step=0.5).cell_area_cv < 1e-6


def test_a_move_is_no_strip():
    """A straight way back over most of the side, and a short pass at its end, change nothing."""
    lines, along = np.array([0.1, 0.3, 0.8]), np.linspace(0.1, 0.9, 17)
    nodes = [[a, c] for k, c in enumerate(lines) for a in along[:: 1 - 2 * (k % 2)]]
    tail = [[0.2, 0.75], [0.2, 0.7], [0.2, 0.65]]
    plain, moved = (
        Path(flat_surface(10.0), np.array(each), pattern="zigzag") for each in (nodes, nodes + tail)
    )
    np.testing.assert_allclose(cell_areas(moved), cell_areas(plain), rtol=1e-12)


def test_no_cells_for_other_paths():
    found = Path(flat_surface(10.0), np.array([[0.1, 0.1], [0.5, 0.4], [0.9, 0.2]])).metrics(1.0)
    assert found.cell_area_cv is None and "cell areas     not defined for this pattern" in repr(found)


def test_equal_area_is_more_even():
    """Less than half the gap and the spread of steps, for a few percent of length."""
    surface = uneven_surfaces()["crowded"]
    plain, even = (
        hilbert(surface, 5, mapping=mapping).metrics(0.8, surface_step=0.2)
        for mapping in ("parametric", "equal_area")
    )
    assert even.largest_gap < 0.6 * plain.largest_gap
    assert even.step_cv < 0.5 * plain.step_cv
    assert even.coverage > plain.coverage
    assert even.length < 1.1 * plain.length


def test_text():
    text = repr(hilbert(nominal_surface(), 3).metrics(3.0, surface_step=0.5, path_step=0.2))
    assert text.startswith("PathMetrics(\n    length         4") and text.count("\n") == 6
    assert "within 3 mm of the path" in text and "0.5 mm on the surface, 0.2 mm on the path)" in text


@pytest.mark.parametrize("value", [0.0, -1.0])
def test_refused_sizes(value):
    path = hilbert(flat_surface(8.0), 1)
    with pytest.raises(ValueError, match=rf"^footprint_radius must be > 0 \(mm\); got {value}$"):
        path.metrics(value)
    with pytest.raises(ValueError, match=rf"^surface_step must be > 0 \(mm\); got {value}$"):
        path.metrics(1.0, surface_step=value)
    with pytest.raises(ValueError, match=rf"^path_step must be > 0 \(mm\); got {value}$"):
        path.metrics(1.0, path_step=value)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"pitch": 0.0}, r"^pitch must be > 0 \(mm\); got 0.0$"),
        ({"pitch": -1.0}, r"^pitch must be > 0 \(mm\); got -1.0$"),
        ({"pitch": 50.0}, r"^pitch must be < 50, the lesser side of the surface \(mm\); got 50.0$"),
        (
            {"pitch": 1e-3},
            r"^pitch must be >= 0.012: else a path has more than 16777216 nodes \(mm\); got 0.001$",
        ),
        ({"radius": -0.1}, r"^radius must be >= 0 \(mm\); got -0.1$"),
        (
            {"radius": 1.1},
            r"^radius must be <= 1, what fits between the passes at their ends \(mm\); got 1.1$",
        ),
        (
            {"mapping": "even"},
            r"^mapping must be one of equal_spacing, parametric, equal_area, geodesic; got 'even'$",
        ),
        ({"along": "x"}, r"^along must be one of u, v; got 'x'$"),
    ],
)
def test_refused_zigzags(wrong, message):
    with pytest.raises(ValueError, match=message):
        zigzag(flat_surface(50.0), **{"pitch": 2.0, **wrong})


def test_refused_surface():
    with pytest.raises(TypeError, match=r"^surface must be a Surface or a Patch; got 3.0$"):
        zigzag(3.0, 1.0)


def test_coarse_steps_are_made_finer():
    """Steps of the caller, or of a large radius, that would cut corners and miss gaps."""
    path = zigzag(flat_surface(50.0), 1.5)
    fine = path.metrics(0.8)
    coarse = path.metrics(0.8, path_step=5.0)
    assert coarse.coverage == fine.coverage > 0.995
    assert coarse.path_step == fine.path_step == pytest.approx(0.4)  # half of the radius: it is straight
    large = path.metrics(100.0)
    assert large.largest_gap == pytest.approx(fine.largest_gap, rel=1e-4) and large.coverage == 1
    assert large.surface_step == pytest.approx(path.pitch / 4)


def test_too_many_samples():
    path = zigzag(flat_surface(50.0), 1.5)
    with pytest.raises(
        ValueError,
        match=r"surface_step must be larger: 2.5e-05 mm asks for 1.05e\+10 samples, more than 3e\+07; give",
    ):
        path.metrics(1e-3)
    with pytest.raises(ValueError, match=r"path_step must be larger: 1e-06 mm asks for 1.7e\+09 samples"):
        path.metrics(1.0, path_step=1e-6)


def test_paths_without_cells_or_passes():
    flat = flat_surface(50.0)
    triangle = Path(flat, [(0.2, 0.2), (0.8, 0.2), (0.8, 0.8), (0.2, 0.2)])
    diagonal = Path(flat, [(0.1, 0.1), (0.9, 0.9)], pattern="zigzag")
    slanted = Path(flat, [(0.1, 0.1), (0.9, 0.8), (0.1, 0.9)], pattern="zigzag")
    assert [cell_areas(path) for path in (triangle, diagonal, slanted)] == [None] * 3
    assert triangle.metrics(2.0).cell_area_cv is None
