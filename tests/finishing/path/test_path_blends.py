"""Rounded corners: how far they leave the sharp path, that direction and curvature are continuous, and their
closed form.
"""

import numpy as np
import pytest
from finishing_inside import furthest
from path_surfaces import FLAT, SURFACES
from scipy.spatial import cKDTree

from sdpgrind.finishing import Path, Surface, hilbert

SQUARE = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9)]


def apart(one, other):
    """Furthest that a point of one dense path is from the other, mm."""
    return cKDTree(other).query(one)[0].max()


def slack(samples, step, distance):
    """By how much the nearest sample may be further away than the nearest point, which is half a step beside
    it at most.
    """
    bend = np.linalg.norm(samples.curvature_vector, axis=1).max()
    return 0.5 * (0.5 * step) ** 2 * (1 / distance + bend) * 1.1


@pytest.mark.parametrize("mapping", ["parametric", "equal_area"])
@pytest.mark.parametrize("name", SURFACES)
def test_neither_path_leaves_the_other_by_more(name, mapping):
    sharp = hilbert(SURFACES[name], 3, mapping=mapping)
    deviation = 0.03 * sharp.pitch
    step = deviation / 10
    blended, straight = sharp.blended(deviation).sample(step=step), sharp.sample(step=step)
    furthest = max(apart(blended.point, straight.point), apart(straight.point, blended.point))
    assert 0.999 * deviation <= furthest <= deviation + slack(blended, step, deviation)


@pytest.mark.parametrize("name", SURFACES)
def test_one_run_of_continuous_direction_and_curvature(name):
    path = hilbert(SURFACES[name], 3).blended()
    assert path.runs.tolist() == [[0, 63]] and path.frames().shape == (64, 4, 4)
    ends = path.sample(per_leg=1).length[1:-1]
    before, after = path.at(ends - 1e-8), path.at(ends + 1e-8)
    scale = np.linalg.norm(path.sample().curvature_vector, axis=1).max()
    np.testing.assert_allclose(before.tangent, after.tangent, atol=1e-6)
    np.testing.assert_allclose(before.curvature_vector, after.curvature_vector, atol=2e-5 * scale)


def test_right_angle_in_closed_form():
    """Arms of d 16/3/sqrt 2; the middle is d away from the corner, and bends by 9/16/d, which is the most."""
    path = Path(FLAT, SQUARE, deviation=0.3)
    arm = 0.3 * 16 / 3 / np.sqrt(2)
    samples = path.sample(per_leg=400)
    bend = np.linalg.norm(samples.curvature_vector, axis=1)
    curved = samples.length[bend > 1e-9]
    assert curved[0] == pytest.approx(8.0 - arm, abs=arm / 100)
    assert bend.max() == pytest.approx(0.5625 / 0.3, rel=1e-6)
    assert np.linalg.norm(path.points[1] - [9.0, 1.0, 0.0]) == pytest.approx(0.3, rel=1e-8)
    np.testing.assert_allclose(path.points[1], [9 - 0.3 * np.sqrt(0.5), 1 + 0.3 * np.sqrt(0.5), 0], atol=1e-8)


@pytest.mark.parametrize("turn", [5.0, 45.0, 120.0, 175.0])
def test_any_angle(turn):
    way = np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
    corner = np.array([0.5, 0.4])
    path = Path(FLAT, [(0.1, 0.4), corner, corner + 0.35 * way], deviation=0.02)
    assert np.linalg.norm(path.points[1] - [5.0, 4.0, 0.0]) == pytest.approx(0.02, rel=1e-6)


def test_blends_of_neighbours_do_not_meet():
    path = hilbert(SURFACES["nominal"], 3)
    least = np.diff(path.sample(per_leg=1).length)
    rounded = path.blended(100.0)
    samples = rounded.sample()
    steps = np.diff(samples.length)
    assert np.all(steps > 0)
    assert np.isfinite(samples.curvature_vector).all()
    assert apart(samples.point, path.sample(step=0.05).point) < 0.5 * least[least > 0].max()
    assert rounded.length < path.length


def test_blends_between_curved_runs():
    nodes = [(0.1, 0.2), (0.3, 0.35), (0.5, 0.4), (0.5, 0.6), (0.6, 0.75), (0.8, 0.8)]
    corners = [False, False, True, True, False, False]
    sharp = Path(SURFACES["nominal"], nodes, corners=corners, smooth=True, mapping="equal_area")
    path = sharp.blended(0.1)
    ends = path.sample(per_leg=1).length[1:-1]
    before, after = path.at(ends - 1e-8), path.at(ends + 1e-8)
    np.testing.assert_allclose(before.curvature_vector, after.curvature_vector, atol=1e-4)
    samples = path.sample(step=0.01)
    furthest = apart(sharp.sample(step=0.01).point, samples.point)
    assert 0.0999 <= furthest <= 0.1 + slack(samples, 0.01, 0.1)


def test_default_deviation_is_a_twentieth_of_the_pitch():
    path = hilbert(FLAT, 3)
    assert path.blended().deviation == pytest.approx(0.05 * path.pitch)
    assert Path(FLAT, SQUARE[:2]).blended(0.1).length == 8.0  # no corner, nothing to round


def test_a_corner_that_turns_back_is_not_rounded():
    path = Path(FLAT, [(0.1, 0.1), (0.9, 0.1), (0.2, 0.1)])
    assert len(path.runs) == 2
    with pytest.raises(
        ValueError, match=r"a corner that turns back on itself cannot be rounded; the path does at nodes\[1\]"
    ):
        _ = path.blended(0.1).length


def wild(seed):
    """A rational surface that folds, with weights up to 20 times apart from 1."""
    rng = np.random.default_rng(seed)
    side = np.linspace(0, 50, 5)
    net = np.stack([*np.meshgrid(side, side, indexing="ij"), 12 * rng.standard_normal((5, 5))], axis=-1)
    net[..., :2] += rng.uniform(-14, 14, (5, 5, 2))
    return Surface.nurbs(net, np.exp(rng.uniform(-3, 3, (5, 5))))


@pytest.mark.parametrize("mapping", ["parametric", "equal_area"])
@pytest.mark.parametrize("seed", [3, 8])
def test_held_on_a_surface_that_folds(seed, mapping):
    """Long arms, too, over which legs bend and the pace changes."""
    sharp = hilbert(wild(seed), 2, mapping=mapping)
    for deviation in (0.1 * sharp.pitch, 0.4 * sharp.pitch):
        step = deviation / 80
        blended, straight = sharp.blended(deviation).sample(step=step).point, sharp.sample(step=step).point
        assert max(apart(blended, straight), apart(straight, blended)) <= deviation * (1 + 3e-3)


@pytest.mark.parametrize("turn", [150.0, 165.0, 175.0])
def test_held_at_an_acute_corner(turn):
    angle = np.radians(turn)
    path = Path(
        FLAT, [(0.1, 0.5), (0.5, 0.5), (0.5 + 0.4 * np.cos(angle), 0.5 + 0.4 * np.sin(angle))], deviation=0.05
    )
    samples = path.sample(step=1e-4).point
    assert np.linalg.norm(samples - [5.0, 5.0, 0.0], axis=1).min() <= 0.05 * (1 + 1e-3) + 1e-5


def test_distances_of_a_corner_are_their_slow_twin():
    """Every place against every straight line; one of them is a point."""
    rng = np.random.default_rng(2)
    point, line = rng.normal(size=(5, 7, 3)), rng.normal(size=(5, 4, 3))
    line[0, 1] = line[0, 2]
    start, leg = line[:, None, :-1], np.diff(line, axis=1)[:, None]
    offset = point[:, :, None] - start
    share = np.clip((offset * leg).sum(axis=-1) / np.maximum((leg**2).sum(axis=-1), 1e-300), 0.0, 1.0)
    away = np.linalg.norm(offset - share[..., None] * leg, axis=-1)
    out = np.empty(5)
    furthest(point, line, out)
    assert out == pytest.approx(away.min(axis=2).max(axis=1), rel=1e-12)
