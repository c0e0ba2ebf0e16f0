"""What the exchanges and proofs are made of, each against a slow and obvious twin."""

import numpy as np
import pytest
from circle_inside import (
    _across,
    _cell_bound,
    _crossing,
    _four_about,
    _height,
    _parting,
    _ranked,
    _standing,
    ball,
    empty_reach,
    extremes,
    gaps,
    steepness,
    zone_reach,
)
from circle_twins import distances, on_rays, random_profile
from scipy.spatial import ConvexHull

from sdpgrind.base.compiling.compiled import opened

across = opened(_across)
cell_bound = opened(_cell_bound)
crossing = opened(_crossing)
four_about = opened(_four_about)
height = opened(_height)
parting = opened(_parting)
ranked = opened(_ranked)
standing = opened(_standing)

RNG = np.random.default_rng(11)


def arrays(points):
    return np.ascontiguousarray(points.T)


def unit(angle):
    return np.array([np.cos(angle), np.sin(angle)]).T


@pytest.mark.parametrize("sampling", ["even", "uneven", "gap", "turns", "repeated"])
@pytest.mark.parametrize("n", [6, 30, 400])
def test_gaps_are_those_between_sorted_directions(n, sampling):
    points = random_profile(RNG, n, sampling, 0.05)
    angle = np.sort(np.arctan2(*(points - [3, -2]).T[::-1]))
    steps = np.diff(angle, append=angle[0] + 2 * np.pi)
    largest, second, middle = gaps(*arrays(points), 3.0, -2.0)
    bin_width = 4 * np.pi / 512
    assert max(steps.max(), bin_width) == pytest.approx(largest, abs=1e-9)
    assert max(np.sort(steps)[-2], bin_width) <= second + 1e-9 <= max(np.sort(steps)[-2], bin_width) + 2e-9
    if np.sort(steps)[-2] < steps.max() - 1e-9:
        before = angle[np.argmax(steps)]
        assert np.cos(middle - before - steps.max() / 2) == pytest.approx(1, abs=1e-12)


def test_order_is_that_of_numpy():
    for n in (0, 1, 2, 5, 64, 1000):
        values = RNG.integers(0, n + 1, n).astype(float)
        assert values[ranked(values)].tolist() == np.sort(values).tolist()


@pytest.mark.parametrize("n", [4, 8, 64, 65, 900])
def test_four_points_alternate_from_the_start(n):
    points = random_profile(RNG, n, "uneven", 0.05)
    basis = np.zeros(4, dtype=np.int64)
    four_about(*arrays(points), 3.0, -2.0, basis)
    assert len(set(basis)) == 4
    assert parting(*arrays(points), 3.0, -2.0, *basis) > 0


def test_extremes_and_crossings():
    points = random_profile(RNG, 50, "uneven", 0.1)
    away = distances(points, (1.0, 2.0))[0]
    assert extremes(*arrays(points), 1.0, 2.0) == pytest.approx(
        (away.argmax(), away.max(), away.argmin(), away.min()), rel=1e-15
    )
    center = crossing(*arrays(points), 3, 17, 8, 40)
    away = distances(points, center)[0]
    assert away[3] == pytest.approx(away[17], rel=1e-13) and away[8] == pytest.approx(away[40], rel=1e-13)
    assert np.isinf(crossing(*arrays(on_rays(np.radians([0.0, 90, 180, 270]), 1.0)), 0, 1, 2, 3)).all()


def test_parting_and_standing_are_by_angle():
    for _ in range(200):
        angle = RNG.uniform(0, 2 * np.pi, 4)
        x, y = arrays(on_rays(angle, RNG.uniform(1, 2, 4)))
        order = np.argsort(angle)
        alternates = abs(int(np.flatnonzero(order == 0)[0]) - int(np.flatnonzero(order == 1)[0])) == 2
        assert (parting(x, y, 0.0, 0.0, 0, 1, 2, 3) > 0) == alternates
        three = np.sort(angle[:3])
        assert (standing(x, y, 0.0, 0.0, 0, 1, 2) > 0) == (
            np.diff(three, append=three[0] + 2 * np.pi).max() < np.pi
        )


@pytest.mark.parametrize("zone", [True, False])
def test_steepness_is_the_least_slope_of_all_directions(zone):
    for _ in range(20):
        angle = RNG.uniform(0, 2 * np.pi, 4)
        basis = np.arange(4)
        found = steepness(*arrays(on_rays(angle, 50.0)), 0.0, 0.0, basis, zone)
        way = unit(np.linspace(0, 2 * np.pi, 7201))
        slopes = unit(angle) @ way.T
        rise = slopes[2:].max(axis=0) - slopes[:2].min(axis=0) if zone else slopes[:3].max(axis=0)
        assert (found > 0) == (rise.min() > 0)
        if found > 0:
            assert found == pytest.approx(rise.min(), abs=2e-3)


@pytest.mark.parametrize("zone", [True, False])
def test_no_centre_in_the_ball_of_contacts_is_better(zone):
    """The lower bound of the contacts alone, at random centers in the ball of four or three that stand about
    the origin.
    """
    angle = np.array([0.2, 3.5, 1.4, 4.9]) if zone else np.array([0.2, 2.1, 4.4])
    x, y = arrays(on_rays(angle, np.array([50.4, 50.4, 50.0, 50.0]) if zone else 50.0))
    basis = np.arange(angle.size)
    reach = ball(steepness(x, y, 0.0, 0.0, basis, zone), 50.0)
    assert reach > 5.0
    centers = unit(RNG.uniform(0, 7, 5000)) * reach * np.sqrt(RNG.uniform(0, 1, (5000, 1)))
    away = distances(np.column_stack([x, y]), centers)
    values = away[:, :2].max(axis=1) - away[:, 2:].min(axis=1) if zone else -away.min(axis=1)
    assert values.min() >= height(x, y, 0.0, 0.0, zone) - 1e-12


@pytest.mark.parametrize("n", [3, 12, 100])
def test_the_nearest_point_across(n):
    for _ in range(20):
        points = random_profile(RNG, n, "uneven", 0.05)
        x, y = arrays(points)
        near = int(RNG.integers(n))
        away = points - [3, -2]
        direction = away / np.hypot(*away.T)[:, np.newaxis]
        behind = np.flatnonzero(direction @ direction[near] < -0.5)
        nearest = behind[np.hypot(*away[behind].T).argmin()] if behind.size else near
        assert across(x, y, 3.0, -2.0, near) == nearest


@pytest.mark.parametrize("zone", [True, False])
@pytest.mark.parametrize("around", [1e-3, 0.1, 5.0])
def test_no_centre_of_a_square_is_below_its_bound(zone, around):
    for _ in range(20):
        x, y = arrays(random_profile(RNG, 12, "uneven", 0.05) - [3, -2])
        contacts = RNG.integers(0, 12, 4)
        cx, cy = RNG.uniform(-5, 5, 2)
        value, below = cell_bound(x, y, cx, cy, around, zone, x[contacts], y[contacts])
        assert value == pytest.approx(height(x, y, cx, cy, zone), abs=1e-12)
        for ex, ey in unit(RNG.uniform(0, 7, 100)) * around * RNG.uniform(0, 1, (100, 1)):
            assert height(x, y, cx + ex, cy + ey, zone) >= below - 1e-12


@pytest.mark.parametrize("sampling", ["even", "uneven", "gap"])
def test_no_centre_beyond_reach_is_better(sampling):
    for _ in range(10):
        points = random_profile(RNG, 60, sampling, 0.02)
        x, y = arrays(points - [3, -2])
        largest, second, _ = gaps(x, y, 0.0, 0.0)
        _, outer, _, inner = extremes(x, y, 0.0, 0.0)
        reach = zone_reach(outer - inner, inner, largest, second)
        assert reach < 0.5 * inner
        way = unit(np.linspace(0, 2 * np.pi, 60))
        for t in np.linspace(reach, 0.5 * inner, 20):
            assert np.ptp(distances(points - [3, -2], t * way), axis=1).min() >= outer - inner - 1e-12
        reach = empty_reach(inner, outer, largest)
        hull = ConvexHull(points - [3, -2]).equations
        for t in np.linspace(reach, outer, 20):
            inside = t * way[(t * way @ hull[:, :2].T + hull[:, 2] <= 0).all(axis=1)]
            assert distances(points - [3, -2], inside).min(axis=1).max(initial=0) <= inner + 1e-12
