"""Following the probe: the linear law, the braking speed, the map of gains."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from push_inside import braking_speed

from centering.cycle import Follower, FollowingGains, FollowingLimits, tune_following
from sdpgrind import units

GAP = 7.928  # mm


def test_error_gain_of_the_specification():
    assert FollowingGains(25.0, 60.0).error_gain(units.rpm(20)) == pytest.approx(0.057427, rel=1e-5)


@settings(deadline=None)
@given(st.floats(5.0, 40.0), st.floats(0.0, 200.0), st.floats(1.0, 10.0))
def test_error_gain_is_that_of_the_loop(kp, ki, w):
    """Response of e' = r' - Kp e - Ki integral e to r = cos wt, from its state space."""
    a = np.array([[-kp, -ki], [1.0, 0.0]])
    transfer = np.linalg.solve(1j * w * np.eye(2) - a, np.array([1j * w, 0.0]))[0]
    assert FollowingGains(kp, ki).error_gain(w) == pytest.approx(abs(transfer), rel=1e-9)


def test_small_deviations_follow_the_linear_law():
    """A slow small sine under a fine sample time: amplitude of the deviation as the formula says, to the
    order of the sample.
    """
    gains, w, step = FollowingGains(25.0, 60.0), units.rpm(20), 1e-4
    follower = Follower(gains, FollowingLimits(sample_time=step))
    place, seen = 0.0, []
    for k in range(150_000):
        rim = 0.5 * np.sin(w * k * step)
        seen.append(rim - place)
        place += step * follower.step(rim - place)
    assert max(np.abs(seen[-60_000:])) == pytest.approx(0.5 * gains.error_gain(w), rel=1e-2)


@settings(deadline=None)
@given(st.floats(1e-6, 50.0))
def test_braking_speed_stops_within_the_distance(distance):
    limits = FollowingLimits()
    v = braking_speed(distance, limits)
    assert v * limits.sample_time + v * v / (2 * limits.acceleration) == pytest.approx(
        distance, rel=1e-9, abs=1e-12
    )


def _step_response(gains, integral_before=0.0):
    limits, follower = FollowingLimits(), Follower(gains)
    place = speed = 0.0
    places = []
    for _ in range(200):
        wanted = follower.step(GAP - place)
        for _ in range(100):
            change = np.clip(wanted - speed, -limits.acceleration * 1e-4, limits.acceleration * 1e-4)
            place, speed = place + (speed + change / 2) * 1e-4, speed + change
            places.append(place)
    return np.array(places)


def test_a_whole_gap_does_not_wind_up():
    """Without the standing integral the same gains overshoot by far more than the braking law lets them."""
    with_integral = _step_response(FollowingGains(32.0, 60.0)).max() / GAP - 1
    naive = 60.0 * 0.1 / 32.0  # an integral that ran for the 0.1 s of saturation, over Kp
    assert with_integral < 0.3 * naive


def test_no_gains_are_faster_than_the_slide():
    found = tune_following(step=GAP, proportional=np.linspace(5.0, 60.0, 12), integral=[0.0, 60.0])
    sure = found.overshoot < 1e-9
    assert sure.any()
    assert found.settling_time[sure].min() >= 0.10507 - 1e-3  # looked at every ms
    assert FollowingLimits().least_time(GAP) == pytest.approx(0.1129, abs=1e-4)


def test_the_map_is_the_objective_and_gains_its_least():
    kp, ki = np.array([10.0, 32.0, 50.0]), np.array([0.0, 60.0])
    found = tune_following(proportional=kp, integral=ki, settling_nominal=0.2, overshoot_nominal=0.1)
    assert np.allclose(found.objective, found.settling_time / 0.2 + found.overshoot / 0.1)
    i, j = np.unravel_index(np.argmin(found.objective), (3, 2))
    assert found.gains == FollowingGains(kp[i], ki[j])
    places = _step_response(FollowingGains(32.0, 0.0))
    late = 1e-4 * (np.flatnonzero(np.abs(places / GAP - 1) > 0.01)[-1] + 1)
    assert found.settling_time[1, 0] == pytest.approx(late, abs=2e-3)


def test_short_moves_are_triangles():
    assert FollowingLimits().least_time(1.0) == pytest.approx(2 * np.sqrt(1.0 / 2560.0), rel=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FollowingGains(0.0, 1.0), "proportional must be > 0 .1/s.; got 0.0"),
        (lambda: FollowingGains(1.0, -1.0), "integral must be >= 0 .1/s.2.; got -1.0"),
        (lambda: FollowingLimits(speed=0.0), "speed must be > 0 .mm/s."),
        (lambda: FollowingLimits().least_time(0.0), "distance must be > 0 .mm."),
        (lambda: FollowingGains().error_gain(float("nan")), "frequency must be finite .rad/s."),
        (lambda: tune_following(step=-1.0), "step must be > 0 .mm."),
        (lambda: tune_following(proportional=[0.0]), "proportional must be > 0 .1/s."),
        (lambda: tune_following(integral=[-1.0]), "integral must be >= 0 .1/s.2."),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_map_is_equal_by_value_and_says_what_it_is_in_a_line():
    one, two = (tune_following(proportional=[5.0, 32.0], integral=[0.0, 60.0]) for _ in range(2))
    assert one == two and hash(one) == hash(two) and one != two.replace(objective=two.objective + 1.0)
    assert repr(one) == "FollowingMap(2 x 2 gains, the best FollowingGains(proportional=32.0, integral=0.0))"
    assert not one.objective.flags.writeable
