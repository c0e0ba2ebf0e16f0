"""Length along a path and its inverse, sampling, even nodes: against quadrature, and in closed form."""

from itertools import pairwise

import numpy as np
import pytest
from finishing_inside import inverted, travelled
from hypothesis import given, settings
from hypothesis import strategies as st
from path_surfaces import FLAT, SURFACES, point_of, sides
from scipy.integrate import quad

from sdpgrind.finishing import Path, Surface, hilbert

ACROSS = [(0.05, 0.1), (0.95, 0.83), (0.6, 0.05)]


@pytest.mark.parametrize("name", SURFACES)
def test_length_is_the_integral_of_speed(name):
    """Legs through many knot spans, by adaptive quadrature of differences of scipy's splines between all
    knots.
    """
    surface, nodes = SURFACES[name], np.array(ACROSS)
    total = 0.0
    for p, q in pairwise(nodes):

        def speed(t, p=p, q=q):
            h = 1e-3 * min(t, 1 - t, 0.02)
            stencil = np.array([1, -8, 8, -1]) / (12 * h)
            points = [point_of(surface, *(p + (t + k * h) * (q - p))) for k in (-2, -1, 1, 2)]
            return np.linalg.norm(stencil @ np.array(points))

        cuts = [
            (knot - p[axis]) / (q - p)[axis] for axis in (0, 1) for knot in np.unique(surface.knots[axis])
        ]
        ends = np.unique(np.clip([0, 1, *cuts], 0, 1))
        total += sum(quad(speed, a, b, epsrel=1e-8, limit=30)[0] for a, b in pairwise(ends))
    assert Path(surface, nodes).length == pytest.approx(total, rel=1e-7)


@pytest.mark.parametrize("mapping", ["parametric", "equal_area"])
@pytest.mark.parametrize("name", SURFACES)
def test_length_is_the_limit_of_chords(name, mapping):
    path = Path(SURFACES[name], ACROSS, mapping=mapping)
    coarse, fine = (
        np.linalg.norm(np.diff(path.sample(per_leg=n).point, axis=0), axis=1).sum() for n in (2000, 4000)
    )
    assert fine <= path.length * (1 + 1e-13)
    assert fine + (fine - coarse) / 3 == pytest.approx(path.length, rel=1e-8)


def test_over_a_roof():
    """Two flat slopes: the speed jumps at the ridge, which legs cross anywhere."""
    net = [[[x, y, z] for y in (0.0, 10.0)] for x, z in ((0.0, 0.0), (10.0, 10.0), (40.0, 0.0))]
    roof = Surface.bspline(net, degree=(1, 1))
    path = Path(roof, [(0.0, 0.5), (1.0, 0.5)])
    # legs stay 1e-12 off a crease
    assert path.length == pytest.approx(np.hypot(10, 10) + np.hypot(30, 10), rel=1e-11)
    ridge = path.at(np.hypot(10, 10) + np.array([-1.0, 1.0]))
    np.testing.assert_allclose(ridge.point[:, 2], [10 - np.sqrt(0.5), 10 - 1 / np.sqrt(10)], rtol=1e-11)


def test_along_a_cylinder():
    path = Path(SURFACES["cylinder"], [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0)], mapping="equal_area")
    assert path.length == pytest.approx(10 * np.pi + 50, rel=1e-12)
    np.testing.assert_allclose(
        path.at(10 * np.pi / 3).point[0], [20 * np.cos(np.pi / 6), 0.0, 10.0], atol=1e-8
    )


@pytest.mark.parametrize("kind", ["sharp", "smooth", "rounded"])
@pytest.mark.parametrize("mapping", ["parametric", "equal_area"])
@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_inverse_of_length(kind, mapping, seed):
    rng = np.random.default_rng(seed)
    nodes = np.column_stack(
        [np.linspace(0.15, 0.85, 6) + rng.uniform(-0.03, 0.03, 6), rng.uniform(0.35, 0.65, 6)]
    )
    path = Path(SURFACES["steep"], nodes, mapping=mapping, smooth=kind == "smooth")
    path = path.blended() if kind == "rounded" else path
    asked = np.sort(rng.uniform(0, path.length, 50))
    found = path.at(asked)
    np.testing.assert_allclose(found.length, asked, atol=1e-8 * path.length)
    apart = np.linalg.norm(np.diff(found.point, axis=0), axis=1)
    assert np.all(apart <= np.diff(asked) + 1e-8 * path.length)


def test_kernels_do_as_legendre_says():
    rng = np.random.default_rng(2)
    series = np.column_stack([np.full(5, 3.0), rng.uniform(-0.3, 0.3, (5, 7))])
    interval, x, length, back = np.arange(5), rng.uniform(-1, 1, 5), np.empty(5), np.empty(5)
    travelled(series, interval, x, length)
    for row, at, found in zip(series, x, length, strict=True):
        assert found == pytest.approx(np.polynomial.legendre.Legendre(row).integ(lbnd=-1)(at), abs=1e-14)
    inverted(series, interval, length, back)
    np.testing.assert_allclose(back, x, atol=1e-14)


@pytest.mark.parametrize("step", [0.3, 5.0, 1000.0])
def test_samples_at_even_distances(step):
    path = hilbert(SURFACES["nominal"], 3)
    samples = path.sample(step=step)
    assert samples.length[0] == 0.0 and samples.length[-1] == pytest.approx(path.length, rel=1e-12)
    assert np.array_equal(np.unique(samples.run), np.arange(len(path.runs)))
    for run in range(len(path.runs)):
        own = np.diff(samples.length[samples.run == run])
        assert own.max() <= step * (1 + 1e-9)
        np.testing.assert_allclose(own, own.mean(), rtol=1e-7)
        assert (len(own) - 1) * step < own.sum() * (1 + 1e-9)


def test_samples_by_legs_hold_both_sides_of_a_corner():
    path = hilbert(SURFACES["crowded"], 3)
    samples = path.sample(per_leg=4)
    corners = sides(samples)
    assert len(samples.run) == 63 * 4 + 1 + len(corners) and len(corners) == 50
    np.testing.assert_array_equal(samples.point[corners], samples.point[corners + 1])
    np.testing.assert_array_equal(samples.length[corners], samples.length[corners + 1])
    turn = np.einsum("mc,mc->m", samples.tangent[corners], samples.tangent[corners + 1])
    assert np.all(np.abs(turn) < 0.9)
    assert np.all(np.diff(samples.length) >= 0)


def test_at_a_corner_the_path_is_on_what_follows():
    path = Path(FLAT, [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9)])
    corner = path.at([0.0, 8.0, 16.0])
    assert corner.run.tolist() == [0, 1, 1]
    np.testing.assert_allclose(corner.tangent, [[1, 0, 0], [0, 1, 0], [0, 1, 0]], atol=1e-12)
    assert path.at(3.0).point.shape == (1, 3)


def test_runs_end_at_corners():
    nodes = [(0.1, 0.1), (0.3, 0.1), (0.5, 0.1), (0.5, 0.4), (0.2, 0.4), (0.1, 0.4)]
    assert Path(FLAT, nodes).runs.tolist() == [[0, 2], [2, 3], [3, 5]]
    assert Path(FLAT, nodes[:3]).runs.tolist() == [[0, 2]]
    assert len(hilbert(FLAT, 4).runs) == 204 + 1


@pytest.mark.parametrize("mapping", ["parametric", "equal_area"])
def test_even_nodes_on_straight_legs_leave_the_path_as_it_is(mapping):
    path = hilbert(SURFACES["weighted"], 3, mapping=mapping)
    even = path.resampled(1.0)
    assert even.length == pytest.approx(path.length, rel=1e-9)
    assert len(even.runs) == len(path.runs)
    ends, found = path.points[path.runs[:, 1]], even.points[even.runs[:, 1]]
    np.testing.assert_allclose(found, ends, atol=1e-9)
    steps = np.diff(even.sample(per_leg=1).length)
    assert steps.max() <= 1.0 + 1e-9


def test_even_nodes_on_a_smooth_path_lie_on_it():
    path = hilbert(SURFACES["nominal"], 2).blended()
    even = path.resampled(0.25)
    assert even.smooth and even.deviation == 0 and len(even.runs) == 1
    assert even.length == pytest.approx(path.length, rel=1e-5)
    np.testing.assert_allclose(even.points, path.sample(step=0.25).point, atol=1e-9)


def test_there_and_back():
    path = Path(SURFACES["steep"], ACROSS, mapping="equal_area")
    back = path.reversed()
    assert back.length == pytest.approx(path.length, rel=1e-12)
    at = np.linspace(0.5, path.length - 0.5, 17)
    np.testing.assert_allclose(back.at(path.length - at).point, path.at(at).point, atol=1e-8)
    np.testing.assert_allclose(back.at(path.length - at).tangent, -path.at(at).tangent, atol=1e-8)
