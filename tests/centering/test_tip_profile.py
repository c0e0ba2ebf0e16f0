"""Motions of the pusher tip, and pushes that leave the part where they shall."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reaction_twins import tip_at

from centering import TipProfile, preset, simulate_push
from centering.push import gentle_profile, move_time, simulate_pushes, tap_profile

sizes = st.floats(1e-3, 20.0)
speeds = st.floats(0.5, 120.0)
PARAMETERS = preset("printed").model.parameters
accelerations = st.floats(100.0, 2560.0)


@given(sizes, speeds, accelerations, st.sampled_from([1.0, -1.0]))
def test_a_move_goes_from_rest_to_rest_in_least_time(size, speed, acceleration, way):
    profile = TipProfile.move(way * size, speed, acceleration)
    assert profile.stroke == pytest.approx(way * size, rel=1e-9)
    assert profile.final_velocity == pytest.approx(0.0, abs=1e-9 * speed)
    assert profile.total_time == pytest.approx(
        move_time(size, speed=speed, acceleration=acceleration), rel=1e-9
    )
    assert np.abs(profile.velocity).max() <= speed * (1 + 1e-12)


@given(sizes, speeds, accelerations, st.floats(1e3, 1e6))
def test_a_jerk_limited_move_keeps_its_limits(size, speed, acceleration, jerk):
    profile = TipProfile.jerk_limited(size, speed, acceleration, jerk)
    assert profile.stroke == pytest.approx(size, rel=1e-9)
    assert profile.final_velocity == pytest.approx(0.0, abs=1e-9 * speed)
    assert profile.total_time == pytest.approx(
        move_time(size, speed=speed, acceleration=acceleration, jerk=jerk), rel=1e-9
    )
    assert np.abs(profile.acceleration).max() <= acceleration * (1 + 1e-12)
    assert (
        np.abs(profile.velocity[1:] - (profile.velocity + profile.acceleration * profile.duration)[:-1]).max()
        < 1e-9 * speed
    )


@settings(deadline=None)
@given(sizes, speeds, accelerations)
def test_a_move_leaves_the_part_at_rest(size, speed, acceleration):
    """However the last digit of its speed falls."""
    profile = TipProfile.move(size, speed, acceleration)
    assert profile.final_velocity == 0.0
    assert simulate_pushes(PARAMETERS, profile)[0, 7] == 0.0


@pytest.mark.parametrize("rest", [7e-15, -7e-15, 0.0])
def test_a_rounding_of_the_last_speed_is_none(rest):
    stop = TipProfile([0.03, 0.03], [80.0, 80.0], [0.0, (rest - 80.0) / 0.03])
    trace = simulate_push(PARAMETERS, stop)
    assert stop.final_velocity == 0.0 and trace.final_velocity == 0.0
    assert trace.duration < 1.0 and trace.final_position > stop.stroke  # it slides on beyond the tip
    assert TipProfile([1.0], [1e-8], [0.0]).final_velocity == 1e-8  # a slow tip is no rounding


def test_a_move_by_the_printed_model_ends_where_it_ends():
    """2.06697 mm, by steps of the differential equations; the last speed of this move is 7e-15 mm/s."""
    trace = simulate_push(preset("printed").model, TipProfile.move(1.4, 80.0, 2560.0))
    assert trace.final_velocity == 0.0 and trace.final_position == pytest.approx(2.06697, abs=1e-5)


def test_position_and_speed_are_those_of_the_segments():
    profile = TipProfile(
        np.array([0.1, 0.2, 0.1]), np.array([5.0, -1.0, 2.0]), np.array([10.0, 0.0, -30.0]), -0.3
    )
    times = np.array([0.0, 0.03, 0.15, 0.35, 0.4, 0.5])
    wanted = np.array([tip_at(profile.segments, profile.start, t) for t in times])
    np.testing.assert_allclose(profile.position(times), wanted[:, 0], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(profile.velocity_at(times), wanted[:, 1], rtol=1e-12, atol=1e-12)
    assert profile.velocity_at(0.1) == -1.0  # where the speed jumps, the one after
    assert profile.position(-1.0) == -0.3


def test_profiles_are_joined_and_compared():
    one, two = TipProfile.constant_speed(10.0, 0.1, start=-0.5), TipProfile.move(-1.0, 5.0, 100.0, start=7.0)
    both = one.then(two)
    assert both.start == -0.5
    assert both.stroke == pytest.approx(0.0, abs=1e-12)
    assert both == one.then(two)
    assert len({both, one.then(two), one}) == 2
    assert one != two
    assert one.replace(start=0.0).stroke == one.stroke
    with pytest.raises(ValueError, match="read-only"):
        both.duration[0] = 1.0


def test_samples_are_joined_by_straight_lines():
    time, position = np.array([0.0, 0.01, 0.03]), np.array([-0.1, 0.3, 0.2])
    profile = TipProfile.sampled(time, position)
    np.testing.assert_allclose(profile.position(time), position, atol=1e-15)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TipProfile.sampled([0.0, 0.2, 0.1], [0.0, 1.0, 2.0]), r"time must be increasing \(s\)"),
        (lambda: TipProfile.sampled([0.0], [0.0]), "time and position must be of one length >= 2"),
        (lambda: TipProfile.constant_speed(0.0, 1.0), r"speed must be > 0 \(mm/s\); got 0.0"),
        (lambda: TipProfile.move(0.0, 1.0, 1.0), r"distance must be other than 0 \(mm\)"),
        (lambda: TipProfile.move(1.0, 1.0, -1.0), r"acceleration must be > 0 \(mm/s\^2\); got -1.0"),
        (
            lambda: TipProfile(np.array([0.0]), np.ones(1), np.ones(1)),
            r"duration must be > 0 in every segment \(s\); got 0.0",
        ),
        (
            lambda: TipProfile(np.ones(1), np.array([np.nan]), np.ones(1)),
            r"velocity\[0\] must be finite \(mm/s\)",
        ),
        (lambda: TipProfile(np.ones(2), np.ones(1), np.ones(1)), "of one length >= 1"),
        (
            lambda: gentle_profile(preset("printed").model, -1.0, 10.0),
            r"distance must be > 0 \(mm\); got -1.0",
        ),
        (lambda: tap_profile(1.0, 0.0), r"speed must be > 0 \(mm/s\); got 0.0"),
    ],
)
def test_bad_profiles_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def scaled(model, factors):
    return [model.replace(mu_static=model.mu_static * f, mu_kinetic=model.mu_kinetic * f) for f in factors]


def test_a_gentle_push_ends_where_it_stops_whatever_the_friction():
    """18.9 kg, 40 mm/s, 5 mm, friction times 0.9, 1 and 1.1: at constant speed, and gently."""
    models = scaled(preset("printed").model, (0.9, 1.0, 1.1))
    stop = 40.0**2 / 2 / 2560.0
    hard = TipProfile(
        np.array([(5.0 - stop) / 40.0, 40.0 / 2560.0]), np.array([40.0, 40.0]), np.array([0.0, -2560.0])
    )
    thrown, led = simulate_pushes(models, hard), simulate_pushes(models, gentle_profile(models[1], 5.0, 40.0))
    np.testing.assert_allclose(1e3 * (thrown[:, 0] - 5.0), (427, 277, 165), atol=0.5)
    np.testing.assert_allclose(1e3 * (led[:, 0] - 5.0), (0.2, -1.0, -3.8), atol=0.05)
    assert thrown[1, 2] == pytest.approx(192, abs=0.5)
    assert led[1, 2] == pytest.approx(49, abs=0.5)
    assert np.ptp(thrown[:, 0]) > 65 * np.ptp(led[:, 0])


@pytest.mark.parametrize("distance", [0.3, 0.5, 1.0, 3.0])
@pytest.mark.parametrize("speed", [5.0, 10.0, 20.0, 40.0])
def test_ramps_of_whole_periods_leave_only_the_spring_uncertain(distance, speed):
    """18.9 kg, friction times 0.92 and 1.08: the part trails by F_k/k, and little else depends on friction."""
    model = preset("printed").model
    trail = 0.08 * model.coulomb_force / model.contact_stiffness
    ends = simulate_pushes(
        scaled(model, (0.92, 1.08)), gentle_profile(model, distance, speed, whole_periods=True)
    )[:, 0]
    assert abs(ends[0] - ends[1]) < 2 * 1.6 * trail


@given(
    st.floats(1e-3, 10.0), st.floats(0.2, 120.0), st.sampled_from(["printed", "identified"]), st.booleans()
)
def test_a_gentle_push_goes_as_far_as_told_within_its_limits(distance, speed, name, whole):
    profile = gentle_profile(preset(name).model, distance, speed, whole_periods=whole)
    edges = np.concatenate(((0.0,), np.cumsum(profile.duration)))
    assert profile.position(edges).max() == pytest.approx(distance, rel=1e-9)
    assert profile.stroke == pytest.approx(distance - 0.5, rel=1e-9)
    ends = profile.velocity + profile.acceleration * profile.duration
    assert ends.max() <= speed * (1 + 1e-9)
    assert np.abs(profile.velocity[1:] - ends[:-1]).max() < 1e-9 * speed + 1e-12
    assert np.abs(profile.acceleration).max() <= 2560.0


@pytest.mark.parametrize(
    ("name", "mass", "least"), [("printed", 18.9, 2.1), ("printed", 0.8, 0.03), ("identified", 5.0, 4.6)]
)
@pytest.mark.parametrize("speed", [3.0, 10.0, 40.0])
def test_taps_move_a_part_by_any_travel_above_a_small_one(name, mass, least, speed):
    """Travel grows with the stroke; its smallest is an eighth of the jump of a slow push (printed), and no
    gap comes after.
    """
    model = preset(name).model.replace(mass=mass)
    closing = model.breakaway_force / model.contact_stiffness
    strokes = closing * np.geomspace(0.2, 5.0, 2000)
    travel = 1e3 * simulate_pushes(model, [tap_profile(stroke, speed) for stroke in strokes])[:, 0]
    assert np.all(np.diff(travel) > -1e-9)
    first = np.argmax(travel > 1e-6)
    assert 0.0 < travel[first] < least
    assert np.diff(travel[first:]).max() < 0.25 * least + 2e3 * np.diff(strokes).max()


def test_a_retract_makes_the_smallest_jump_small():
    """Slowly to breaking away, then held or drawn back: 18.9 kg."""
    model = preset("printed").model
    k, b = model.contact_stiffness, model.contact_damping
    slow = TipProfile.constant_speed(1.0, (model.breakaway_force - b) / k + 1e-7)
    held = slow.then(TipProfile(np.array([0.1]), np.array([0.0]), np.array([0.0])))
    drawn = slow.then(TipProfile.move(-0.5, 100.0, 2560.0))
    assert 1e3 * simulate_push(model, held).final_position > 10.0
    assert 1e3 * simulate_push(model, drawn).final_position < 5.0


@pytest.mark.parametrize(
    ("mass", "speed", "least", "most"),
    [(0.8, 40.0, 0.0, 0.0), (18.9, 10.0, 3e-3, 7e-3), (18.9, 40.0, 0.2, 0.3)],
)
def test_a_heavy_part_leaves_a_gentle_tip_for_a_moment(mass, speed, least, most):
    """As far as it says, before the tip is drawn back; in whole periods it does not."""
    model = preset("printed").model.replace(mass=mass)
    slides = [simulate_push(model, gentle_profile(model, d, speed)).free_slide for d in (1.0, 3.0, 5.0, 10.0)]
    assert least <= max(slides) <= most
    whole = gentle_profile(model, 5.0, speed, whole_periods=True)
    assert simulate_push(model, whole).free_slide < 1e-3
