"""Directions, curvature and frames along a path: against scipy's splines, against differences, and in closed
form.
"""

import numpy as np
import pytest
from path_surfaces import BALL, FLAT, SURFACES, sides
from scipy.interpolate import NdBSpline

from sdpgrind.base.stored import decode, encode
from sdpgrind.finishing import Path, hilbert
from sdpgrind.finishing.surface import nominal_surface, sphere_surface

MAPPINGS = ("parametric", "equal_area")
WAVE = [(0.1, 0.2), (0.3, 0.45), (0.5, 0.4), (0.7, 0.6), (0.9, 0.55)]


def wave(surface, mapping="parametric"):
    return Path(surface, WAVE, mapping=mapping, smooth=True)


@pytest.mark.parametrize("mapping", MAPPINGS)
def test_order_seven_agrees_with_ndbspline(mapping):
    surface = nominal_surface()
    path = hilbert(surface, 7, mapping=mapping)
    spline = NdBSpline(surface.knots, surface.control_points, surface.degree)
    orders = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    for found, nu in zip(path.derivatives(), orders, strict=True):
        expected = spline(path.uv, nu=nu)
        assert np.abs(found - expected).max() <= 1e-10 * max(1.0, np.abs(expected).max() / 50.0)
    assert np.abs(path.points - spline(path.uv)).max() <= 1e-10  # mm


def test_parametric_nodes_are_the_parameters():
    nodes = np.random.default_rng(1).uniform(0, 1, (20, 2))
    np.testing.assert_array_equal(Path(SURFACES["steep"], nodes).uv, nodes)


@pytest.mark.parametrize("mapping", MAPPINGS)
@pytest.mark.parametrize("name", SURFACES)
def test_frames_are_right_handed_along_feed_and_normal(name, mapping):
    surface = SURFACES[name]
    path = hilbert(surface, 3, mapping=mapping)
    frames, samples = path.frames(), path.sample(per_leg=1)
    assert frames.shape == (64 + 50, 4, 4)
    rotation = frames[:, :3, :3]
    np.testing.assert_allclose(
        rotation.transpose(0, 2, 1) @ rotation, np.broadcast_to(np.eye(3), rotation.shape), atol=1e-13
    )
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-13)
    np.testing.assert_allclose(frames[:, :3, 0], samples.tangent, atol=1e-13)
    np.testing.assert_allclose(frames[:, :3, 2], surface.normal(*samples.uv.T), atol=1e-13)
    np.testing.assert_array_equal(frames[:, :3, 3], samples.point)
    np.testing.assert_array_equal(frames[:, 3], np.broadcast_to([0, 0, 0, 1], (114, 4)))


def test_a_corner_has_two_frames_and_no_mean_of_them():
    frames = Path(FLAT, [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9)]).frames()
    np.testing.assert_allclose(frames[:, :3, 0], [[1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(frames[1:3, :3, 1], [[0, 1, 0], [-1, 0, 0]], atol=1e-15)


@pytest.mark.parametrize("mapping", MAPPINGS)
@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("kind", ["straight", "smooth", "rounded"])
def test_tangent_and_curvature_are_derivatives_by_length(name, mapping, kind):
    path = (
        hilbert(SURFACES[name], 2, mapping=mapping) if kind == "straight" else wave(SURFACES[name], mapping)
    )
    if kind == "rounded":
        path = hilbert(SURFACES[name], 2, mapping=mapping).blended()
    h = 1e-4
    at = np.random.default_rng(5).uniform(0.01, 0.99, 60) * path.length
    before, here, after = path.at(at - h), path.at(at), path.at(at + h)
    inside = (before.run == after.run) & (np.abs(before.length - at + h) < 1e-9)
    tangent = (after.point - before.point) / (2 * h)
    curvature = (after.tangent - before.tangent) / (2 * h)
    scale = 1.0 + np.abs(here.curvature_vector[inside]).max()
    assert inside.sum() > 40
    np.testing.assert_allclose(tangent[inside], here.tangent[inside], atol=1e-6 * scale)
    off = np.abs(curvature - here.curvature_vector)[inside].max(axis=1)
    assert np.median(off) <= 1e-6 * scale
    # the others have the end of a piece, or a knot, within their difference
    assert np.mean(off <= 1e-3 * scale) >= 0.9


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("mapping", MAPPINGS)
def test_any_curve_on_a_ball_bends_by_its_radius(mapping, inside):
    """Meusnier: along the normal a curve's curvature is that of the surface, the same in all directions on a
    ball.
    """
    ball = sphere_surface(20.0, inside=inside)
    for path in (
        hilbert(ball, 3, mapping=mapping),
        hilbert(ball, 3, mapping=mapping).blended(),
        wave(ball, mapping),
    ):
        samples = path.sample()
        bend = np.einsum("mc,mc->m", samples.curvature_vector, samples.normal)
        np.testing.assert_allclose(bend, (1 if inside else -1) / 20.0, rtol=1e-10)
        np.testing.assert_allclose(
            np.einsum("mc,mc->m", samples.curvature_vector, samples.tangent), 0.0, atol=1e-10
        )


def test_a_node_on_a_pole_has_the_normal_of_the_limit():
    path = Path(BALL, [(0.5, 0.5), (0.5, 1.0)])
    np.testing.assert_allclose(path.frames()[-1, :3, 2], [0.0, 0.0, 1.0], atol=1e-9)


def test_circle_on_a_flat():
    angle = np.linspace(0.0, np.pi, 41)
    path = Path(FLAT, 0.5 + 0.4 * np.column_stack([np.cos(angle), np.sin(angle)]), smooth=True)
    samples = path.sample()
    inner = (samples.length > 1.0) & (samples.length < path.length - 1.0)
    bend = np.linalg.norm(samples.curvature_vector, axis=1)
    np.testing.assert_allclose(bend[inner], 1 / 4.0, rtol=4e-3)
    assert path.length == pytest.approx(4 * np.pi, rel=1e-5)


def test_smooth_paths_have_no_jump_of_direction_or_curvature_at_their_nodes():
    path = wave(SURFACES["nominal"])
    legs = path.sample(per_leg=4)
    np.testing.assert_allclose(legs.point[::4], path.points, atol=1e-12)
    at = legs.length[4:-4:4]
    before, after = path.at(at - 1e-7), path.at(at + 1e-7)
    np.testing.assert_allclose(before.tangent, after.tangent, atol=1e-6)
    np.testing.assert_allclose(before.curvature_vector, after.curvature_vector, atol=1e-6)


def test_smooth_paths_keep_the_sharp_corners_that_are_named():
    corners = [False, False, True, False, False]
    path = Path(FLAT, WAVE, corners=corners, smooth=True)
    assert path.runs.tolist() == [[0, 2], [2, 4]]
    samples = path.sample()
    assert len(sides(samples)) == 1
    (corner,) = sides(samples)
    assert samples.tangent[corner] @ samples.tangent[corner + 1] < 0.999


def test_paths_are_values():
    path = hilbert(SURFACES["weighted"], 3).replace(corners=np.arange(64) % 1 == 0, deviation=0.1)
    again = decode(encode(path))
    assert again == path and hash(again) == hash(path)
    np.testing.assert_array_equal(again.frames(), path.frames())
    assert again != path.replace(deviation=0.2) and again != path.replace(corners=None)
    assert path.reversed().reversed() == path
