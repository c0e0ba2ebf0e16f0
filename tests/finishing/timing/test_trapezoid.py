"""Trapezoids and seven-piece laws from rest to rest, against their closed forms and each other."""

from math import sqrt

import numpy as np
import pytest
from finishing_inside import double_s_law, trapezoid_law
from hypothesis import given, settings
from hypothesis import strategies as st
from timing_paths import ARM, LINE, SMOOTH, TABLE, line, sine, wavy

from sdpgrind.finishing.timing import Trapezoid, time_laws

rates = st.floats(1e-2, 1e3)


@pytest.mark.parametrize(("speed", "share"), [(12.5, 0.56), (25.0, 0.28), (37.5, 0.19)])
def test_mean_feed_of_a_stop_at_every_corner(speed, share):
    """The spec's table: pitch 0.2 mm, 1000 mm/s^2."""
    assert Trapezoid(0.2, speed, 1000.0).mean_share == pytest.approx(share, abs=0.005)


def test_a_commanded_speed_is_touched_from_v2_over_length():
    least = 37.5**2 / 0.2
    assert least == pytest.approx(7031.25)
    assert Trapezoid(0.2, 37.5, least * (1 + 1e-12)).reached
    assert not Trapezoid(0.2, 37.5, least * (1 - 1e-9)).reached


def test_no_way_takes_no_time():
    nothing = Trapezoid(0.0, 25.0, 1000.0)
    assert (nothing.duration, nothing.peak, nothing.mean_share) == (0.0, 0.0, 0.0)


@given(rates, rates, rates)
def test_closed_form_is_the_spec(length, speed, acceleration):
    found = Trapezoid(length, speed, acceleration)
    reaches = length >= speed**2 / acceleration
    expected = length / speed + speed / acceleration if reaches else 2 * sqrt(length / acceleration)
    assert found.duration == pytest.approx(expected, rel=1e-12)
    assert found.peak == pytest.approx(speed if reaches else sqrt(length * acceleration), rel=1e-12)


@given(rates, rates, rates)
def test_law_goes_the_way_in_the_closed_time(length, speed, acceleration):
    shape = Trapezoid(length, speed, acceleration)
    law = trapezoid_law(7.0, shape)
    end = law.at(law.duration)
    assert law.duration == pytest.approx(shape.duration, rel=1e-9)
    assert end.length == pytest.approx(7.0 + length, rel=1e-9)
    rounding = 4 * np.finfo(float).eps * law.duration * acceleration  # the last knot, to the last digit
    assert abs(end.feed) <= 1e-12 * shape.peak + rounding
    assert np.max(law.feed) <= speed * (1 + 1e-9)


@pytest.mark.parametrize(
    ("length", "speed", "acceleration", "jerk", "duration"),
    [
        (100.0, 20.0, 200.0, 4e3, 100 / 20 + 20 / 200 + 200 / 4e3),  # all seven pieces
        (100.0, 20.0, 2000.0, 4e3, 100 / 20 + 2 * sqrt(20 / 4e3)),  # greatest acceleration not reached
        (0.5, 1e3, 1e6, 4e3, 4 * (0.5 / (2 * 4e3)) ** (1 / 3)),  # neither speed nor acceleration reached
    ],
)
def test_seven_pieces_in_closed_form(length, speed, acceleration, jerk, duration):
    law = double_s_law(0.0, Trapezoid(length, speed, acceleration), jerk)
    assert law.duration == pytest.approx(duration, rel=1e-9)


def test_seven_pieces_without_a_cruise_meet_the_way():
    """Speed not reached, acceleration reached: two equal ramps of v/a + a/j with v from L = v (v/a + a/j)."""
    length, acceleration, jerk = 1.0, 200.0, 4e3
    law = double_s_law(0.0, Trapezoid(length, 1e3, acceleration), jerk)
    peak = law.at(law.duration / 2).feed
    assert peak * (peak / acceleration + acceleration / jerk) == pytest.approx(length, rel=1e-12)
    assert law.duration == pytest.approx(2 * (peak / acceleration + acceleration / jerk), rel=1e-12)


@settings(deadline=None)
@given(rates, rates, rates, st.floats(1.0, 1e6))
def test_seven_pieces_keep_all_limits_and_come_to_rest(length, speed, acceleration, jerk):
    shape = Trapezoid(length, speed, acceleration)
    law = double_s_law(0.0, shape, jerk)
    course = law.at(np.linspace(0.0, law.duration, 400))
    end = law.at(law.duration)
    assert np.max(course.feed) <= speed * (1 + 1e-9)
    assert np.max(np.abs(course.acceleration)) <= acceleration * (1 + 1e-9)
    assert np.max(np.abs(law.jerk)) <= jerk * (1 + 1e-9)
    assert end.length == pytest.approx(length, rel=1e-6)
    assert law.duration >= shape.duration * (1 - 1e-9)  # no faster than with free jerk


def test_great_jerk_gives_the_trapezoid_back():
    shape = Trapezoid(10.0, 25.0, 500.0)
    assert double_s_law(0.0, shape, 1e12).duration == pytest.approx(shape.duration, rel=1e-6)


def runs_of_limits():
    """A line for two joints, and curves on which joints are slowed between corners."""
    return {
        "line": (line(30.0), LINE),
        "wavy": (wavy(3), ARM),
        "sine": (sine(), TABLE),
        "jerk": (wavy(7), SMOOTH),
    }


@pytest.mark.parametrize("name", runs_of_limits())
def test_more_acceleration_is_never_slower(name):
    """Ramps are slowed by the root of what is too steep for a joint; gentler ones are taken then. Of three
    that are tried the fastest is within 3 % of the best; measured: 1.7 %.
    """
    run, limits = runs_of_limits()[name]
    times = [
        time_laws([run], limits, feed_rate=40.0, acceleration=each)[0].duration
        for each in np.geomspace(10.0, 1e5, 17)
    ]
    assert (np.array(times) <= 1.03 * np.minimum.accumulate(times)).all()
    assert times[-1] < times[0]


def test_a_line_takes_the_ramps_that_its_joint_allows():
    """By the closed form: 500 mm/s^2 of the joint, whatever more is asked for."""
    (law,) = time_laws([line(30.0)], LINE, feed_rate=25.0, acceleration=4000.0)
    assert law.duration == pytest.approx(Trapezoid(30.0, 25.0, 500.0).duration, rel=1e-9)
