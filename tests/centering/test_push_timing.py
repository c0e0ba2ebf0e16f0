import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from centering.push import move_peak, move_time, stopping_way
from sdpgrind import units

A = 2560.0
speeds, accelerations = st.floats(1.0, 150.0), st.floats(100.0, 5000.0)
distances, jerks = st.floats(1e-3, 100.0), st.floats(1e3, 1e7)


def _travelled(time, peak, a, j):
    """Distance of two ramps of limited jerk and a cruise between, phase by phase; the second ramp mirrors the
    first.
    """
    top = min(a, math.sqrt(peak * j))  # acceleration that is reached
    x = v = accelerated = 0.0
    for duration, jerk in ((top / j, j), (peak / top - top / j, 0.0), (top / j, -j)):
        x += v * duration + accelerated * duration**2 / 2 + jerk * duration**3 / 6
        v += accelerated * duration + jerk * duration**2 / 2
        accelerated += jerk * duration
        time -= 2 * duration
    assert math.isclose(v, peak, rel_tol=1e-9) and time > -1e-9
    return 2 * x + peak * time


def test_stop_of_the_source():
    stop = stopping_way(274.3, A)
    assert math.isclose(stop.time, 0.10715, abs_tol=1e-5) and math.isclose(
        stop.distance, 14.6954, rel_tol=1e-5
    )


def test_move_of_the_specification():
    assert math.isclose(move_time(7.5, speed=units.mm_per_min(5000), acceleration=A), 0.122552, abs_tol=1e-6)


def test_following_over_a_whole_gap_cannot_be_faster():
    """Of the published 0.11 s: the fastest way to 99 % of the gap; then the last of the brake is still to
    come.
    """
    gap, v = 7.928, 120.0
    whole = move_time(gap, speed=v, acceleration=A)
    assert math.isclose(whole, 0.1129, abs_tol=1e-4)
    last = math.sqrt(2 * 0.01 * gap / A)  # s: the last hundredth of the gap, braking to rest
    assert math.isclose(whole - last, 0.10507, abs_tol=1e-5)


@given(distances, speeds, accelerations)
def test_trapezoid_covers_its_distance(d, v, a):
    time, peak = move_time(d, speed=v, acceleration=a), move_peak(d, speed=v, acceleration=a)
    cruise = time - 2 * peak / a
    assert cruise >= -1e-12 and math.isclose(peak * peak / a + peak * cruise, d, rel_tol=1e-9)


@given(distances, speeds, accelerations)
def test_printed_time_is_too_long_by_the_ramp(d, v, a):
    if d * a >= v * v:
        late = move_time(d, speed=v, acceleration=a, timing="printed") - move_time(d, speed=v, acceleration=a)
        assert math.isclose(late, v / a, rel_tol=1e-9)


@given(distances, speeds, accelerations, jerks)
def test_jerk_limited_move_covers_its_distance(d, v, a, j):
    time, peak = (f(d, speed=v, acceleration=a, jerk=j) for f in (move_time, move_peak))
    assert peak <= v
    assert math.isclose(_travelled(time, peak, a, j), d, rel_tol=1e-8)


@given(distances, accelerations, jerks)
def test_peak_speed_is_the_root_of_its_equation(d, a, j):
    def ramp(v):
        return v / a + a / j if v * j >= a * a else 2 * math.sqrt(v / j)

    root = brentq(lambda v: v * ramp(v) - d, 0.0, math.sqrt(a * d) * (1 + 1e-9), xtol=1e-13)
    assert math.isclose(move_peak(d, speed=1e9, acceleration=a, jerk=j), root, rel_tol=1e-8, abs_tol=1e-10)


def test_jerk_limited_times_by_hand():
    """Without limits of speed and acceleration t = (32 d/j)^(1/3); with a great jerk the trapezoid."""
    assert math.isclose(
        move_time(4.0, speed=1e6, acceleration=1e9, jerk=1e4), (32 * 4.0 / 1e4) ** (1 / 3), rel_tol=1e-12
    )
    trapezoid = move_time(4.0, speed=50.0, acceleration=A)
    assert math.isclose(move_time(4.0, speed=50.0, acceleration=A, jerk=1e12), trapezoid, rel_tol=1e-6)


def test_jerk_takes_time_continuously():
    times = [move_time(3.0, speed=80.0, acceleration=A, jerk=j) for j in np.geomspace(1e3, 1e8, 400)]
    assert np.all(np.diff(times) < 0)
    assert max(abs(np.diff(times, 2))) < 0.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"distance": -1.0}, r"distance must be >= 0 \(mm\); got -1.0"),
        ({"speed": 0.0}, r"speed must be > 0 \(mm/s\); got 0.0"),
        ({"acceleration": -1.0}, r"acceleration must be > 0 \(mm/s\^2\); got -1.0"),
        ({"jerk": 0.0}, r"jerk must be > 0 \(mm/s\^3\); got 0.0"),
        ({"timing": "legacy"}, "timing must be one of exact, printed; got 'legacy'"),
        (
            {"timing": "printed", "jerk": 1e5},
            r"jerk must be infinite where timing is printed \(mm/s\^3\); got 100000.0",
        ),
    ],
)
def test_bad_moves_are_refused(arguments, message):
    given_ = {"distance": 1.0, "speed": 10.0, "acceleration": A, **arguments}
    with pytest.raises(ValueError, match=message):
        move_time(given_.pop("distance"), **given_)
