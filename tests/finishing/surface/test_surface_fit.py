"""Surfaces fitted to points: against dense least squares and true surfaces, under motions, and refused."""

import numpy as np
import pytest
from finishing_inside import bases, fit_control_points, knots_of, refuse_folded_surface
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from sdpgrind.finishing import Surface
from sdpgrind.finishing.surface import FitQuality, cylinder_surface, nominal_surface, sphere_surface

NOMINAL = nominal_surface()
NOISE = 0.01  # mm


def motion(rng):
    """A random turn and a step of some 100 mm."""
    return Rotation.random(rng=rng).as_matrix(), rng.uniform(-100.0, 100.0, 3)


def scan(shape, count, seed, noise=0.0):
    """Points of a surface with noise along its normals, moved; the noise, and the motion."""
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(0.0, 1.0, (2, count))
    lifted = noise * rng.normal(size=count)
    turn, step = motion(rng)
    points = shape.point(u, v) + lifted[:, None] * shape.normal(u, v)
    return points @ turn.T + step, lifted, (turn, step)


def height_errors(surface, moved):
    """Distances of a surface from the nominal one, mm, a height over x = 50 u, y = 50 v; edges left out."""
    turn, step = moved
    at = np.linspace(0.0, 1.0, 80)
    x, y, z = np.moveaxis((surface.grid(at, at).point - step) @ turn, -1, 0)
    inside = (np.minimum(x, y) > 0.0) & (np.maximum(x, y) < 50.0)
    u, v = x[inside] / 50.0, y[inside] / 50.0
    return (z[inside] - NOMINAL.point(u, v)[:, 2]) * NOMINAL.normal(u, v)[:, 2]


def test_exact_points():
    points, _, moved = scan(NOMINAL, 20_000, seed=1)
    surface = Surface.fit(points, net=(10, 10))
    assert surface.fit.error <= 0.005  # measured: 0.0015
    assert surface.fit.net == surface.control_points.shape[:2] == (10, 10)
    assert np.abs(height_errors(surface, moved)).max() <= 0.005


@pytest.mark.parametrize("net", [None, (10, 10)])
def test_noise_is_not_followed(net):
    points, noise, moved = scan(NOMINAL, 20_000, seed=2, noise=NOISE)
    surface = Surface.fit(points, net=net, tolerance=0.001)
    assert surface.fit.rms == pytest.approx(np.sqrt(np.mean(noise**2)), rel=0.02)
    # measured: 0.0005; of m points the p control points take sqrt(p/m) of the noise, here up to 0.0007
    assert np.sqrt(np.mean(height_errors(surface, moved) ** 2)) < 0.0015
    assert abs(surface.fit.neighbours) < 0.1
    assert ("noise" in surface.fit.status) == (net is None)


def test_nets_grow_until_tolerance_is_kept():
    points, *_ = scan(NOMINAL, 5000, seed=3)
    rough, fine = (Surface.fit(points, tolerance=each).fit for each in (0.01, 0.0005))
    assert rough.most < 0.01 and fine.most < 0.0005 and np.prod(fine.net) > np.prod(rough.net)
    assert fine.status == "99 % of the points keep the tolerance"


def test_a_finer_net_needs_more_points():
    points, *_ = scan(NOMINAL, 80, seed=3)
    fit = Surface.fit(points, tolerance=1e-7).fit
    assert fit.status == "a finer net needs more points" and np.prod(fine := fit.net) <= 40 and fine == (6, 6)


def test_form_that_no_net_follows_is_no_noise():
    """A ripple of 1 mm: the first nets average over it, yet it is no noise, as neighbours tell."""
    x, y = np.random.default_rng(4).uniform(0.0, 40.0, (2, 20_000))
    ripple = np.stack([x, y, 0.02 * np.sin(2 * np.pi * (x + 0.3 * y))], axis=-1)
    fit = Surface.fit(ripple, tolerance=0.001).fit
    assert fit.neighbours > 0.3 and "neighbours agree" in fit.status and fit.net == (6, 6)
    assert fit.rms == pytest.approx(0.02 / np.sqrt(2), rel=0.02)


@pytest.mark.parametrize(
    ("net", "degree"), [((7, 6), (3, 2)), ((5, 4), (1, 1)), ((6, 9), (2, 3)), ((2, 5), (1, 3))]
)
def test_band_against_dense_least_squares(net, degree):
    """The band solves what rows of the basis and of second slopes say."""
    rng = np.random.default_rng(5)
    uv, points = rng.uniform(0.0, 1.0, (2, 300)), rng.normal(size=(300, 3))
    knots = [knots_of(n, p) for n, p in zip(net, degree, strict=True)]
    rows = [bases(k, p, at)[0] for k, p, at in zip(knots, degree, uv, strict=True)]
    design = np.einsum("ki,kj->kij", *rows).reshape(300, -1)
    weight = 1e-6 * np.mean((design**2).sum(axis=0))
    bends = [second_slopes(k, p) for k, p in zip(knots, degree, strict=True)]
    bending = np.concatenate([np.kron(bends[0], np.eye(net[1])), np.kron(np.eye(net[0]), bends[1])])
    every = np.concatenate([design, np.sqrt(weight) * bending])
    wanted = np.linalg.lstsq(every, np.concatenate([points, np.zeros((len(bending), 3))]))[0]
    found = fit_control_points(uv, points, knots, degree)
    np.testing.assert_allclose(found.reshape(-1, 3), wanted, rtol=1e-9, atol=1e-9)


def second_slopes(knots, degree):
    """Rows that are 0 for control points of a straight line."""
    n = len(knots) - degree - 1
    g = np.array([np.mean(knots[i + 1 : i + degree + 1]) for i in range(n)]) * (n - 1)
    rows = np.zeros((max(n - 2, 0), n))
    for i in range(n - 2):
        one, two = 1.0 / (g[i + 1] - g[i]), 1.0 / (g[i + 2] - g[i + 1])
        rows[i, i : i + 3] = one, -one - two, two
    return rows


def test_bending_decides_only_where_there_are_no_points():
    """A plane is fitted exactly though a third of it is empty."""
    rng = np.random.default_rng(6)
    x, y = rng.uniform(0.0, 30.0, (2, 4000))
    kept = np.abs(x - 15.0) > 5.0
    points = np.stack([x, y, 0.3 * x - 0.1 * y], axis=-1)[kept]
    surface = Surface.fit(points, net=(20, 20), empty_max=0.5)
    assert surface.fit.empty == pytest.approx(1 / 3, abs=0.02)
    at = np.linspace(0.0, 1.0, 50)
    px, py, pz = np.moveaxis(surface.grid(at, at).point, -1, 0)
    np.testing.assert_allclose(pz, 0.3 * px - 0.1 * py, atol=1e-9)


def test_distances_are_those_of_the_feet():
    points, *_ = scan(NOMINAL, 400, seed=7, noise=0.2)
    surface = Surface.fit(points, net=(6, 6))
    fit = surface.fit
    np.testing.assert_allclose(
        np.linalg.norm(points - surface.point(*fit.feet.T), axis=1), np.abs(fit.distances), rtol=1e-12
    )
    for k in range(0, 400, 40):
        least = minimize(
            lambda at, k=k: np.sum((surface.point(*at) - points[k]) ** 2),
            fit.feet[k],
            bounds=[(0.0, 1.0)] * 2,
        )
        # four steps of first order: what is left of a distance d is of the order of d (0.2 mm/50 mm)^2
        assert np.sqrt(least.fun) == pytest.approx(abs(fit.distances[k]), abs=2e-6)


def test_quality_tells_the_distances():
    fit = FitQuality(distances=[3.0, -4.0, 0.0], feet=np.zeros((3, 2)), tolerance=0.1, net=(4, 4))
    assert fit.error == 4.0 and fit.rms == pytest.approx(np.sqrt(25 / 3)) and 3.9 < fit.most < 4.0
    assert fit == fit.replace() and fit != fit.replace(tolerance=0.2) and "3 points" in repr(fit)
    with pytest.raises(ValueError, match=r"feet must be of shape \(m, 2\)"):
        fit.replace(feet=np.zeros((2, 2)))
    with pytest.raises(ValueError, match="distances must be of shape"):
        fit.replace(distances=[])
    less = fit.replace(left_out=[1])
    assert less.outliers == 1 and less.error == 3.0 and less.rms == pytest.approx(np.sqrt(4.5))
    assert "3 points less 1 outlier," in repr(less) and fit.outliers == 0
    with pytest.raises(ValueError, match="left_out must be numbers of the 3 points"):
        fit.replace(left_out=[3])


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_a_fit_moves_with_its_points(seed):
    """Turned and moved points have the same distances from their surface, up to rounding of 100 mm and of the
    condition of the equations, some 1e6.
    """
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(0.0, 1.0, (2, 600))
    points = NOMINAL.point(u, v) * [1.0, 0.7, 1.0] + 0.01 * rng.normal(size=(600, 3))
    turn, step = motion(rng)
    still = Surface.fit(points, net=(7, 6), side=(0.0, 0.0, 1.0))
    moved = Surface.fit(points @ turn.T + step, net=(7, 6), side=turn[:, 2])
    np.testing.assert_allclose(moved.fit.distances, still.fit.distances, atol=1e-8)
    there = still.point(*still.fit.feet.T) @ turn.T + step
    np.testing.assert_allclose(moved.point(*moved.fit.feet.T), there, atol=1e-8)
    assert moved.area == pytest.approx(still.area, rel=1e-9)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_order_of_the_points_is_nothing(seed):
    points, *_ = scan(NOMINAL, 300, seed=8)
    order = np.random.default_rng(seed).permutation(300)
    one, other = Surface.fit(points, net=(6, 6)), Surface.fit(points[order], net=(6, 6))
    np.testing.assert_allclose(other.control_points, one.control_points, atol=1e-7)


@pytest.mark.parametrize("side", [(0.0, 0.0, 1.0), (0.3, 0.2, -1.0)])
def test_the_side_of_the_tool(side):
    rng = np.random.default_rng(9)
    points = NOMINAL.point(*rng.uniform(0.0, 1.0, (2, 500)))
    surface = Surface.fit(points, side=side)
    assert surface.outward == 1 and (surface.normal([0.1, 0.5, 0.9], 0.5) @ side > 0.0).all()
    lifted = points + 0.02 * np.sign(side[2]) * np.array([0.0, 0.0, 1.0]) * (rng.uniform(size=(500, 1)) < 0.1)
    fit = Surface.fit(lifted, net=(6, 6), side=side).fit
    assert fit.distances.max() > 0.01 > -fit.distances.min()


def test_without_a_side_the_tool_is_above():
    points, _, (turn, _) = scan(NOMINAL, 500, seed=10)
    up = turn[:, 2] * np.sign(turn[2, 2])
    assert Surface.fit(points).normal(0.5, 0.5) @ up > 0.9


def test_the_rectangle_is_that_of_least_area():
    """A square has no principal axes; the longer side of a strip is u."""
    points, *_ = scan(NOMINAL, 3000, seed=11)
    surface = Surface.fit(points)
    assert surface.fit.empty == 0.0 and surface.area == pytest.approx(NOMINAL.area, rel=0.03)
    strip = cylinder_surface(20.0, 200.0)
    points, *_ = scan(strip, 3000, seed=12)
    surface = Surface.fit(points)
    d = surface.derivatives(0.5, 0.5)
    assert np.linalg.norm(d.u) > 5 * np.linalg.norm(d.v) and surface.fit.net[0] > surface.fit.net[1]
    assert surface.fit.error < 0.02
    assert abs(abs(surface.mean_curvature(0.5, 0.5)) - 1 / 40) < 0.001


def test_a_surface_that_was_not_fitted_says_so():
    points, *_ = scan(NOMINAL, 300, seed=13)
    fitted = Surface.fit(points)
    assert not hasattr(NOMINAL, "fit") and hasattr(fitted, "fit")
    with pytest.raises(AttributeError, match=r"Surface\.fit\(points\) returns one that is"):
        _ = NOMINAL.fit
    assert not hasattr(fitted.moved([1.0, 0.0, 0.0]), "fit")
    assert fitted == fitted.replace() and hash(fitted) == hash(fitted.replace())


GRID = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0), [0.0]), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize(
    ("points", "more", "message"),
    [
        (GRID[:15], {}, r"no fewer than the control points of a net of 4 x 4 = 16, here of degree \(3, 3\); got 15"),
        (GRID, {"net": (9, 9)}, "no fewer than the control points of a net of 9 x 9 = 81"),
        (GRID[:, :2], {}, r"points must be of shape \(m, 3\) \(mm\)"),
        (np.where(GRID == 7.0, np.nan, GRID), {}, r"points\[21\] must be finite \(mm\); got nan"),
        (GRID * [1, 0, 0], {}, r"points must not lie on a line \(mm\)"),
        (GRID * 0, {}, r"points must not lie on a line \(mm\)"),
        (GRID, {"net": (3, 4)}, r"control points along u must be at least degree \+ 1 = 4; got 3"),
        (GRID, {"net": 5}, "net must be a pair"),
        (GRID, {"degree": (0, 3)}, r"degree\[0\] must be >= 1"),
        (GRID, {"tolerance": 0.0}, r"tolerance must be > 0 \(mm\)"),
        (GRID, {"side": (0.0, 0.0)}, "side must be a direction towards the tool"),
        (GRID, {"side": (1.0, 2.0, 0.0)}, "side must be a direction away from the points' plane"),
        (GRID, {"empty_max": 0.0}, r"empty_max must be in \(0, 1\]"),
    ],
)  # fmt: skip
def test_refusals(points, more, message):
    with pytest.raises(ValueError, match=message):
        Surface.fit(points, **more)


def test_points_on_two_lines_tell_no_surface():
    line = np.linspace(-10.0, 10.0, 60)[:, None]
    cross = np.concatenate([line * [1.0, 0.0, 0.0], line * [0.0, 1.0, 0.0]])
    with pytest.raises(ValueError, match="points must"):
        Surface.fit(cross, net=(20, 20), degree=(1, 1))


@pytest.mark.parametrize(
    "shape",
    [
        lambda u, v: np.stack([np.cos(2 * np.pi * u), np.sin(2 * np.pi * u), 2 * v], axis=-1),
        lambda u, v: sphere_surface(1.0).point(u, v) * np.sign(v[:, None] - 0.4),
        lambda u, v: np.stack([np.minimum(u, 0.7), v, np.maximum(u - 0.7, 0.0)], axis=-1),
    ],
    ids=["tube", "two patches", "wall"],
)  # fmt: skip
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_points_that_are_no_sheet(shape, noise):
    rng = np.random.default_rng(14)
    points = 20.0 * shape(*rng.uniform(0.0, 1.0, (2, 4000))) + noise * rng.normal(size=(4000, 3))
    with pytest.raises(ValueError, match=r"sheet over their plane, at most 80 deg steep.*Region\(box="):
        Surface.fit(points)


@pytest.mark.parametrize("noise", [0.03, 0.1])
@pytest.mark.parametrize("jitter", [0.0, 0.005])
def test_scan_lines_with_noise_are_no_walls(noise, jitter):
    """Ten times denser along the lines than across: points near to each other are those of one line."""
    x, y = (each.ravel() for each in np.meshgrid(np.arange(0, 41, 2.0), np.arange(0, 25, 0.2)))
    wave, rng = 2 * np.sin(x / 12) * np.cos(y / 15), np.random.default_rng(3)
    points = np.stack(
        [x + jitter * rng.normal(size=x.size), y, wave + noise * rng.normal(size=x.size)], axis=1
    )
    assert Surface.fit(points).fit.rms == pytest.approx(noise, rel=0.1)


def test_a_surface_that_folds_is_seen_at_its_normals():
    """A fold of few points escapes the first look."""
    x = np.array([0.0, 10.0, 21.0, 19.0, 30.0, 40.0])
    net = np.stack(
        np.broadcast_arrays(x[:, None], np.arange(5) * 10.0, np.array([0, 0, 0, 1, 1, 1.0])[:, None]), axis=-1
    )
    folded = Surface.bspline(net, degree=(1, 1))
    at = np.linspace(0.0, 1.0, 11)
    d = folded.derivatives(at, 0.5)
    with pytest.raises(ValueError, match=r"near \(21, 20, 0\) mm they are 153 deg steep"):
        refuse_folded_surface(d, d.point, np.array([0.0, 0.0, 1.0]))
    flat = folded.replace(control_points=net * [1.0, 1.0, 0.0] + [0, 0, 0.3] * net[..., :1]).derivatives(
        at[:4], 0.5
    )
    refuse_folded_surface(flat, flat.point, np.array([0.0, 0.0, 1.0]))


def test_holes_are_refused_unless_they_are_allowed():
    rng = np.random.default_rng(16)
    x, y = rng.uniform(-20.0, 20.0, (2, 8000))
    disk = np.stack([x, y, 0.01 * x * y], axis=-1)[(np.hypot(x, y) > 10.0)]
    for net in (28, 6):
        with pytest.raises(
            ValueError, match=rf"within 2 knot spans, .* all but 0\.05.*a net of {net} x {net}.*empty_max"
        ):
            Surface.fit(disk, net=(net, net))
    fit = Surface.fit(disk, net=(28, 28), empty_max=0.25).fit
    # all of the hole, to half the distance of points, 0.45 mm
    assert np.pi * 9.7**2 / 1600 < fit.empty < np.pi * 10.3**2 / 1600
    assert Surface.fit(disk, net=(6, 6), empty_max=0.25).fit.empty == pytest.approx(fit.empty, rel=0.02)


def test_a_hole_in_a_dense_scan_is_seen_on_a_coarse_net():
    """A hole of 8 mm, 8 % of the square, lies within two of the three knot spans a side."""
    points = NOMINAL.point(*np.random.default_rng(21).random((2, 20_000)))
    holed = points[np.hypot(points[:, 0] - 25.0, points[:, 1] - 25.0) > 8.0]
    with pytest.raises(ValueError, match=r"0\.0[78]\d* of it is empty at a net of 6 x 6.*empty_max=0\.0[89]"):
        Surface.fit(holed, net=(6, 6))
    assert Surface.fit(points, net=(6, 6)).fit.empty == 0.0


def uneven(kind, rng):
    """Places (2, m) of scans that are whole."""
    u, v = rng.random((2, 20_000))
    if kind == "lines":
        return np.concatenate([np.meshgrid(np.linspace(0.0, 1.0, 600), np.linspace(0.0, 1.0, 20))]).reshape(
            2, -1
        )
    dense = {"halves": np.where(u < 0.5, 1.0, 0.25), "ramp": 1.0 - 0.75 * u, "twice": 1.0 + 0.0 * u}[kind]
    kept = rng.random(u.size) < dense
    return np.tile(np.stack([u, v])[:, kept], 2 if kind == "twice" else 1)


@pytest.mark.parametrize("kind", ["halves", "ramp", "twice", "lines"])
def test_uneven_scans_are_whole(kind):
    """Four times as dense on one half, or on one side; each point twice; 20 lines 30 times denser along."""
    points = NOMINAL.point(*uneven(kind, np.random.default_rng(22)))
    assert Surface.fit(points, net=(6, 6)).fit.empty == 0.0


def dirty(share, size, seed):
    """A noisy scan, some of its points off by `size` mm to either side; which they are, and the motion."""
    points, _, moved = scan(NOMINAL, 20_000, seed=seed, noise=NOISE)
    rng = np.random.default_rng(seed + 1000)
    off = rng.random(20_000) < share
    points[off] += size * rng.choice([-1.0, 1.0], (off.sum(), 1)) * moved[0][:, 2]
    return points, off, moved


@pytest.mark.parametrize("net", [None, (10, 10), (25, 25)])
def test_outliers_are_left_out_and_told(net):
    points, off, moved = dirty(0.005, 1.0, seed=23)
    surface = Surface.fit(points, net=net)
    fit = surface.fit
    # all of them; of the clean ones one is expected to be lost, more than 5 with 0.06 %
    assert np.isin(np.flatnonzero(off), fit.left_out).all() and off.sum() <= fit.outliers <= off.sum() + 5
    assert fit.rms == pytest.approx(NOISE, rel=0.05) and fit.error < 0.06
    assert f"20000 points less {fit.outliers} outliers" in repr(fit)
    # p control points take sqrt(p/m) of the noise: 0.0018 mm of 625
    assert np.sqrt(np.mean(height_errors(surface, moved) ** 2)) < 0.003
    assert np.abs(fit.distances[off]).min() > 0.5  # mm, along the normal


def test_clean_noise_loses_about_one_point():
    """Twenty clouds of 3000 points lose one each on the average, with a standard deviation of 4.5 in all."""
    lost = [Surface.fit(scan(NOMINAL, 3000, seed, NOISE)[0], net=(6, 6)).fit.outliers for seed in range(20)]
    assert sum(lost) < 20 + 4 * 4.5 and max(lost) <= 6


def test_a_bump_is_no_outlier():
    """A bump of 0.2 mm, 2 mm wide, holds 20 points: its neighbours are off likewise."""
    points, _, (turn, step) = scan(NOMINAL, 20_000, seed=24, noise=0.001)
    flat = (points - step) @ turn
    bump = 0.2 * np.exp(-0.5 * np.sum((flat[:, :2] - 20.0) ** 2, axis=1))
    fit = Surface.fit(points + bump[:, None] * turn[:, 2], net=(8, 8)).fit
    assert fit.outliers <= 3 and fit.error > 0.1


@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 80), flat=st.booleans(), whole=st.booleans())
@settings(max_examples=60, deadline=None)
def test_a_surface_or_one_sentence(seed, count, flat, whole):
    """Clouds by chance, thin ones and repeated points too: finite numbers, or a ValueError of `points`."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3)) * rng.choice([1e-6, 1e-3, 1.0, 100.0], size=3) + rng.choice(
        [0.0, 1e5]
    )
    points = np.round(points * 3) if whole else points
    points[:, 2] *= not flat
    try:
        surface = Surface.fit(points, degree=tuple(rng.integers(1, 4, 2).tolist()), empty_max=1.0)
    except ValueError as error:
        assert str(error).startswith("points must")
    else:
        assert np.isfinite(surface.control_points).all() and np.isfinite(surface.fit.distances).all()
