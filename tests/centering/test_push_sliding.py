import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from centering import preset
from centering.push.turning import launch_for, ring_friction, slide_to_rest

MODEL = preset("printed").model
BRAKE = 0.15 * 9807.0  # mm/s^2
R = MODEL.part.radius
PLACES = 2 * np.pi * (np.arange(2000) + 0.5) / 2000


def _shares(v, s):
    """Mean friction of many pieces of the ring, each against its own slip."""
    along, across = v - s * np.sin(PLACES), s * np.cos(PLACES)
    size = np.hypot(along, across)
    return np.mean(along / size), np.mean((across * np.cos(PLACES) - along * np.sin(PLACES)) / size)


@pytest.mark.parametrize("ratio", [1e-4, 0.019, 0.021, 0.3, 0.9, 1.2, 7.0, 49.0, 51.0, 1e4])
def test_friction_is_the_sum_over_the_ring(ratio):
    friction = ring_friction(2.0, 2.0 * ratio)
    np.testing.assert_allclose(friction, _shares(1.0, ratio), rtol=1e-7)


@pytest.mark.parametrize("edge", [0.02, 50.0])
def test_series_and_closed_form_meet(edge):
    below, above = (np.array(ring_friction(1.0, edge * (1 + e))) for e in (-1e-9, 1e-9))
    np.testing.assert_allclose(above, below, rtol=3e-9)


@given(st.floats(0.0, 1e3), st.floats(1e-3, 1e3))
def test_friction_is_bounded_and_symmetric(v, s):
    friction, turned = ring_friction(v, s), ring_friction(s, v)
    assert math.isclose(friction.force, turned.moment, abs_tol=1e-12)
    assert friction.force + friction.moment >= 1 - 1e-12
    assert math.hypot(*friction) <= 1 + 1e-12


def test_pure_motions_are_those_of_school():
    assert slide_to_rest(MODEL, speed=50.0, spin=0.0) == (50.0**2 / (2 * BRAKE), 0.0, 50.0 / BRAKE)
    spun = slide_to_rest(MODEL, speed=0.0, spin=-2.0)
    assert (
        spun.distance == 0.0
        and math.isclose(spun.turn, -(4.0 * R / (2 * BRAKE)))
        and math.isclose(spun.time, 2 * R / BRAKE)
    )


@pytest.mark.parametrize(("speed", "spin"), [(100.0, 0.3), (60.0, 60.0 / 89.5), (40.0, -1.5), (5.0, 4.0)])
def test_slide_is_that_of_the_equations_of_motion(speed, spin):
    """(2.6) and (2.7) with the friction summed over the ring, stepped in time."""

    def motion(_, y):
        force, moment = _shares(y[2], R * y[3])
        return [y[2], y[3], -BRAKE * force, -BRAKE * moment / R]

    def rests(_, y):
        return math.hypot(y[2], R * y[3]) - 1e-3 * speed

    rests.terminal = True
    run = solve_ivp(
        motion, (0.0, 1.0), [0.0, 0.0, speed, abs(spin)], events=rests, rtol=1e-7, atol=1e-9, max_step=1e-3
    )
    slide = slide_to_rest(MODEL, speed=speed, spin=spin)
    assert math.isclose(slide.distance, run.y[0, -1], rel_tol=1e-5)  # what is left then is 1e-6 of it
    assert math.isclose(slide.turn, math.copysign(run.y[1, -1], spin), rel_tol=1e-5)
    assert math.isclose(slide.time, run.t[-1], rel_tol=3e-3)


def test_spin_carries_farther():
    far = [slide_to_rest(MODEL, speed=30.0, spin=w).distance for w in (0.0, 0.1, 0.5, 1.0, 3.0)]
    assert all(np.diff(far) > 0)


@settings(max_examples=15, deadline=None)
@given(st.floats(1e-3, 20.0), st.floats(-0.3, 0.3))
def test_inverse_brings_the_ring_there(distance, turn):
    launch = launch_for(MODEL, distance=distance, turn=turn)
    slide = slide_to_rest(MODEL, speed=launch.speed, spin=launch.spin)
    scale = distance + R * abs(turn)
    assert math.isclose(slide.distance, distance, abs_tol=1e-8 * scale) and math.isclose(
        R * slide.turn, R * turn, abs_tol=1e-8 * scale
    )


@settings(max_examples=10, deadline=None)
@given(st.floats(1.0, 200.0), st.floats(0.01, 5.0))
def test_there_is_one_pair_of_speeds(speed, spin):
    slide = slide_to_rest(MODEL, speed=speed, spin=spin)
    launch = launch_for(MODEL, distance=slide.distance, turn=slide.turn)
    size = math.hypot(speed, R * spin)
    assert math.isclose(launch.speed, speed, abs_tol=1e-6 * size) and math.isclose(
        launch.spin * R, spin * R, abs_tol=1e-6 * size
    )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: ring_friction(0.0, 0.0),
            r"speed must be > 0 where the ring does not spin \(mm/s\); got 0.0",
        ),
        (lambda: ring_friction(-1.0, 0.0), r"speed must be >= 0 \(mm/s\); got -1.0"),
        (lambda: slide_to_rest(MODEL, speed=-1.0, spin=0.0), r"speed must be >= 0 \(mm/s\); got -1.0"),
        (lambda: launch_for(MODEL, distance=-1.0, turn=0.0), r"distance must be >= 0 \(mm\); got -1.0"),
        (lambda: launch_for(MODEL, distance=1.0, turn=math.inf), r"turn must be finite \(rad\); got inf"),
    ],
)
def test_bad_values_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    ("distance", "turn"), [(1e-9, 1.0), (1e-6, 1.0), (1e-4, 2.0), (5.0, 1e-12), (50.0, 1e-7), (1e-3, -0.5)]
)
def test_launch_of_nearly_pure_motions_is_that_of_the_slide(distance, turn):
    launch = launch_for(MODEL, distance=distance, turn=turn)
    slide = slide_to_rest(MODEL, speed=launch.speed, spin=launch.spin)
    assert slide.distance == pytest.approx(distance, rel=1e-6) and slide.turn == pytest.approx(turn, rel=1e-6)


@pytest.mark.parametrize("size", [1e-300, 1.0, 1e308])
@pytest.mark.parametrize("apart", [0.0, 1e-16, 1e-12, 1e-9, 1e-6])
def test_friction_of_nearly_equal_speeds_is_that_of_equal_ones(apart, size):
    """By the slope of the shares there, apart (ln(4/apart) + 1)/pi is more than they differ."""
    shares = ring_friction(size, size * (1.0 - apart))
    assert list(shares) == pytest.approx([2.0 / np.pi] * 2, abs=20.0 * apart + 1e-12)
