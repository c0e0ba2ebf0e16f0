"""Surfaces whose tangents jump: a crease that is crossed is a sharp corner; maps and passes that cannot bear
one refuse it.
"""

from itertools import pairwise

import numpy as np
import pytest
from finishing_inside import creases

from sdpgrind.finishing import Path, Surface, hilbert, zigzag
from sdpgrind.finishing.surface import flat_surface, uneven_surfaces


def net(x, z):
    """Control points over x by x (mm) at heights z."""
    return np.stack([*np.meshgrid(x, x, indexing="ij"), z], axis=-1)


LIFTED = Surface.bspline(net([0, 25, 50], [[0, 0, 0], [0, 0, 0], [0, 0, 25.0]]), degree=(1, 1))
FOLDED = Surface.bspline(net([0, 20, 50], [[0, 0, 0], [0, 0, 20], [0, 0, 55.0]]), degree=(1, 1))
EVEN = Surface.bspline(net([0, 25, 50], np.zeros((3, 3))), degree=(1, 1))


def angles(samples):
    """Turns from sample to sample, rad."""
    cross = np.linalg.norm(np.cross(samples.tangent[1:], samples.tangent[:-1]), axis=1)
    return np.arctan2(cross, np.einsum("ij,ij->i", samples.tangent[1:], samples.tangent[:-1]))


@pytest.mark.parametrize(
    "nodes", [[(0.1, 0.8), (0.9, 0.8)], [(0.1, 0.8), (0.5, 0.8), (0.9, 0.8)], [(0.9, 0.8), (0.1, 0.8)]]
)
def test_a_crease_is_a_corner(nodes):
    """z = 25 (2 u - 1) (2 v - 1) behind u = 1/2: the slope 30/50 begins there, whichever way it is crossed."""
    path = Path(LIFTED, nodes)
    samples = path.sample(step=0.5)
    turn, same = angles(samples), np.diff(samples.run) == 0
    assert turn[same].max() < 1e-7
    np.testing.assert_allclose(turn[~same], [np.arctan(0.6)], atol=1e-9)
    assert path.length == pytest.approx(20 + 20 * np.hypot(1, 0.6), abs=1e-8)
    assert (
        np.abs(np.linalg.norm(np.diff(samples.point, axis=0), axis=1) - np.diff(samples.length)).max() < 1e-9
    )
    at = path.at([19.999, 20.001] if nodes[0][0] < 0.5 else [path.length - 20.001, path.length - 19.999])
    assert angles(at)[0] == pytest.approx(np.arctan(0.6), abs=1e-9)


def test_both_frames_at_a_node_on_a_crease():
    """Direction and normal are those of each side."""
    path = Path(LIFTED, [(0.1, 0.8), (0.5, 0.8), (0.9, 0.8)])
    frames = path.frames()
    assert path.runs.tolist() == [[0, 1], [1, 2]] and frames.shape == (4, 4, 4)
    np.testing.assert_allclose(frames[1, :3, 0], [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(frames[1, :3, 2], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(frames[2, :3, 0], np.array([1, 0, 0.6]) / np.hypot(1, 0.6), atol=1e-9)
    slope = np.array([-0.6, 0, 1]) / np.hypot(1, 0.6)
    np.testing.assert_allclose(frames[2, :3, 2], slope, atol=1e-9)


def test_along_a_crease_and_up_to_one_there_is_no_corner():
    for nodes in ([(0.5, 0.1), (0.5, 0.6), (0.5, 0.9)], [(0.1, 0.8), (0.5, 0.8)], [(0.1, 0.2), (0.9, 0.2)]):
        assert np.unique(Path(LIFTED, nodes).sample().run).size == 1


def test_a_path_over_creases_by_its_points_alone():
    path = hilbert(FOLDED, 3, mapping="parametric")
    samples = path.sample(step=0.2)
    same = np.diff(samples.run) == 0
    step = np.linalg.norm(np.diff(samples.point, axis=0), axis=1)
    assert angles(samples)[same].max() < 0.2 / 5 and np.abs(step - np.diff(samples.length)).max() < 1e-4
    again = path.resampled(3.0)
    assert again.length == pytest.approx(path.length, abs=1e-6)
    assert again.reversed().sample().run[-1] == path.sample().run[-1] > 50


def test_where_tangents_do_not_jump():
    assert creases(EVEN) == creases(flat_surface()) == creases(uneven_surfaces()["steep"]) == ()
    assert hilbert(EVEN, 3).length == pytest.approx(63 * 50 / 8, rel=1e-9)
    knots = [0, 0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1, 1]
    bent = Surface.bspline(
        net(np.linspace(0, 50, 7), np.tile([0, 0, 0, 0, 3, 6, 9.0], (7, 1))), knots=(knots, knots)
    )
    assert [(each.axis, each.place, each.times) for each in creases(bent)] == [(1, 0.5, 3)]


@pytest.mark.parametrize("along", ["u", "v"])
@pytest.mark.parametrize("pitch", [1.0, 1.7, 2.3, 4.0])
def test_gaps_of_a_zigzag_across_creases(along, pitch):
    """Rows right before the crease count, too: there lines lie further apart than behind it."""
    surface = FOLDED.replace(control_points=FOLDED.control_points[::-1, ::-1].copy(), outward=1)
    path = zigzag(surface, pitch, along=along)
    side = 1 if along == "u" else 0
    lines = np.unique(path.nodes[:, side].round(12))
    rows = np.append(np.linspace(0, 1, 101), 0.5 - 1e-9)
    for low, high in pairwise(lines):
        across = low + (high - low) * (np.arange(400) + 0.5) / 400
        d = surface.grid(*((rows, across) if side else (across, rows)))
        gap = np.linalg.norm(np.cross(d.u, d.v), axis=-1) / np.linalg.norm(d.u if side else d.v, axis=-1)
        assert (high - low) * gap.mean(axis=side).max() <= pitch * (1 + 2e-3)


def test_equal_areas_and_geodesic_passes():
    message = r"mapping must be another one than '{}' on a surface whose tangents jump: its knot u = 0.5 is there 1 times at degree 1"
    with pytest.raises(ValueError, match=message.format("equal_area")):
        _ = Path(LIFTED, [(0.1, 0.5), (0.9, 0.5)], mapping="equal_area").length
    with pytest.raises(ValueError, match=message.format("geodesic")):
        zigzag(LIFTED, 3.0, mapping="geodesic")


def test_rounding_and_tears():
    with pytest.raises(
        ValueError,
        match=r"deviation must be 0 on a path that crosses a crease .* its leg 0 does; got 0.1 \(mm\)",
    ):
        _ = Path(LIFTED, [(0.1, 0.8), (0.9, 0.8)], deviation=0.1).length
    x, y = np.meshgrid([0, 20, 30, 50], [0, 50], indexing="ij")
    torn = Surface.bspline(
        np.stack([x, y, 0 * x], axis=-1), degree=(1, 1), knots=([0, 0, 0.5, 0.5, 1, 1], [0, 0, 1, 1])
    )
    message = r"keep off where its surface is torn; leg 0 crosses a tear: the knot u = 0.5 is there 2 times at degree 1"
    with pytest.raises(ValueError, match=message):
        _ = Path(torn, [(0.1, 0.5), (0.9, 0.5)]).length
    assert Path(torn, [(0.6, 0.5), (0.9, 0.5)]).length == pytest.approx(12.0)
