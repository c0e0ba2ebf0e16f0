"""Geometry under the proofs: smallest balls, least rooms, motion over azimuths, each found in another way."""

import numpy as np
import pytest
from placement_inside import (
    AzimuthRange,
    ToolHold,
    enclosing_ball,
    in_base,
    least_room,
    on_work,
    ranges,
    spread,
    swept,
    task_of,
    turned_back,
    widths,
    wrist_travels,
)

from sdpgrind import finishing
from sdpgrind.finishing.surface import sphere_surface

ARM = finishing.Arm.generic()
BALL = finishing.zigzag(sphere_surface(50.0), pitch=8.0)


def task(path=BALL, heading="fixed", pushed=False):
    return task_of(ARM, path.sample(per_leg=1), ToolHold(np.pi / 6, 95.0, heading, pushed))


@pytest.mark.parametrize("seed", range(6))
def test_the_ball_is_the_smallest(seed):
    """Its centre is a mean of points on it: proved; a search by another method finds no smaller one."""
    points = np.random.default_rng(seed).normal(size=(60, 3)) * [30.0, 20.0, 10.0 if seed % 2 else 0.0]
    ball = enclosing_ball(points)
    away = np.linalg.norm(points - ball.centre, axis=1)
    assert away.max() <= ball.radius * (1 + 1e-11)
    assert np.abs(away[list(ball.support)] - ball.radius).max() < 1e-9
    weights = np.array(ball.weights)
    assert weights.min() >= 0 and weights.sum() == pytest.approx(1.0)
    assert np.abs(weights @ points[list(ball.support)] - ball.centre).max() < 1e-9
    assert ball.proved(points) == pytest.approx(ball.radius, rel=1e-12)
    centre = points[0].copy()  # Badoiu and Clarkson: ever smaller steps to the farthest point
    for k in range(1, 4000):
        centre += (points[np.linalg.norm(points - centre, axis=1).argmax()] - centre) / (k + 1)
    assert ball.radius <= np.linalg.norm(points - centre, axis=1).max() <= ball.radius * 1.01


def test_balls_in_closed_form():
    cube = np.array(np.meshgrid(*[[0.0, 2.0]] * 3)).reshape(3, -1).T
    assert enclosing_ball(cube).radius == pytest.approx(np.sqrt(3.0))
    line = np.outer([0.0, 1.0, 5.0, 9.0], [1.0, 2.0, 2.0])
    assert enclosing_ball(line).radius == pytest.approx(13.5)
    assert enclosing_ball(np.ones((5, 3))).radius == 0.0
    assert enclosing_ball(np.repeat(line, 3, axis=0)).radius == pytest.approx(13.5)


def test_a_proved_distance_does_not_rest_on_the_radius():
    points = np.random.default_rng(3).normal(size=(20, 3))
    ball = enclosing_ball(points)
    shares = np.random.default_rng(4).dirichlet(np.ones(len(ball.support)))
    other = ball._replace(weights=tuple(shares), radius=99.0)
    assert 0 < other.proved(points) <= ball.radius


@pytest.mark.parametrize("sides", [(40.0, 40.0), (60.0, 25.0), (20.0, 80.0), (1e3, 1e3)])
@pytest.mark.parametrize("seed", range(3))
def test_the_room_is_the_least(sides, seed):
    """No turn of a fine grid needs less; the grid's best is above by its step times the size at most."""
    points = np.random.default_rng(seed).normal(size=(40, 2)) * [20.0, 8.0]
    room = least_room(points, sides)
    turns = np.linspace(0, 2 * np.pi, 20001)
    excess = np.maximum(widths(points, turns) - sides[0], widths(points, turns + np.pi / 2) - sides[1])
    assert room.excess <= excess.min() + 1e-9
    assert excess.min() - room.excess < np.ptp(points, axis=0).max() * 2 * (turns[1] - turns[0])
    c, s = np.cos(room.turn), np.sin(room.turn)
    turned = points @ np.array([[c, -s], [s, c]])  # x along the turn
    assert np.ptp(turned, axis=0) == pytest.approx(room.needed)


def test_rooms_in_closed_form():
    square = np.array([[0.0, 0.0], [450.0, 0.0], [450.0, 450.0], [0.0, 450.0]])
    assert least_room(square, (400.0, 400.0)).excess == pytest.approx(50.0)
    tilted = square @ np.array([[0.8, 0.6], [-0.6, 0.8]])
    assert least_room(tilted, (400.0, 400.0)).excess == pytest.approx(50.0)
    line = np.outer(
        np.linspace(0, 1, 7), [300.0, 400.0]
    )  # fits at 45 deg at the latest: 500/sqrt(2) each way
    assert least_room(line, (100.0, 100.0)).excess == pytest.approx(500 / np.sqrt(2) - 100)
    assert least_room(np.zeros((3, 2)), (5.0, 7.0)).excess == -5.0


@pytest.mark.parametrize("pushed", [False, True])
def test_vectors_of_the_tool_are_those_of_its_poses(pushed):
    given, vector = task(pushed=pushed), np.array([3.0, -2.0, 5.0])
    for azimuth in (0.3, 2.0, -1.1):
        turn = given.poses(azimuth)[:, :3, :3]
        found = swept(given, AzimuthRange(azimuth, 0.0), vector)
        assert np.abs(found.vectors - turned_back(turn @ vector, azimuth)).max() < 1e-12
        assert not found.off.any()


@pytest.mark.parametrize("seed", range(4))
def test_vectors_move_no_farther_than_bounded(seed):
    rng = np.random.default_rng(seed)
    given, vector, tightest = task(), rng.normal(size=3), 0.0
    for _ in range(60):
        over = AzimuthRange(rng.uniform(-7, 7), 10.0 ** rng.uniform(-3, -0.7))
        bound = swept(given, over, vector)
        there = over.centre + over.half * rng.uniform(-1, 1)
        moved = np.linalg.norm(swept(given, AzimuthRange(there, 0.0), vector).vectors - bound.vectors, axis=1)
        assert (moved <= bound.off * (1 + 1e-9) + 1e-12).all()
        tightest = max(tightest, float((moved / bound.off).max()))
    assert tightest > 0.7  # the bound is no idle one


def test_ranges_hold_every_azimuth_once():
    found = sorted(ranges(task()))
    ends = np.array([[each.centre - each.half, each.centre + each.half] for each in found])
    assert np.abs(ends[1:, 0] - ends[:-1, 1]).max() < 1e-12
    assert ends[-1, 1] - ends[0, 0] == pytest.approx(2 * np.pi)
    assert ranges(task(heading="feed_aligned")) == [AzimuthRange(0.0, 0.0)]


def test_azimuths_go_both_ways():
    for azimuth, turn in np.random.default_rng(0).uniform(-3.1, 3.1, (50, 2)):
        assert in_base(on_work(azimuth, turn), turn) == pytest.approx(azimuth)


def test_poses_are_spread_by_the_farthest_point():
    """Each taken pose is at least as far from those before it as any other pose is then."""
    given = task()
    places = np.column_stack([given.point, 95.0 * given.normal])
    taken = spread(given, 12)
    for k in range(1, 12):
        nearest = np.linalg.norm(places[:, None] - places[taken[:k]], axis=2).min(axis=1)
        assert nearest[taken[k]] == nearest.max()
    assert len(set(spread(given, 10_000).tolist())) == len(given.point)


@pytest.mark.parametrize("radius", [200.0, 350.0, 480.0, 520.0])
def test_the_travel_of_the_wrist_is_that_of_its_joints(radius):
    """Heights of random q2, q3 within their limits at the radius: none outside, some near both ends."""
    arm = ARM.replace(wrist_radius=radius)
    q2 = np.random.default_rng(0).uniform(arm.position_min[1], arm.position_max[1], 200_000)
    share, heights = (radius - arm.a2 * np.cos(q2)) / arm.a3, []
    for sign in (1.0, -1.0):
        whole = sign * np.arccos(np.clip(share, -1, 1))  # q2 + q3
        q3 = np.mod(whole - q2 + np.pi, 2 * np.pi) - np.pi
        held = (np.abs(share) <= 1) & (q3 >= arm.position_min[2]) & (q3 <= arm.position_max[2])
        heights += (arm.a2 * np.sin(q2) + arm.a3 * np.sin(whole))[held].tolist()
    travels = np.array(wrist_travels(arm))
    assert travels.min() <= min(heights) and max(heights) <= travels.max()
    # near a stretched arm heights change as the root of q2: 400 mm * sqrt(2 * 1e-4 rad) at the most
    assert min(heights) - travels.min() < 4 and travels.max() - max(heights) < 4


def test_a_radius_out_of_reach_has_no_travel():
    assert wrist_travels(ARM.replace(wrist_radius=700.0)) == [(-np.inf, np.inf)]
